// Points and lines of the scene on the window: pure functions. A view is { eye, axes, focalPx, size }, its size in CSS pixels.

import { add, axesOf, dot, eyeOf, scale } from "./camera.js";

/** Nothing nearer than this share of the scene's size is drawn. */
const NEAR = 1e-4;

/** The view of a camera's state in a window of this size. */
export function viewOf(state, size) {
  const focalPx = (0.5 * size[1]) / Math.tan((state.fovY * Math.PI) / 360);
  return { eye: eyeOf(state), axes: axesOf(state), focalPx, size, near: NEAR * state.size };
}

/** A point in the camera's axes: rightwards, upwards, and the planar depth. */
function inCamera({ eye, axes }, point) {
  const offset = add(point, scale(eye, -1));
  return [dot(offset, axes[0]), dot(offset, axes[1]), -dot(offset, axes[2])];
}

function onWindow({ focalPx, size }, [x, y, planarDepth]) {
  return [size[0] / 2 + (focalPx * x) / planarDepth, size[1] / 2 - (focalPx * y) / planarDepth];
}

/** The place of a point in the window; null behind the camera. */
export function project(view, point) {
  const seen = inCamera(view, point);
  return seen[2] > view.near ? onWindow(view, seen) : null;
}

/** The two ends of a line in the window, cut where it passes the camera; null behind the camera. */
export function projectLine(view, from, to) {
  const [a, b] = [inCamera(view, from), inCamera(view, to)];
  if (a[2] <= view.near && b[2] <= view.near) return null;
  const cut = (end, other) => {
    if (end[2] > view.near) return end;
    const share = (view.near * 1.001 - end[2]) / (other[2] - end[2]);
    return end.map((v, i) => v + (other[i] - v) * share);
  };
  return [onWindow(view, cut(a, b)), onWindow(view, cut(b, a))];
}
