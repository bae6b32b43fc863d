// A camera: pure functions from a state and an event to a state. Points are in the coordinates of the scene's file, +Y up.
//
// A state is { target, yaw, pitch, distance, fovY, size, isFlying }. Yaw 0 looks along -Z, pitch is positive from above, both in
// radians; fovY is the full vertical field of view in degrees; size is the diagonal of the scene.

const STEEPEST = 1.55;
const NEAREST = 1e-4;
const FARTHEST = 50;
const STEP = 0.1;
const ZOOM_STEP = 1.15;
const SHARE_PER_SECOND = 0.25;
const FASTER = 4;

export const add = (a, b) => a.map((v, i) => v + b[i]);
export const scale = (a, s) => a.map((v) => v * s);
export const length = (a) => Math.hypot(...a);
export const dot = (a, b) => a.reduce((sum, v, i) => sum + v * b[i], 0);
const clamp = (v, low, high) => Math.min(high, Math.max(low, v));

/** The unit vector from the target to the eye. */
function backward({ yaw, pitch }) {
  return [Math.sin(yaw) * Math.cos(pitch), Math.sin(pitch), Math.cos(yaw) * Math.cos(pitch)];
}

/** The unit vectors of a camera: rightwards, upwards, and from the target to the eye. */
export function axesOf({ yaw, pitch }) {
  const up = [-Math.sin(yaw) * Math.sin(pitch), Math.cos(pitch), -Math.cos(yaw) * Math.sin(pitch)];
  return [[Math.cos(yaw), 0, -Math.sin(yaw)], up, backward({ yaw, pitch })];
}

export function eyeOf(state) {
  return add(state.target, scale(backward(state), state.distance));
}

/** The state of a camera of the protocol: { eye, target, fov_y_deg }. */
export function fromCamera(camera, size, isFlying = false) {
  const back = add(camera.eye, scale(camera.target, -1));
  const distance = Math.max(length(back), NEAREST * size, 1e-30);
  const pitch = clamp(Math.asin(clamp(back[1] / distance, -1, 1)), -STEEPEST, STEEPEST);
  return { target: camera.target, yaw: Math.atan2(back[0], back[2]), pitch, distance, fovY: camera.fov_y_deg, size, isFlying };
}

export function toCamera(state) {
  return { eye: eyeOf(state), target: state.target, fov_y_deg: state.fovY };
}

/** Turns around the pivot, or looks around while flying. Angles in radians. */
export function turn(state, byYaw, byPitch) {
  const turned = { ...state, yaw: state.yaw + byYaw, pitch: clamp(state.pitch + byPitch, -STEEPEST, STEEPEST) };
  if (!state.isFlying) return turned;
  return { ...turned, target: add(eyeOf(state), scale(backward(turned), -state.distance)) };
}

/** Moves the picture by pixels of a canvas of this height: the pivot's plane follows the pointer. */
export function pan(state, columns, rows, heightPx) {
  const perPixel = (2 * state.distance * Math.tan((state.fovY * Math.PI) / 360)) / heightPx;
  const [right, up] = axesOf(state);
  const moved = add(scale(right, -columns * perPixel), scale(up, rows * perPixel));
  return { ...state, target: add(state.target, moved) };
}

/** Comes closer to the pivot by a factor above 1, or goes away. */
export function dolly(state, factor) {
  const distance = clamp(state.distance / factor, NEAREST * state.size, FARTHEST * state.size);
  if (!state.isFlying) return { ...state, distance };
  return { ...state, target: add(state.target, scale(backward(state), distance - state.distance)) };
}

/** Flies along its own axes: rightwards, upwards, forwards, each -1 to 1, for some seconds. */
export function fly(state, [x, y, z], seconds, isFast) {
  const share = SHARE_PER_SECOND * (isFast ? FASTER : 1) * seconds * state.size;
  const [right, , back] = axesOf(state);
  const moved = add(add(scale(right, x * share), [0, y * share, 0]), scale(back, -z * share));
  return { ...state, target: add(state.target, moved) };
}

/** Shows all of a scene with these corners, in a window with this ratio of width to height. */
export function fit(state, [low, high], aspect) {
  const size = length(add(high, scale(low, -1)));
  const slope = Math.tan((state.fovY * Math.PI) / 360) * Math.min(1, aspect);
  // The sphere around the scene touches the nearer sides of the view.
  const distance = (0.5 * size) / Math.sin(Math.atan(slope));
  return { ...state, target: scale(add(low, high), 0.5), distance, size };
}

/** Makes a point the pivot. Around it, the view moves sideways only; a flying camera stays and turns to it. */
export function pivotAt(state, point) {
  const [eye, back] = [eyeOf(state), backward(state)];
  const fromPoint = add(eye, scale(point, -1));
  const distance = state.isFlying ? length(fromPoint) : dot(fromPoint, back);
  if (distance < NEAREST * state.size) return state;
  if (!state.isFlying) return { ...state, target: point, distance };
  return fromCamera({ eye, target: point, fov_y_deg: state.fovY }, state.size, true);
}

/** One key press, or the same state for other keys. */
export function press(state, key) {
  const steps = { ArrowLeft: [-STEP, 0], ArrowRight: [STEP, 0], ArrowUp: [0, STEP], ArrowDown: [0, -STEP] };
  // A flying camera looks where the arrow points.
  if (steps[key]) return turn(state, ...scale(steps[key], state.isFlying ? -1 : 1));
  if (key === "+" || key === "=") return dolly(state, ZOOM_STEP);
  if (key === "-") return dolly(state, 1 / ZOOM_STEP);
  return state;
}

/** The pose as a link's fragment: #c=EYE;TARGET;FOV. */
export function toFragment(state) {
  const number = (v) => Number(v.toPrecision(12)).toString();
  const point = (p) => p.map(number).join(",");
  return `#c=${point(eyeOf(state))};${point(state.target)};${number(state.fovY)}`;
}

/** The camera in a link's fragment; null where there is none. */
export function fromFragment(fragment) {
  // A browser may write the semicolons in another way.
  const parts = /^#c=([^;]+);([^;]+);([^;]+)$/.exec(fragment.replaceAll("%3B", ";").replaceAll("%2C", ","));
  if (!parts) return null;
  const [eye, target] = [parts[1], parts[2]].map((text) => text.split(",").map(Number));
  const fov = Number(parts[3]);
  const isPoint = (p) => p.length === 3 && p.every((v) => Number.isFinite(v) && Math.abs(v) <= 1e12);
  const isCamera = isPoint(eye) && isPoint(target) && fov >= 1 && fov <= 170;
  return isCamera ? { eye, target, fov_y_deg: fov } : null;
}

/** Whether two states show the same picture. */
export function isSame(a, b) {
  const one = [...eyeOf(a), ...a.target, a.fovY];
  const other = [...eyeOf(b), ...b.target, b.fovY];
  return one.every((v, i) => Math.abs(v - other[i]) <= 1e-6 * Math.min(a.distance, 1));
}

/** The camera as a transforms.json with one frame, for a picture of this size. */
export function toTransforms(state, width, height) {
  const [[x, y, z], eye] = [axesOf(state), eyeOf(state)];
  const focal = (0.5 * height) / Math.tan((state.fovY * Math.PI) / 360);
  const row = (i) => [x[i], y[i], z[i], eye[i]];
  const frame = {
    w: width, h: height, fl_x: focal, fl_y: focal, cx: width / 2, cy: height / 2,
    transform_matrix: [row(0), row(1), row(2), [0, 0, 0, 1]],
  };
  return { camera_model: "PINHOLE", frames: [frame] };
}
