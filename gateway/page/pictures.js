// Pictures: decoded side by side, shown in their order, confirmed once they are on the screen.

import { Screen } from "./screen.js";

export class Pictures {
  /** `shows(header, moment, receivedAt)` is called after each picture on the screen. */
  constructor(link, screen, poses, statistics, shows) {
    Object.assign(this, { link, screen, poses, statistics, shows });
    this.lastDecoded = Promise.resolve();
    this.restart();
  }

  /** Numbers begin again with each connection. */
  restart() {
    this.shownNumber = 0;
    this.moment = null;
  }

  received(picture) {
    const [receivedAt, socket] = [performance.now(), this.link.socket];
    const decoding = Screen.decode(picture).catch(() => null);
    this.lastDecoded = Promise.all([decoding, this.lastDecoded]).then(([bitmap]) => {
      const times = { receivedAt, decodedAt: performance.now() };
      const paint = () => this.paint(picture, bitmap, times, socket);
      // A hidden page has no animation frames.
      if (document.hidden) paint();
      else requestAnimationFrame(paint);
    });
  }

  paint(picture, bitmap, times, socket) {
    if (socket !== this.link.socket) return bitmap?.close();
    const { header, bytes } = picture;
    const drop = !bitmap ? "undecoded" : header.number < this.shownNumber ? "late" : null;
    if (drop) bitmap?.close();
    else this.screen.show(bitmap, header);
    const pose = this.poses.answered(header.number);
    // The gateway asks for a repeat by itself.
    const askedAt = times.receivedAt - header.times_ms.gateway;
    const { posedAt, sentAt } = pose ?? { posedAt: askedAt, sentAt: askedAt };
    const shown = { header, bytes, isRepeat: !pose, posedAt, sentAt, ...times, paintedAt: performance.now() };
    const age = this.statistics.add(shown, drop);
    // A picture that is dropped gives back its credit, too.
    this.link.send({ type: "shown", number: header.number, age_ms: Math.max(0, age) });
    if (drop) return;
    this.shownNumber = header.number;
    if (pose) this.moment = pose.moment;
    this.shows(header, this.moment, times.receivedAt);
  }
}
