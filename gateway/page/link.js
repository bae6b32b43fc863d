// The connection to the gateway: messages of the protocol myriorama.v1, reconnected with growing delays.

import { refusal } from "./api.js";

const FIRST_DELAY_MS = 250;
const LONGEST_DELAY_MS = 4000;
/** The gateway says every other second that it is there. */
const SILENCE_MS = 20000;

/** Splits a binary message into its header, which a further part of a picture lacks, and its bytes. */
function parsePart(buffer) {
  const headerBytes = new DataView(buffer).getUint32(0, true);
  const header = headerBytes ? JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, headerBytes))) : null;
  return { header, data: new Uint8Array(buffer, 4 + headerBytes) };
}

export class Link {
  /** `listeners`: { message(json), picture(picture), closed() }. */
  constructor(url, listeners) {
    this.url = url;
    this.listeners = listeners;
    this.scene = null;
    this.attempt = 0;
    this.connect();
  }

  connect() {
    this.hear();
    const socket = new WebSocket(this.url, "myriorama.v1");
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    this.isWelcome = false;
    this.isRefused = false;
    socket.onopen = () => socket.send(JSON.stringify({ type: "open", scene: this.scene }));
    // An earlier connection may have messages left.
    socket.onmessage = ({ data }) => socket === this.socket && this.receive(data);
    socket.onclose = () => socket === this.socket && this.lost();
  }

  /** A connection without a word has gone, even if the browser knows nothing of it. */
  hear() {
    clearTimeout(this.silence);
    this.silence = setTimeout(() => {
      this.listeners.closed();
      this.open(this.scene);
    }, SILENCE_MS);
  }

  receive(data) {
    this.hear();
    if (typeof data !== "string") return this.receivePart(parsePart(data), data.byteLength);
    const message = JSON.parse(data);
    if (message.type === "welcome") {
      this.attempt = 0;
      this.isWelcome = true;
    }
    this.isRefused ||= message.type === "refused";
    this.listeners.message(message);
  }

  /** A picture is complete with its last part; a header begins another one. */
  receivePart({ header, data }, bytes) {
    if (header) this.picture = { header, data: [], bytes: 0, left: header.bytes };
    const picture = this.picture;
    picture.data.push(data);
    picture.bytes += bytes;
    picture.left -= data.byteLength;
    if (picture.left > 0) this.send({ type: "received" });
    else this.listeners.picture(picture);
  }

  async lost() {
    clearTimeout(this.silence);
    const { socket, isWelcome } = this;
    this.isWelcome = false;
    if (this.isRefused) return;
    this.listeners.closed();
    // A browser does not tell a page why its connection fails.
    const reason = isWelcome ? null : await refusal(LONGEST_DELAY_MS);
    // Another scene may have been chosen meanwhile.
    if (socket !== this.socket) return;
    if (reason) return this.listeners.message({ type: "refused", reason });
    const delayMs = Math.min(LONGEST_DELAY_MS, FIRST_DELAY_MS * 2 ** this.attempt);
    this.timer = setTimeout(() => this.connect(), delayMs * (0.75 + 0.5 * Math.random()));
    this.attempt += 1;
  }

  /** Connects again, to this scene. */
  open(scene) {
    this.scene = scene;
    clearTimeout(this.timer);
    const before = this.socket;
    this.connect();
    before.close();
  }

  /** Sends a message, once this connection is welcome: numbers begin anew with each. */
  send(message) {
    if (this.isWelcome && this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  /** Whether messages wait for a slow link. */
  isBusy() {
    return this.socket.bufferedAmount > 0;
  }
}
