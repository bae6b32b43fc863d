// Points of the scene's surface: their coordinates, the distance of two, and the cameras that saw them.

import { $, element, on, press, say, tell } from "./dom.js";
import { Newest, queryOf, requestJson } from "./api.js";
import { add, length, scale } from "./camera.js";

const COLORS = ["#ffd166", "#7ee2a8"];
const RADIUS_PX = 5;
const CROSS_PX = 7;

/** What stands at a place of the window, given as shares of its width and height. */
export function pointAt(view, [x, y], signal) {
  const at = [x, y].map((share, axis) => Math.min(view.size[axis] - 1, Math.max(0, Math.floor(share * view.size[axis]))));
  return requestJson("point.json", queryOf(view, { at: at.join(",") }), signal);
}

/** A number with as many digits as are of use. */
function figure(value) {
  return Number(value.toPrecision(5)).toString();
}

/** A sentence on what the cameras saw of a point. */
function sourceOf({ point, source, cameras }) {
  if (!point || source === "nothing") return "nothing there";
  if (source === "direct") return "drawn directly";
  if (source === "filled") return "filled: no camera saw this";
  if (source === "base") return cameras?.length ? "reflection: shows what the base holds" : "no camera saw this: from the base";
  if (source === "lit_here") return "no camera knows its light: lit in this view";
  if (source === "guessed") return "reflection: no camera saw all that it shows";
  if (!cameras?.length) return "seen by the cameras";
  return `seen by camera${cameras.length > 1 ? "s" : ""} ${cameras.join(", ")}`;
}

export class Measure {
  /** `view()` gives the view on the screen. */
  constructor(marks, view) {
    Object.assign(this, { marks, view });
    this.asked = new Newest();
    this.isOn = false;
    this.results = [];
    marks.add((pen) => this.isOn && this.draw(pen));
    on("measure", () => this.toggle());
    on("measure-clear", () => this.clear());
    on("measure-close", () => this.leave());
  }

  toggle() {
    if (this.isOn) return this.leave();
    this.isOn = true;
    this.show("Measuring. Click on a surface, or press Enter for the centre.");
  }

  leave() {
    if (!this.isOn) return;
    this.isOn = false;
    this.asked.cancel();
    this.results = [];
    this.show("Measuring has ended.");
  }

  clear() {
    if (!this.isOn) return;
    this.asked.cancel();
    this.results = [];
    this.show("No points.");
  }

  take(place) {
    const view = this.view();
    if (!this.isOn || !view) return;
    tell("measure-state", "Loading…");
    this.asked.ask((signal) => pointAt(view, place, signal), (result) => this.taken(result), (error) => this.show(error.message));
  }

  taken(result) {
    if (!result.point) return this.show("Nothing there.");
    // A third point begins anew.
    this.results = [...this.results.slice(this.results.length >= 2 ? 2 : 0), result];
    this.show(this.summary(), true);
  }

  summary() {
    const last = this.results[this.results.length - 1];
    const place = `Point ${this.results.length}: ${last.point.map(figure).join(", ")}; ${sourceOf(last)}.`;
    return this.results.length === 2 ? `${place} Distance ${figure(this.distance())}.` : place;
  }

  distance() {
    const [a, b] = this.results.map((result) => result.point);
    return length(add(a, scale(b, -1)));
  }

  /** Says a sentence; the panel shows it, too, unless its rows say the same. */
  show(sentence, isInRows = false) {
    press($("measure"), this.isOn);
    $("measured").hidden = !this.isOn;
    $("picture").classList.toggle("measuring", this.isOn);
    tell("measure-state", isInRows ? "" : sentence);
    say(sentence);
    $("points").replaceChildren(...this.results.flatMap((result, i) => this.rows(result, i)));
    $("distance").hidden = this.results.length < 2;
    if (this.results.length === 2) $("distance-value").textContent = figure(this.distance());
    $("measure-clear").disabled = !this.results.length;
    this.marks.redraw();
  }

  rows(result, i) {
    const term = element("dt", `Point ${i + 1}`);
    term.dataset.point = i + 1;
    const details = [`depth ${figure(result.planar_depth ?? 0)}`, sourceOf(result)].join("; ");
    return [term, element("dd", result.point.map(figure).join(", "), element("small", details))];
  }

  draw(pen) {
    this.cross(pen);
    const points = this.results.map((result) => result.point);
    if (points.length === 2) pen.lines([points], "#e6e8eb", 1.5);
    points.forEach((point, i) => this.marker(pen, point, i));
    const ends = points.map((point) => pen.place(point));
    if (ends.length < 2 || !ends.every(Boolean)) return;
    const middle = add(ends[0], ends[1]).map((v) => v / 2);
    pen.text(figure(this.distance()), [middle[0] + 8, middle[1] - 10], "#e6e8eb");
  }

  marker(pen, point, i) {
    const place = pen.place(point);
    if (!place) return;
    pen.stroke((context) => context.arc(...place, RADIUS_PX, 0, 2 * Math.PI), COLORS[i], 2);
    pen.text(String(i + 1), [place[0] + RADIUS_PX + 5, place[1] - RADIUS_PX - 4], COLORS[i]);
  }

  /** The centre of the window, which Enter measures. */
  cross(pen) {
    const [x, y] = pen.size.map((side) => side / 2);
    pen.context.globalAlpha = 0.6;
    pen.stroke((context) => {
      context.moveTo(x - CROSS_PX, y);
      context.lineTo(x + CROSS_PX, y);
      context.moveTo(x, y - CROSS_PX);
      context.lineTo(x, y + CROSS_PX);
    }, "#e6e8eb", 1);
    pen.context.globalAlpha = 1;
  }
}
