// The canvas above the picture: marks of the scene's points, drawn with the camera of the picture below.

import { add, axesOf, dot, eyeOf, fromCamera, scale } from "./camera.js";

/** Nothing nearer than this share of the scene's size is drawn. */
const NEAR = 1e-4;

export class Marks {
  /** `shown()` gives the view on the screen, `sceneSize()` the diagonal of the scene. */
  constructor(canvas, shown, sceneSize) {
    this.canvas = canvas;
    this.shown = shown;
    this.sceneSize = sceneSize;
    this.layers = [];
    new ResizeObserver(() => this.redraw()).observe(canvas);
  }

  /** Adds a painter, which is called with a Pen. */
  add(layer) {
    this.layers.push(layer);
  }

  /** Draws all layers, once for each animation frame. */
  redraw() {
    this.frame ??= requestAnimationFrame(() => {
      this.frame = null;
      this.draw();
    });
  }

  draw() {
    const ratio = window.devicePixelRatio;
    const size = [this.canvas.clientWidth, this.canvas.clientHeight];
    const [width, height] = size.map((side) => Math.round(side * ratio));
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
    const context = this.canvas.getContext("2d");
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, ...size);
    const shown = this.shown();
    if (!shown || !size[1]) return;
    const pen = new Pen(context, fromCamera(shown.camera, this.sceneSize()), size);
    for (const layer of this.layers) layer(pen);
  }
}

/** Draws points, lines and texts of the scene. Each has a dark edge, so that it is seen on any picture. */
class Pen {
  /** The window shows a camera's state; its size is in CSS pixels. */
  constructor(context, state, size) {
    const focalPx = (0.5 * size[1]) / Math.tan((state.fovY * Math.PI) / 360);
    Object.assign(this, { context, size, focalPx, eye: eyeOf(state), axes: axesOf(state), near: NEAR * state.size });
    context.lineCap = "round";
    context.font = "600 12px system-ui, sans-serif";
    context.textBaseline = "middle";
  }

  /** A point in the camera's axes: rightwards, upwards, and the planar depth. */
  inCamera(point) {
    const offset = add(point, scale(this.eye, -1));
    return [dot(offset, this.axes[0]), dot(offset, this.axes[1]), -dot(offset, this.axes[2])];
  }

  onWindow([x, y, planarDepth]) {
    return [this.size[0] / 2 + (this.focalPx * x) / planarDepth, this.size[1] / 2 - (this.focalPx * y) / planarDepth];
  }

  /** The place of a point in the window; null behind the camera. */
  place(point) {
    const seen = this.inCamera(point);
    return seen[2] > this.near ? this.onWindow(seen) : null;
  }

  /** The two ends of a line in the window, cut where it passes the camera; null behind the camera. */
  ends(from, to) {
    const [a, b] = [this.inCamera(from), this.inCamera(to)];
    if (a[2] <= this.near && b[2] <= this.near) return null;
    return [this.onWindow(this.cut(a, b)), this.onWindow(this.cut(b, a))];
  }

  cut(end, other) {
    if (end[2] > this.near) return end;
    const share = (this.near * 1.001 - end[2]) / (other[2] - end[2]);
    return end.map((v, i) => v + (other[i] - v) * share);
  }

  /** Strokes a path, given by a function of the context. */
  stroke(path, color, width) {
    for (const [style, wide] of [["#000a", width + 2], [color, width]]) {
      this.context.beginPath();
      path(this.context);
      this.context.strokeStyle = style;
      this.context.lineWidth = wide;
      this.context.stroke();
    }
  }

  /** Lines between pairs of points of the scene. */
  lines(pairs, color, width) {
    const ends = pairs.map(([from, to]) => this.ends(from, to)).filter(Boolean);
    this.stroke((context) => ends.forEach(([from, to]) => {
      context.moveTo(...from);
      context.lineTo(...to);
    }), color, width);
  }

  /** A text beside a place in the window. */
  text(text, [x, y], color) {
    this.context.strokeStyle = "#000c";
    this.context.lineWidth = 3;
    this.context.lineJoin = "round";
    this.context.strokeText(text, x, y);
    this.context.fillStyle = color;
    this.context.fillText(text, x, y);
  }
}
