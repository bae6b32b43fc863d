// The page: a camera, a connection, a canvas, and what is laid over it.

import { Newest, within } from "./api.js";
import * as camera from "./camera.js";
import { Compare } from "./compare.js";
import { $, copied, download, on, press, say, toast, writeAddress } from "./dom.js";
import { Frusta } from "./frusta.js";
import { Input } from "./input.js";
import { Link } from "./link.js";
import { Marks } from "./marks.js";
import { Measure, pointAt } from "./measure.js";
import { Notices } from "./notices.js";
import { Overlays } from "./overlays.js";
import { Panels } from "./panels.js";
import { Pictures } from "./pictures.js";
import { Playback } from "./playback.js";
import { Poses } from "./poses.js";
import { Screen } from "./screen.js";
import { Statistics } from "./statistics.js";

const COMMANDS = {
  r: "reset", f: "fit", v: "mode", s: "show-statistics", h: "show-keys", p: "provenance", d: "depth", o: "cameras", m: "measure",
  c: "compare", " ": "play",
};

let welcome = null;
let plan = null;
/** The picture on the screen: { header, moment }. */
let shown = null;
/** The last picture that came to rest on the screen: its pose, plan and view cell. */
let settled = null;

const notices = new Notices();
const statistics = new Statistics();
const screen = new Screen($("picture"), resized);
const link = new Link(socketUrl(), {
  message: heard,
  picture: (picture) => pictures.received(picture),
  closed: () => notices.waits("reconnecting", "the connection is lost"),
});
link.scene = new URLSearchParams(location.search).get("scene");
const poses = new Poses(link, screen, {
  moved,
  asked: (still) => notices.asked(still),
  rested: settle,
  isLossless: () => $("lossless").checked,
  quality,
  isPlaying: () => playback.isPlaying,
});
const pictures = new Pictures(link, screen, poses, statistics, showsPicture);
const playback = new Playback(poses);
const marks = new Marks($("marks"), () => shown?.header, () => poses.state.size);
const overlays = new Overlays(restView);
const compare = new Compare(restView, () => playback.pause());
const measure = new Measure(marks, view);
const pivot = new Newest();
const frusta = new Frusta(marks, () => ({ scene: welcome.scene, moment: poses.moment ?? 0 }), () => poses.state.size, () => shown?.header.cell);
new Panels(() => statistics.rows(performance.now(), plan, welcome?.light_steps ?? 1));
const isFlying = () => poses.state?.isFlying ?? false;
new Input($("picture"), {
  change: steer, command, click: (place) => measure.take(place), doubleClick: (place) => measure.isOn || movePivot(place), isFlying,
});
// For tests and for the curious.
window.myriorama = {
  statistics, screen, link, camera, measure, view,
  state: () => poses.state, number: () => poses.number, shown: () => pictures.shownNumber,
};
$("picture").focus();

function socketUrl() {
  const url = new URL("api/v1/socket", document.baseURI);
  url.protocol = url.protocol.replace("http", "ws");
  return url.href;
}

function heard(message) {
  if (message.type === "welcome") begin(message);
  else if (message.type === "waiting") notices.waits(message.stage, message.detail);
  else if (message.type === "plan") planned(message);
  else if (message.type === "refused") notices.waits("refused", message.reason);
}

function begin(message) {
  const isNew = welcome?.scene !== message.scene;
  welcome = message;
  document.title = `${message.scene} – Myriorama`;
  $("scene").replaceChildren(...message.scenes.map((name) => new Option(name, name, false, name === message.scene)));
  $("scene").hidden = message.scenes.length < 2;
  nameScene(message);
  if (isNew) enter(message);
  playback.begin(message, isNew);
  // Numbers begin again with each connection.
  settled = null;
  pictures.restart();
  poses.restart();
}

/** A link to one of several scenes names it. */
function nameScene({ scene, scenes }) {
  const url = new URL(location.href);
  if (scenes.length < 2 || url.searchParams.get("scene") === scene) return;
  url.searchParams.set("scene", scene);
  writeAddress(url);
}

