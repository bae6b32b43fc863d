// The page: a camera, a connection, a canvas. The newest pose counts, and one that rests is asked for without loss.

import * as camera from "./camera.js";
import { Input } from "./input.js";
import { Link } from "./link.js";
import { Screen } from "./screen.js";
import { Statistics } from "./statistics.js";

const REST_MS = 150;
const POSE_MS = 8;
const BANNER_AFTER_MS = 400;
const $ = (id) => document.getElementById(id);
const version = document.querySelector("meta[name=version]").content;

let state = null;
let welcome = null;
let plan = null;
let number = 0;
let shownNumber = 0;
let lastPose = 0;
let restTimer = null;
let poseTimer = null;
let bannerTimer = null;
/** Poses that were sent and not shown: number to { posedAt, sentAt }. */
const sent = new Map();
const statistics = new Statistics();
const screen = new Screen($("picture"), () => state && changed((same) => same, performance.now(), true));
const input = new Input($("picture"), { change: changed, command, isFlying: () => state?.isFlying ?? false });
const link = new Link(socketUrl(), { message: heard, picture: received, closed: () => waits("reconnecting", "the connection is lost") });
// For tests and for the curious.
window.myriorama = { statistics, screen, link, camera, state: () => state, number: () => number, shown: () => shownNumber };

function socketUrl() {
  const url = new URL("api/v1/socket", document.baseURI);
  url.protocol = url.protocol.replace("http", "ws");
  url.hash = "";
  return url.href;
}

function heard(message) {
  if (message.type === "welcome") begin(message);
  else if (message.type === "waiting") waits(message.stage, message.detail);
  else if (message.type === "plan") plan = message;
  else if (message.type === "refused") waits("refused", message.reason);
}

function begin(message) {
  if (message.version !== version && sessionStorage.getItem("reloaded") !== message.version) {
    sessionStorage.setItem("reloaded", message.version);
    location.reload();
    return;
  }
  const isNew = welcome?.scene !== message.scene;
  welcome = message;
  document.title = `${message.scene} – Myriorama`;
  $("scene").replaceChildren(...message.scenes.map((name) => new Option(name, name, false, name === message.scene)));
  $("scene").hidden = message.scenes.length < 2;
  if (isNew) {
    const linked = state ? null : camera.fromFragment(location.hash);
    state = camera.fromCamera(linked ?? message.home, sizeOf(message.bounds), state?.isFlying);
  }
  // Numbers begin again with each connection.
  number = 0;
  shownNumber = 0;
  sent.clear();
  changed((same) => same, performance.now(), true);
}

function sizeOf([low, high]) {
  return camera.length(camera.add(high, camera.scale(low, -1)));
}

/** Another camera: asked for at once, and without loss once it rests. */
function changed(update, eventTime, isForced = false) {
  if (!state || !screen.size[0]) return;
  const next = update(state);
  if (!isForced && camera.isSame(next, state) && next.isFlying === state.isFlying) return;
  state = next;
  posed(eventTime);
}

let pendingTime = null;

/** Asks for the newest pose, at the rate of a fast display at most. */
function posed(eventTime) {
  pendingTime ??= eventTime;
  clearTimeout(restTimer);
  restTimer = setTimeout(rest, REST_MS);
  const wait = lastPose + POSE_MS - performance.now();
  if (wait <= 0) ask(false);
  else poseTimer ??= setTimeout(() => ask(false), wait);
}

function ask(still) {
  clearTimeout(poseTimer);
  poseTimer = null;
  const eventTime = pendingTime;
  pendingTime = null;
  if (document.hidden || !state) return;
  const now = performance.now();
  if (link.isBusy()) {
    pendingTime = eventTime;
    poseTimer = setTimeout(() => ask(still), POSE_MS);
    return;
  }
  number += 1;
  sent.set(number, { posedAt: Math.min(eventTime ?? now, now), sentAt: now });
  lastPose = now;
  link.send({ type: "pose", number, camera: camera.toCamera(state), canvas_px: screen.size, still });
  if (!still) badge("moving");
  bannerTimer ??= setTimeout(() => waits("waiting", "pictures are late"), 5000);
}

function rest() {
  if (poseTimer) ask(false);
  if ($("lossless").checked) ask(true);
  if (state) history.replaceState(null, "", camera.toFragment(state));
}

let lastDecoded = Promise.resolve();

/** Pictures are decoded side by side, and shown in their order. */
function received(picture) {
  const [receivedAt, socket] = [performance.now(), link.socket];
  const decoding = Screen.decode(picture).catch(() => null);
  lastDecoded = Promise.all([decoding, lastDecoded]).then(([bitmap]) => {
    if (socket !== link.socket) return bitmap?.close();
    if (!bitmap) return link.send({ type: "shown", number: picture.header.number, age_ms: 0 });
    present(picture, bitmap, receivedAt, socket);
  });
}

