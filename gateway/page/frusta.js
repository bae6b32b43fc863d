// The sample cameras of the plan as frusta, each with its number.

import { $, on, press, say } from "./dom.js";
import { Newest, requestJson } from "./api.js";
import { add, length, scale } from "./camera.js";

const OWN = "#6cb6ff";
const OTHER = "#aeb6c0";
/** The length of a frustum, as a share of the scene's size. */
const LENGTH = 0.035;
const RETRY_MS = 2000;

/** The eye and the four corners of a frame of a transforms.json, at a planar depth. */
function frustumOf(frame, depth) {
  const column = (i) => frame.transform_matrix.slice(0, 3).map((row) => row[i]);
  const [x, y, back, eye] = [0, 1, 2, 3].map(column);
  const corner = (columnPx, rowPx) => {
    const [across, upwards] = [(columnPx - frame.cx) / frame.fl_x, (frame.cy - rowPx) / frame.fl_y];
    return add(eye, scale(add(add(scale(x, across), scale(y, upwards)), scale(back, -1)), depth));
  };
  return { eye, corners: [corner(0, 0), corner(frame.w, 0), corner(frame.w, frame.h), corner(0, frame.h)] };
}

export class Frusta {
  /** `plan()` gives the scene and the moment whose cameras are drawn. */
  constructor(marks, plan, sceneSize, ownCell) {
    Object.assign(this, { marks, plan, sceneSize, ownCell });
    this.asked = new Newest();
    this.frames = [];
    this.isOn = false;
    marks.add((pen) => this.isOn && this.draw(pen));
    on("cameras", () => this.toggle());
  }

  toggle() {
    this.isOn = !this.isOn;
    press($("cameras"), this.isOn);
    this.marks.redraw();
    if (this.isOn) return this.load();
    clearTimeout(this.timer);
    this.asked.cancel();
    say("Cameras are hidden.");
  }

  /** A plan is in force, perhaps with other cameras. */
  planned() {
    this.frames = [];
    if (this.isOn) this.load();
  }

  load() {
    clearTimeout(this.timer);
    this.asked.ask((signal) => requestJson("cameras.json", new URLSearchParams(this.plan()), signal), ({ frames }) => {
      this.frames = frames;
      say(`${frames.length} sample cameras are shown.`);
      this.marks.redraw();
    }, () => (this.timer = setTimeout(() => this.load(), RETRY_MS)));
  }

  draw(pen) {
    const own = this.ownCell();
    const numbered = this.frames.map((frame, number) => [frame, number, frame.cell === own]);
    // Frusta of the own cell lie above the others.
    for (const drawn of numbered.sort((a, b) => a[2] - b[2])) this.drawOne(pen, ...drawn);
  }

  drawOne(pen, frame, number, isOwn) {
    const depth = LENGTH * this.sceneSize();
    const { eye, corners } = frustumOf(frame, depth);
    const color = isOwn ? OWN : OTHER;
    const sides = corners.map((corner) => [eye, corner]);
    const edges = corners.map((corner, i) => [corner, corners[(i + 1) % 4]]);
    // A frustum around the visitor would hide the picture.
    const nearness = length(add(eye, scale(pen.eye, -1))) / (3 * depth);
    pen.context.globalAlpha = (isOwn ? 1 : 0.5) * Math.min(1, Math.max(0.15, nearness));
    pen.lines([...sides, ...edges], color, isOwn ? 1.5 : 1);
    const place = pen.place(eye);
    if (place) pen.text(String(number), [place[0] + 6, place[1] - 8], color);
    pen.context.globalAlpha = 1;
  }
}