/** Another scene: nothing that was shown belongs to it. */
function enter({ home, bounds }) {
  pivot.cancel();
  const linked = poses.state ? null : camera.fromFragment(location.hash);
  const size = camera.length(camera.add(bounds[1], camera.scale(bounds[0], -1)));
  poses.state = camera.fromCamera(linked ?? home, size, isFlying());
  [shown, plan] = [null, null];
  $("quality").value = welcome.quality;
  // Points of another scene are others.
  measure.clear();
  moved();
  marks.redraw();
}

function planned(message) {
  const isNew = message.epoch !== plan?.epoch;
  plan = message;
  $("light").hidden = !plan.shares_light;
  if (isNew) frusta.planned();
}

/** The quality of shared light that was chosen; null for the scene's own, and where no light is shared. */
function quality() {
  return plan?.shares_light ? $("quality").value : null;
}

/** The visitor moves the camera. */
function steer(update, eventTime) {
  pivot.cancel();
  poses.change(update, eventTime);
}

/** Makes the surface under a double click the pivot. */
function movePivot(place) {
  const seen = view();
  if (!seen) return;
  pivot.ask((signal) => pointAt(seen, place, signal), ({ point }) => {
    if (!point) return toast("Nothing there.");
    poses.change((state) => camera.pivotAt(state, point));
    toast("The pivot has moved.");
  }, (error) => toast(error.message));
}

function moved() {
  overlays.moved();
  compare.close();
}

function resized() {
  overlays.moved();
  poses.again();
}

function showsPicture(header, moment, receivedAt) {
  shown = { header, moment };
  const isSharp = header.size_px.every((side, axis) => side === screen.size[axis]);
  notices.shows(header, { isNewest: header.number === poses.number, isSharp, lightSteps: welcome.light_steps, stillSamples: welcome.still_samples, receivedAt });
  marks.redraw();
  settle();
}

/** The picture of the newest pose is on the screen, and no further pose has followed. */
function isAtRest() {
  const isNewest = poses.isResting && pictures.shownNumber === poses.number;
  return isNewest && shown && (shown.header.still || !$("lossless").checked);
}

function settle() {
  if (!isAtRest()) return;
  // A pose may have stills of several plans and view cells.
  const { number, set, cell, neighbour } = shown.header;
  const picture = [number, set.split(".")[0], cell, neighbour].join(" ");
  if (settled === picture) return;
  settled = picture;
  overlays.rested();
  compare.rested();
}

/** The view on the screen, for requests of HTTP; its size is that of the still. */
function view() {
  if (!shown) return null;
  const { header, moment } = shown;
  const size = header.still ? header.size_px : within(screen.size, welcome.max_still_px);
  return { scene: welcome.scene, camera: header.camera, size, moment, quality: quality() };
}

function restView() {
  return isAtRest() ? view() : null;
}

function command(key) {
  if (COMMANDS[key]) $(COMMANDS[key]).click();
  else if (key === "Enter") measure.take([0.5, 0.5]);
  else return false;
  return true;
}

on("reset", () => welcome && steer((s) => camera.fromCamera(welcome.home, s.size, s.isFlying)));
on("fit", () => welcome && steer((s) => camera.fit(s, welcome.bounds, screen.size[0] / screen.size[1])));
on("mode", (button) => {
  steer((s) => ({ ...s, isFlying: !s.isFlying }));
  press(button, isFlying());
  document.body.classList.toggle("flying", isFlying());
  say(isFlying() ? "Flying." : "Turning around the pivot.");
});
on("copy-link", (button) => poses.state && copied(button, new URL(camera.toFragment(poses.state), location.href).href));
on("copy-camera", (button) => poses.state && copied(button, JSON.stringify(camera.toTransforms(poses.state, ...screen.size))));
on("save", async () => shown && download(await screen.png(), `${welcome.scene}.png`));
$("scene").addEventListener("change", (event) => link.open(event.target.value));
$("lossless").addEventListener("change", () => poses.again());
$("quality").addEventListener("change", () => {
  compare.close();
  poses.again();
});
document.addEventListener("visibilitychange", () => !document.hidden && !(poses.number && isAtRest()) && poses.again());
addEventListener("keydown", (event) => event.key === "Escape" && (compare.isOpen ? compare.close() : measure.leave()));
addEventListener("hashchange", () => {
  const linked = camera.fromFragment(location.hash);
  if (linked) steer((s) => camera.fromCamera(linked, s.size, s.isFlying));
});