function present(picture, bitmap, receivedAt, socket) {
  const { header } = picture;
  const decodedAt = performance.now();
  const paint = () => {
    if (socket !== link.socket) return bitmap.close();
    const isLate = header.number < shownNumber;
    if (isLate) bitmap.close();
    else {
      screen.show(bitmap, header);
      shownNumber = header.number;
    }
    const paintedAt = performance.now();
    const pose = sent.get(header.number) ?? { posedAt: receivedAt, sentAt: receivedAt };
    const times = { receivedAt, decodedAt, paintedAt };
    const age = statistics.add({ header, bytes: picture.bytes, isRepeat: !sent.has(header.number), ...pose, ...times });
    for (const old of [...sent.keys()].filter((n) => n <= header.number)) sent.delete(old);
    link.send({ type: "shown", number: header.number, age_ms: Math.max(0, age) });
    if (!isLate) showsPicture(header);
  };
  // A hidden page has no animation frames.
  if (document.hidden) paint();
  else requestAnimationFrame(paint);
}

function showsPicture(header) {
  clearTimeout(bannerTimer);
  bannerTimer = null;
  $("banner").hidden = true;
  $("picture").classList.remove("stale");
  const isNewest = header.number === number;
  const isSharp = header.still && header.size_px.every((side, axis) => side === screen.size[axis]);
  badge(!isNewest ? "moving" : isSharp && !header.neighbour ? "exact" : "still");
}

function badge(text) {
  if ($("badge").dataset.state === text) return;
  $("badge").textContent = $("badge").dataset.state = text;
  if (text === "exact") $("spoken").textContent = "The picture is sharp.";
}

/** Says why there are no pictures; the last one stays, greyed. */
function waits(stage, detail) {
  clearTimeout(bannerTimer);
  bannerTimer = setTimeout(() => {
    $("banner").textContent = $("spoken").textContent = `${stage[0].toUpperCase()}${stage.slice(1)}: ${detail}.`;
    $("banner").hidden = false;
    $("picture").classList.add("stale");
  }, stage === "waiting" ? 0 : BANNER_AFTER_MS);
}

function command(key) {
  const commands = { r: "reset", f: "fit", v: "mode", s: "show-statistics", h: "show-keys" };
  if (commands[key]) $(commands[key]).click();
}

function on(id, listener) {
  $(id).addEventListener("click", (event) => listener(event.currentTarget));
}

function toggle(button) {
  const panel = $(button.getAttribute("aria-controls"));
  panel.hidden = !panel.hidden;
  button.setAttribute("aria-expanded", String(!panel.hidden));
  if (panel.id === "statistics") showStatistics();
}

function showStatistics() {
  if ($("statistics").hidden) return;
  const row = ([name, value]) => {
    const [line, head, cell] = ["tr", "th", "td"].map((tag) => document.createElement(tag));
    [head.textContent, cell.textContent] = [name, value];
    line.append(head, cell);
    return line;
  };
  $("rows").replaceChildren(...statistics.rows(performance.now(), plan).map(row));
  setTimeout(showStatistics, 500);
}

async function copied(button, text) {
  const label = button.textContent;
  try {
    await navigator.clipboard.writeText(text);
    button.textContent = "Copied";
  } catch {
    // Plain http beyond loopback has no clipboard.
    window.prompt("Copy:", text);
  }
  setTimeout(() => (button.textContent = label), 1500);
}

function download(blob, name) {
  const anchor = document.createElement("a");
  anchor.href = URL.createObjectURL(blob);
  anchor.download = name;
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(anchor.href), 1000);
}

on("reset", () => welcome && changed((s) => camera.fromCamera(welcome.home, s.size, s.isFlying), performance.now()));
on("fit", () => welcome && changed((s) => camera.fit(s, welcome.bounds), performance.now()));
on("mode", (button) => {
  changed((s) => camera.withMode(s, !s.isFlying), performance.now());
  button.setAttribute("aria-pressed", String(state?.isFlying ?? false));
});
on("copy-link", (button) => copied(button, new URL(camera.toFragment(state), location.href).href));
on("copy-camera", (button) => copied(button, JSON.stringify(camera.toTransforms(state, ...screen.size))));
on("save", async () => download(await screen.png(), `${welcome?.scene ?? "view"}.png`));
on("export", () => download(new Blob([statistics.csv()], { type: "text/csv" }), "pictures.csv"));
on("show-statistics", toggle);
on("show-keys", toggle);
$("scene").addEventListener("change", (event) => link.open(event.target.value));
$("lossless").addEventListener("change", () => changed((same) => same, performance.now(), true));
document.addEventListener("visibilitychange", () => !document.hidden && changed((same) => same, performance.now(), true));
addEventListener("hashchange", () => {
  const linked = camera.fromFragment(location.hash);
  if (linked) changed((s) => camera.fromCamera(linked, s.size, s.isFlying), performance.now());
});
