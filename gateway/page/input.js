// Pointers, wheel and keys to events of the camera. Keys count while the canvas has the focus.

import { dolly, fly, pan, press, turn } from "./camera.js";

const FLY_KEYS = { w: [0, 0, 1], s: [0, 0, -1], a: [-1, 0, 0], d: [1, 0, 0], q: [0, -1, 0], e: [0, 1, 0] };
const WHEEL_PER_PIXEL = 0.0015;
const WHEEL_LINE_PX = 16;
/** A pointer that moves less has clicked. */
const DRAG_PX = 4;

export class Input {
  /**
   * `change(update, eventTime)` is called with a function from state to state; `command(key)` with other keys, and returns
   * whether it knows them; `click` and `doubleClick` with a place as shares of the canvas's width and height.
   */
  constructor(canvas, { change, command, click, doubleClick, isFlying }) {
    Object.assign(this, { canvas, change, command, click, isFlying });
    this.pointers = new Map();
    this.held = new Set();
    const on = (name, listener, options) => canvas.addEventListener(name, listener.bind(this), options);
    on("pointerdown", this.down);
    on("pointermove", this.move);
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) on(name, this.up);
    on("dblclick", (event) => doubleClick(this.place(event)));
    on("wheel", this.wheel, { passive: false });
    on("contextmenu", (event) => event.preventDefault());
    on("keydown", this.keydown);
    on("keyup", (event) => {
      this.isFast = event.shiftKey;
      this.held.delete(event.key.toLowerCase());
    });
    on("blur", () => this.held.clear());
  }

  down(event) {
    this.canvas.focus();
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    if (this.pointers.size > 1 || event.button !== 0) this.pressed = null;
    else this.pressed = [event.clientX, event.clientY];
  }

  up(event) {
    if (event.type === "pointerup" && this.pressed) this.click(this.place(event));
    this.pressed = null;
    this.pointers.delete(event.pointerId);
  }

  place(event) {
    return [event.offsetX / this.canvas.clientWidth, event.offsetY / this.canvas.clientHeight];
  }

  move(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    // A hand that trembles does not drag.
    if (this.pressed && Math.hypot(event.clientX - this.pressed[0], event.clientY - this.pressed[1]) < DRAG_PX) return;
    this.pressed = null;
    const after = [event.clientX, event.clientY];
    const [dx, dy] = [after[0] - before[0], after[1] - before[1]];
    const height = this.canvas.clientHeight;
    if (this.pointers.size >= 2) {
      this.pinch(event.pointerId, before, after, event.timeStamp);
    } else if (event.buttons & 2 || event.shiftKey) {
      this.change((state) => pan(state, dx, dy, height), event.timeStamp);
    } else {
      const angle = Math.PI / height;
      const sign = this.isFlying() ? -0.5 : 1;
      this.change((state) => turn(state, -dx * angle * sign, dy * angle * sign), event.timeStamp);
    }
    this.pointers.set(event.pointerId, after);
  }

  /** Two fingers: their middle pans, their distance comes closer. */
  pinch(id, before, after, eventTime) {
    const other = [...this.pointers].find(([key]) => key !== id)[1];
    const distance = (p) => Math.max(1, Math.hypot(p[0] - other[0], p[1] - other[1]));
    const [dx, dy] = [(after[0] - before[0]) / 2, (after[1] - before[1]) / 2];
    const factor = distance(after) / distance(before);
    this.change((state) => dolly(pan(state, dx, dy, this.canvas.clientHeight), factor), eventTime);
  }

  wheel(event) {
    event.preventDefault();
    const pixels = event.deltaY * (event.deltaMode === 1 ? WHEEL_LINE_PX : 1);
    // A pinch on a trackpad is a wheel with Ctrl, and finer.
    const factor = Math.exp(-pixels * WHEEL_PER_PIXEL * (event.ctrlKey ? 6 : 1));
    this.change((state) => dolly(state, factor), event.timeStamp);
  }

  keydown(event) {
    this.isFast = event.shiftKey;
    if (event.ctrlKey || event.metaKey || event.altKey || event.key === "Tab") return;
    const key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
    if (this.isFlying() && FLY_KEYS[key]) {
      event.preventDefault();
      if (!this.held.has(key)) this.startFlying(key, event.timeStamp);
    } else if (key.startsWith("Arrow") || ["+", "=", "-"].includes(key)) {
      event.preventDefault();
      this.change((state) => press(state, key), event.timeStamp);
    } else if (!event.repeat && this.command(key)) {
      event.preventDefault();
    }
  }

  startFlying(key, eventTime) {
    this.held.add(key);
    if (this.isStepping) return;
    this.isStepping = true;
    let last = eventTime;
    const step = (now) => {
      if (!this.isFlying()) this.held.clear();
      this.isStepping = this.held.size > 0;
      if (!this.isStepping) return;
      const along = [...this.held].reduce((sum, k) => sum.map((v, i) => v + FLY_KEYS[k][i]), [0, 0, 0]);
      const seconds = Math.min(0.1, Math.max(0, (now - last) / 1000));
      last = now;
      this.change((state) => fly(state, along, seconds, this.isFast), now);
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
}
