// The badge of the picture, and the banner that says why there is none.

import { $, say } from "./dom.js";

const BANNER_AFTER_MS = 400;
const LATE_MS = 5000;

export class Notices {
  waitsSince = 0;

  /** A pose has left: pictures that stay away are late. */
  asked(still) {
    if (!still && $("banner").hidden) this.badge("moving");
    this.expect();
  }

  expect() {
    this.late ??= setTimeout(() => {
      this.late = null;
      if ($("banner").hidden && !this.banner) this.tell("waiting", "pictures are late");
    }, LATE_MS);
  }

  /** A picture is on the screen; `isNewest` says whether no pose has followed. */
  shows(header, { isNewest, isSharp, lightSteps, stillSamples, receivedAt }) {
    // It was on its way before the reason that there are none.
    if (receivedAt < this.waitsSince) return;
    this.stop();
    if (!isNewest) this.expect();
    $("banner").hidden = true;
    $("picture").classList.remove("stale");
    if (!isNewest || !header.still) return this.badge(isNewest ? "still" : "moving");
    const light = header.light_step;
    if (light < lightSteps) this.badge("still", `still (light ${light} of ${lightSteps})`);
    else if (header.samples < stillSamples) this.badge("still", `still (${header.samples} of ${stillSamples} samples)`);
    else if (header.more) this.badge("still", "still (exact follows)");
    else this.badge(isSharp && header.direct ? "exact" : "still");
  }

  badge(state, text = state) {
    const badge = $("badge");
    if (badge.textContent === text) return;
    badge.dataset.state = state;
    badge.textContent = text;
    if (state === "exact") say("The picture is that of direct drawing.");
  }

  /** Says why there are no pictures, unless there soon are; the last one stays, greyed. */
  waits(stage, detail) {
    this.reason = [stage, detail];
    this.waitsSince = performance.now();
    this.banner ??= setTimeout(() => this.tell(...this.reason), $("banner").hidden ? BANNER_AFTER_MS : 0);
  }

  tell(stage, detail) {
    this.stop();
    const text = `${stage[0].toUpperCase()}${stage.slice(1)}: ${detail}.`;
    if ($("banner").textContent !== text) $("banner").textContent = text;
    $("banner").hidden = false;
    $("picture").classList.add("stale");
    this.badge("waiting");
  }

  stop() {
    clearTimeout(this.late);
    clearTimeout(this.banner);
    this.late = this.banner = null;
  }
}
