// A line of one minute: a small SVG, whose label says what the line shows.

import { $ } from "./dom.js";

const KEPT = 60;
/** The size of the template's drawing. */
const SIZE = [120, 40];

/** The path through values; a null makes a gap. The newest value stands at the right. */
export function pathOf(values, top) {
  let isDrawing = false;
  const steps = values.map((value, i) => {
    const command = isDrawing ? "L" : "M";
    isDrawing = value !== null;
    if (!isDrawing) return "";
    const x = ((i + KEPT - values.length) / (KEPT - 1)) * SIZE[0];
    // A move alone draws nothing: a single value becomes a dot.
    return `${command}${x.toFixed(2)} ${(SIZE[1] * (1 - value / top)).toFixed(2)}${command === "M" ? "h0" : ""}`;
  });
  return steps.join("");
}

export class Chart {
  /** `text(value)` writes a value; the scale reaches to `least` at least. */
  constructor(name, text, least) {
    Object.assign(this, { name, text, least });
    this.values = [];
    this.figure = $("chart").content.firstElementChild.cloneNode(true);
    this.part("span").textContent = name;
  }

  part(selector) {
    return this.figure.querySelector(selector);
  }

  /** One more second; null where nothing is known. */
  add(value) {
    this.values = [...this.values, Number.isFinite(value) ? value : null].slice(-KEPT);
    const known = this.values.filter((v) => v !== null);
    const last = this.values[this.values.length - 1];
    this.part("output").textContent = last === null ? "–" : this.text(last);
    this.part("path").setAttribute("d", pathOf(this.values, Math.max(this.least, ...known)));
    this.part("svg").setAttribute("aria-label", this.sentence(known));
  }

  sentence(known) {
    if (!known.length) return `${this.name}: nothing known`;
    const now = this.part("output").textContent;
    return `${this.name}: ${now} now, from ${this.text(Math.min(...known))} to ${this.text(Math.max(...known))}`;
  }
}
