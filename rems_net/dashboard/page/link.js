// The connection to the server: see protocol.py for the messages. It comes back by
// itself, and says meanwhile in a sentence why it is gone.

const VERSION = 1;
/** ms. Pause before another attempt. */
const AGAIN = 1000;
/** bytes. A browser may count its last messages as waiting for some ms: that is a few of these. */
const WAITING = 1000;
/** Close codes of the server, with what the user can do. */
const REASONS = new Map([
  [4401, "This link is not valid any more. Open the newest link that rems printed."],
  [4403, "This fabric is another team's, or its name is wrong. Go back, and open another one."],
  [4426, "The server has another version. Load this page again."],
  [4429, "This page sent too many messages. Load it again."],
]);

/** @typedef {Record<string, any>} Plain */
/** Called with a JSON message, a binary frame, and "" or why there is no link. @typedef {{text: (message: Plain) => void, frame: (frame: DataView) => void, state: (sentence: string) => void}} Handlers */

export class Link {
  /** @param {string} token @param {Handlers} handlers @param {string} fabric "" for the one that was joined */
  constructor(token, handlers, fabric = "") {
    this.token = token;
    this.fabric = fabric;
    this.handlers = handlers;
    this.socket = /** @type {WebSocket | null} */ (null);
    this.next = 1;
    this.waiting = /** @type {Map<number, {resolve: (result: any) => void, reject: (error: Error) => void}>} */ (new Map());
    this.frames = 0;
    this.looked = "";
    this.open();
  }

  open() {
    const socket = new WebSocket(`ws://${location.host}/`);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.onopen = () => socket.send(JSON.stringify({ hello: this.token, version: VERSION, fabric: this.fabric }));
    socket.onmessage = (event) => {
      if (typeof event.data === "string") return this.hear(JSON.parse(event.data));
      this.frames++;
      this.handlers.frame(new DataView(event.data));
    };
    socket.onclose = (event) => {
      this.socket = null;
      this.looked = "";
      for (const one of this.waiting.values()) one.reject(new Error("The connection was lost."));
      this.waiting.clear();
      const why = REASONS.get(event.code);
      this.handlers.state(why ?? "The server of this page does not answer. Is rems still running?");
      if (!why) setTimeout(() => this.open(), AGAIN);
    };
  }

  /** @param {Plain} message */
  hear(message) {
    if (message.welcome) this.handlers.state("");
    if (message.answer) {
      const one = this.waiting.get(message.answer.id);
      this.waiting.delete(message.answer.id);
      if (message.answer.error) one?.reject(new Error(message.answer.error));
      else one?.resolve(message.answer.result);
    }
    this.handlers.text(message);
  }

  /** Name the agents of which every port is shown. @param {Iterable<string>} agents */
  look(agents) {
    const named = [...agents].sort().slice(0, 200);
    const text = JSON.stringify({ look: named });
    if (text === this.looked || this.socket?.readyState !== WebSocket.OPEN) return;
    this.looked = text;
    this.socket.send(text);
  }

  /** Send what a hand does; without a link, or if much waits already, it is lost. @param {Plain} message @returns {boolean} whether it was sent */
  send(message) {
    const socket = this.socket;
    const free = socket?.readyState === WebSocket.OPEN && socket.bufferedAmount < WAITING;
    if (free) socket.send(JSON.stringify(message));
    return free;
  }

  /** Ask the server to do something. Rejects with the sentence of an error. @param {string} verb @param {Plain} [more] @returns {Promise<any>} */
  ask(verb, more = {}) {
    const socket = this.socket;
    if (socket?.readyState !== WebSocket.OPEN) return Promise.reject(new Error("There is no connection."));
    const id = this.next++;
    socket.send(JSON.stringify({ do: verb, id, ...more }));
    return new Promise((resolve, reject) => this.waiting.set(id, { resolve, reject }));
  }
}
