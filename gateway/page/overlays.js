// Provenance and depth of a view that rests, above its picture, with their legend.

import { $, element, on, press, say, tell } from "./dom.js";
import { Newest, queryOf, request } from "./api.js";

/** The entries of a legend's header: [text, colour]; none where the header is missing or broken. */
function legendOf(header) {
  try {
    return JSON.parse(header ?? "[]").filter(([text, color]) => typeof text === "string" && /^#[0-9a-f]{6}$/i.test(color));
  } catch {
    return [];
  }
}

const NAMES = { provenance: "Provenance", depth: "Depth" };

export class Overlays {
  /** `restView()` gives the view that rests on the screen, or null. */
  constructor(restView) {
    this.restView = restView;
    this.asked = new Newest();
    /** The kind that is on; null for none. */
    this.kind = null;
    for (const kind of Object.keys(NAMES)) on(kind, () => this.toggle(kind));
    on("legend-close", () => this.toggle(this.kind));
    $("opacity").addEventListener("input", () => this.fade());
    this.fade();
  }

  toggle(kind) {
    this.kind = kind === this.kind ? null : kind;
    for (const name of Object.keys(NAMES)) press($(name), name === this.kind);
    this.hide();
    $("legend").hidden = !this.kind;
    $("entries").replaceChildren();
    if (!this.kind) return say(`${NAMES[kind]} is hidden.`);
    $("legend-name").textContent = NAMES[this.kind];
    tell("legend-state", "Shown when the camera rests.");
    this.rested();
  }

  fade() {
    $("overlay").style.opacity = $("opacity").value / 100;
  }

  /** The camera moves: what was shown is of another view. */
  moved() {
    if (!this.kind) return;
    this.hide();
    tell("legend-state", "Shown when the camera rests.");
  }

  hide() {
    this.asked.cancel();
    $("overlay").hidden = true;
  }

  rested() {
    const [view, kind] = [this.restView(), this.kind];
    if (!kind || !view) return;
    tell("legend-state", "Loading…");
    this.asked.ask((signal) => this.load(view, kind, signal), ({ image, legend }) => {
      this.show(image, legend);
      say(`${NAMES[kind]} is shown.`);
    }, (error) => {
      $("overlay").hidden = true;
      tell("legend-state", error.message);
      say(error.message);
    });
  }

  async load(view, kind, signal) {
    const answer = await request("view.png", queryOf(view, { show: kind }), signal);
    const legend = legendOf(answer.headers.get("Myriorama-Legend"));
    const url = URL.createObjectURL(await answer.blob());
    const image = new Image();
    image.src = url;
    await image.decode().finally(() => URL.revokeObjectURL(url));
    return { image, legend };
  }

  show(image, legend) {
    const overlay = $("overlay");
    Object.assign(overlay, { width: image.naturalWidth, height: image.naturalHeight });
    overlay.getContext("2d").drawImage(image, 0, 0);
    overlay.hidden = false;
    tell("legend-state", "");
    $("entries").replaceChildren(...legend.map(([text, color]) => {
      const swatch = element("span");
      swatch.className = "swatch";
      swatch.style.background = color;
      return element("li", swatch, text);
    }));
  }
}
