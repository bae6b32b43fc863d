// The view from samples beside the view drawn directly, with the measures of their difference.

import { $, element, on, press, say, tell } from "./dom.js";
import { Newest, queryOf, requestJson } from "./api.js";

const PICTURES = { "compare-view": "view", "compare-direct": "direct", "compare-flip": "flip_map" };

export class Compare {
  /** `restView()` gives the view that rests on the screen, or null; `pause()` stops the time. */
  constructor(restView, pause) {
    Object.assign(this, { restView, pause });
    this.asked = new Newest();
    on("compare", () => (this.isOpen ? this.close() : this.open()));
    on("compare-close", () => this.close());
    on("flip", () => this.showsFlip($("compare-flip").hidden));
    $("split").addEventListener("input", () => this.split());
  }

  get isOpen() {
    return !$("comparison").hidden;
  }

  open() {
    this.pause();
    this.isDone = false;
    $("comparison").hidden = false;
    $("compare").setAttribute("aria-expanded", "true");
    $("compared").hidden = true;
    this.tell("Both pictures are made once the camera rests…");
    $("comparison").focus();
    this.rested();
  }

  /** Any motion of the camera closes it, too. */
  close() {
    if (!this.isOpen) return;
    this.asked.cancel();
    const hadFocus = $("comparison").contains(document.activeElement);
    $("comparison").hidden = true;
    $("compare").setAttribute("aria-expanded", "false");
    say("The comparison is closed.");
    if (hadFocus) $("picture").focus();
  }

  tell(text) {
    tell("compare-state", text);
    if (text) say(text);
  }

  rested() {
    const view = this.restView();
    if (!this.isOpen || this.isDone || !view) return;
    this.isDone = true;
    this.tell("Both pictures are being made…");
    this.asked.ask((signal) => requestJson("compare.json", queryOf(view), signal), (result) => this.show(result), (error) => this.tell(error.message));
  }

  show(result) {
    for (const [id, name] of Object.entries(PICTURES)) {
      $(id).src = result[name];
      [$(id).width, $(id).height] = result.size_px;
    }
    const number = (value, digits) => (Number.isFinite(value) ? value.toFixed(digits) : "–");
    const psnr = (db) => `${number(db, 1)} dB`;
    const ms = (value) => `${number(value, 0)} ms`;
    const rows = [
      ["Foreground PSNR", psnr(result.foreground_psnr_db)], ["Foreground SSIM", number(result.foreground_ssim, 4)],
      ["Foreground FLIP", number(result.foreground_flip, 4)],
      ["PSNR", psnr(result.psnr_db)], ["SSIM", number(result.ssim, 4)], ["FLIP", number(result.flip, 4)],
      ["From samples in", ms(result.view_ms)], ["Drawn directly in", ms(result.direct_ms)],
    ];
    $("measures").replaceChildren(...rows.map(([name, value]) => element("div", element("dt", name), element("dd", value))));
    this.showsFlip(false);
    this.split();
    $("compared").hidden = false;
    this.tell(`${psnr(result.foreground_psnr_db)} and FLIP ${number(result.foreground_flip, 4)} from the picture drawn directly, where there is a surface.`);
    if ($("comparison").contains(document.activeElement)) $("split").focus();
  }

  showsFlip(isShown) {
    $("compare-flip").hidden = !isShown;
    $("divider").hidden = isShown;
    $("split").disabled = isShown;
    press($("flip"), isShown);
  }

  /** Left of the slider the view is shown, right of it the picture drawn directly. */
  split() {
    const percent = Number($("split").value);
    $("compare-view").style.clipPath = `inset(0 ${100 - percent}% 0 0)`;
    $("divider").style.left = `${percent}%`;
    $("split").setAttribute("aria-valuetext", `${percent} % from samples, ${100 - percent} % drawn directly`);
  }
}
