// The canvas above the picture: marks of the scene's points, drawn with the camera of the picture below.

import { fromCamera } from "./camera.js";
import { project, projectLine, viewOf } from "./projection.js";

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
    const pen = new Pen(context, viewOf(fromCamera(shown.camera, this.sceneSize()), size));
    for (const layer of this.layers) layer(pen);
  }
}

/** Draws points, lines and texts of the scene. Each has a dark edge, so that it is seen on any picture. */
export class Pen {
  constructor(context, view) {
    this.context = context;
    this.view = view;
    context.lineCap = "round";
    context.font = "600 12px system-ui, sans-serif";
    context.textBaseline = "middle";
  }

  /** The place of a point in the window; null behind the camera. */
  place(point) {
    return project(this.view, point);
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
    const ends = pairs.map(([from, to]) => projectLine(this.view, from, to)).filter(Boolean);
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

  /** The middle of the window. */
  middle() {
    return this.view.size.map((side) => side / 2);
  }
}
