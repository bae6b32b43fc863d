// Poses: the newest counts, and one that rests is asked for without loss.

import * as camera from "./camera.js";
import { writeAddress } from "./dom.js";

const REST_MS = 150;
const POSE_MS = 8;

export class Poses {
  /**
   * `hooks`: moved() after another camera or moment, asked(still) after a pose has left, rested() once no pose has followed,
   * isLossless(), isPlaying(), quality().
   */
  constructor(link, screen, hooks) {
    this.link = link;
    this.screen = screen;
    this.hooks = hooks;
    this.state = null;
    /** The moment of an animated scene; null for a scene that stands still. */
    this.moment = null;
    this.number = 0;
    /** Poses that were sent and not shown: number to { posedAt, sentAt, moment }. */
    this.sent = new Map();
    this.lastAt = 0;
    this.eventTime = null;
    this.isResting = false;
  }

  /** Numbers begin again with each connection. */
  restart() {
    this.number = 0;
    this.sent.clear();
    this.again();
  }

  /** Another camera: asked for at once, and without loss once it rests. */
  change(update, eventTime = performance.now()) {
    if (!this.state || !this.screen.size[0]) return;
    const next = update(this.state);
    const isSame = camera.isSame(next, this.state);
    if (isSame && next.isFlying === this.state.isFlying) return;
    this.state = next;
    if (isSame) return;
    this.hooks.moved();
    this.pose(eventTime);
  }

  /** Another moment of an animated scene. */
  setMoment(moment) {
    if (moment === this.moment) return;
    this.moment = moment;
    this.hooks.moved();
    this.again();
  }

  /** Asks for the same pose once more. */
  again() {
    if (this.state && this.screen.size[0]) this.pose(performance.now());
  }

  /** Asks for the newest pose, at the rate of a fast display at most. */
  pose(eventTime) {
    this.eventTime ??= eventTime;
    this.isResting = false;
    clearTimeout(this.restTimer);
    this.restTimer = setTimeout(() => this.rest(), REST_MS);
    // A still that waits for a slow link is of an earlier pose.
    if (this.poseTimer && this.isStillNext) this.cancel();
    const wait = this.lastAt + POSE_MS - performance.now();
    if (wait <= 0) this.ask(false);
    else if (!this.poseTimer) this.later(false, wait);
  }

  later(still, wait) {
    this.isStillNext = still;
    this.poseTimer = setTimeout(() => this.ask(still), wait);
  }

  cancel() {
    clearTimeout(this.poseTimer);
    this.poseTimer = null;
  }

  ask(still) {
    this.cancel();
    if (document.hidden || !this.state) {
      this.eventTime = null;
      return;
    }
    if (this.link.isBusy()) return this.later(still, POSE_MS);
    const now = performance.now();
    this.number += 1;
    this.sent.set(this.number, { posedAt: Math.min(this.eventTime ?? now, now), sentAt: now, moment: this.moment });
    this.eventTime = null;
    this.lastAt = now;
    this.link.send(this.message(still));
    this.hooks.asked(still);
  }

  message(still) {
    const pose = { type: "pose", number: this.number, camera: camera.toCamera(this.state), canvas_px: this.screen.size, still };
    const quality = this.hooks.quality();
    return { ...pose, ...(this.moment !== null && { moment: this.moment }), ...(quality && { quality }) };
  }

  rest() {
    if (!this.state) return;
    if (this.poseTimer) this.ask(false);
    writeAddress(camera.toFragment(this.state));
    if (this.hooks.isPlaying()) return;
    if (this.hooks.isLossless()) this.ask(true);
    this.isResting = true;
    this.hooks.rested();
  }

  /** The times of a pose whose picture is here; null for a picture that repeats a pose. */
  answered(number) {
    const pose = this.sent.get(number) ?? null;
    for (const old of [...this.sent.keys()].filter((n) => n <= number)) this.sent.delete(old);
    return pose;
  }
}
