// The connection to the gateway: messages of the protocol myriorama.v1, reconnected with growing delays.

import { refusal } from "./api.js";

const FIRST_DELAY_MS = 250;
const LONGEST_DELAY_MS = 4000;

/** Splits a picture's message into its header and its bytes. */
export function parsePicture(buffer) {
  const headerBytes = new DataView(buffer).getUint32(0, true);
  const header = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, headerBytes)));
  return { header, data: new Uint8Array(buffer, 4 + headerBytes), bytes: buffer.byteLength };
}

/** The delay before the n-th attempt to connect again, with jitter, in milliseconds. */
export function delayBefore(attempt, random = Math.random()) {
  return Math.min(LONGEST_DELAY_MS, FIRST_DELAY_MS * 2 ** attempt) * (0.75 + 0.5 * random);
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

  receive(data) {
    if (typeof data !== "string") {
      this.listeners.picture(parsePicture(data));
      return;
    }
    const message = JSON.parse(data);
    if (message.type === "welcome") {
      this.attempt = 0;
      this.isWelcome = true;
    }
    this.isRefused ||= message.type === "refused";
    this.listeners.message(message);
  }

  async lost() {
    const { socket, isWelcome } = this;
    this.isWelcome = false;
    if (this.isRefused) return;
    this.listeners.closed();
    // A browser does not tell a page why its connection fails.
    const reason = isWelcome ? null : await refusal(LONGEST_DELAY_MS);
    // Another scene may have been chosen meanwhile.
    if (socket !== this.socket) return;
    if (reason) return this.listeners.message({ type: "refused", reason });
    this.timer = setTimeout(() => this.connect(), delayBefore(this.attempt));
    this.attempt += 1;
  }

  /** Shows another scene. */
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
