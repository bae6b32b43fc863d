// The time of an animated scene: play, pause and a slider. While it plays, each animation frame asks for the moment of the clock.

import { $, on, say } from "./dom.js";

export class Playback {
  constructor(poses) {
    this.poses = poses;
    this.moments = 1;
    this.isPlaying = false;
    on("play", () => this.toggle());
    $("time").addEventListener("input", (event) => this.seek(Number(event.target.value)));
  }

  /** A scene is shown: a new one from its first moment. */
  begin({ moments, moment_step_s }, isNew) {
    this.moments = moments;
    this.stepMs = 1000 * moment_step_s;
    $("playback").hidden = this.moments < 2;
    $("time").max = this.moments - 1;
    if (isNew || this.poses.moment >= this.moments) {
      if (this.isPlaying) this.stop();
      this.poses.moment = this.moments > 1 ? 0 : null;
    }
    this.show();
  }

  toggle() {
    if (this.moments < 2) return;
    if (this.isPlaying) this.pause();
    else this.play();
  }

  play() {
    this.isPlaying = true;
    this.startedAt = performance.now() - this.poses.moment * this.stepMs;
    this.frame = requestAnimationFrame((now) => this.step(now));
    this.label("Pause", "Playing.");
  }

  /** The moment stays, and is asked for without loss. */
  pause() {
    if (!this.isPlaying) return;
    this.stop();
    this.poses.again();
  }

  stop() {
    this.isPlaying = false;
    cancelAnimationFrame(this.frame);
    this.label("Play", "Paused.");
  }

  step(now) {
    const steps = Math.floor(Math.max(0, now - this.startedAt) / this.stepMs);
    this.poses.setMoment(steps % this.moments);
    this.show();
    this.frame = requestAnimationFrame((then) => this.step(then));
  }

  seek(moment) {
    this.pause();
    this.poses.setMoment(moment);
    this.show();
  }

  label(text, spoken) {
    $("play").firstChild.textContent = text;
    say(spoken);
  }

  show() {
    const seconds = (moment) => ((moment * this.stepMs) / 1000).toFixed(2);
    const moment = this.poses.moment ?? 0;
    $("time").value = moment;
    $("time").setAttribute("aria-valuetext", `${seconds(moment)} seconds`);
    $("clock").textContent = `${seconds(moment)} of ${seconds(this.moments)} s`;
  }
}
