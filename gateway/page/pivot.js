// The pivot under a double click: the camera glides to it.

import { toast } from "./dom.js";
import { between, pivotAt } from "./camera.js";
import { pointAt } from "./measure.js";

const GLIDE_MS = 200;

export class Pivot {
  /** `view()` gives the view on the screen. */
  constructor(poses, view) {
    Object.assign(this, { poses, view });
  }

  async at(place) {
    const view = this.view();
    if (!view) return;
    this.cancel();
    const { signal } = (this.asked = new AbortController());
    try {
      const { point } = await pointAt(view, place, signal);
      if (signal.aborted) return;
      if (!point) return toast("Nothing there.");
      this.glide(pivotAt(this.poses.state, point));
      toast("The pivot has moved.");
    } catch (error) {
      if (!signal.aborted) toast(error.message);
    }
  }

  /** The visitor steers: the glide ends where it is. */
  cancel() {
    this.asked?.abort();
    cancelAnimationFrame(this.frame);
  }

  glide(to) {
    const [from, start] = [this.poses.state, performance.now()];
    const duration = matchMedia("(prefers-reduced-motion: reduce)").matches ? 0 : GLIDE_MS;
    const step = (now) => {
      const share = duration ? Math.min(1, Math.max(0, now - start) / duration) : 1;
      // It starts and ends gently.
      const eased = share * share * (3 - 2 * share);
      this.poses.change(() => (share < 1 ? between(from, to, eased) : to), now);
      if (share < 1) this.frame = requestAnimationFrame(step);
    };
    this.frame = requestAnimationFrame(step);
  }
}
