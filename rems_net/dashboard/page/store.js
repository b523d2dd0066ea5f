// The newest values of all ports, and what has been seen of them.

import { decode, NUMBERS } from "./msgpack.js";
import { factor } from "./units.js";

/** @typedef {{path: string, dtype: string, unit: string, range?: [number, number], shape?: number[], choices?: string[], doc?: string}} Row a field of a schema */
/** @typedef {{id: number, key: string, schema: string}} Channel */

/** Points of one field: more than 10 minutes at 30 a second. Half goes when it is full. */
const POINTS = 40_000;
/** Fields of which everything is kept, plotted or not. */
const FIELDS = 400;

/** Values of one field, over time. */
export class History {
  constructor() {
    this.count = 0;
    this.times = new Float64Array(256);
    this.values = new Float32Array(256);
  }

  /** @param {number} t @param {number} value */
  add(t, value) {
    if (this.count && t <= this.times[this.count - 1]) {
      if (t === this.times[this.count - 1]) this.values[this.count - 1] = value;
      return;
    }
    if (this.count === this.times.length) this.grow();
    this.times[this.count] = t;
    this.values[this.count++] = value;
  }

  grow() {
    const { times, values, count } = this;
    const gone = count >= POINTS ? count >> 1 : 0;
    this.times = new Float64Array(Math.min(POINTS, count * 2));
    this.values = new Float32Array(this.times.length);
    this.times.set(times.subarray(gone));
    this.values.set(values.subarray(gone));
    this.count -= gone;
  }

  /** @param {number} t @returns {number} index of the first point at or after t */
  find(t) {
    let low = 0;
    let high = this.count;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[middle] < t) low = middle + 1;
      else high = middle;
    }
    return low;
  }
}

/** One port of one agent. */
export class Port {
  /** @param {string} key such as robot/sim/state */
  constructor(key) {
    this.key = key;
    const [kind, name, ...rest] = key.split("/");
    this.agent = `${kind}/${name}`;
    this.kind = kind;
    this.name = rest.join("/");
    this.rows = /** @type {Row[]} */ ([]);
    /** @type {Map<string, unknown>} by path */
    this.values = new Map();
    this.tick = -1;
    this.t = 0;
    /** ms. Time of this browser at which the newest value came. */
    this.seen = 0;
    this.problem = "";
    /** @type {Map<string, History>} by path */
    this.history = new Map();
  }

  /** @param {string} path @returns {number} NaN if it is no number */
  number(path) {
    const value = this.values.get(path);
    if (typeof value === "number") return value;
    return typeof value === "boolean" ? Number(value) : NaN;
  }

  /** A number in another unit. @param {string} path @param {string} unit @returns {number} NaN if it is no number */
  as(path, unit) {
    return this.number(path) * factor(this.row(path)?.unit ?? unit, unit);
  }

  /** @param {string} path @returns {Row | undefined} */
  row(path) {
    return this.rows.find((row) => row.path === path);
  }
}

export class Store {
  constructor() {
    this.channels = /** @type {Map<number, Channel>} */ (new Map());
    this.schemas = /** @type {Map<string, Row[] | null>} */ (new Map());
    this.ports = /** @type {Map<string, Port>} */ (new Map());
    /** Agents that are present, also those of which nothing is received. @type {string[]} */
    this.agents = [];
    /** grows when ports or their fields have changed */
    this.version = 0;
    this.kept = 0;
    /** s. The newest fabric time. */
    this.t = 0;
    this.tick = 0;
    this.pace = 0;
    /** @type {Set<string>} fields that are kept although there are many: key/path */
    this.wanted = new Set();
    /** @type {Map<number, [Uint8Array, Uint8Array]>} values whose schema has not come */
    this.waiting = new Map();
  }

  forget() {
    this.channels.clear();
    this.schemas.clear();
    this.ports.clear();
    this.waiting.clear();
    this.agents = [];
    this.kept = this.t = this.tick = 0;
    this.version++;
  }

  /** Forget all values, and keep their fields: a recording is at another time. */
  rewind() {
    for (const port of this.ports.values()) {
      port.values.clear();
      for (const history of port.history.values()) history.count = 0;
    }
  }

  /** Note who is present. @param {string[]} agents */
  attend(agents) {
    if (agents.join() === this.agents.join()) return;
    this.agents = agents;
    this.version++;
  }

  /** @param {string} key */
  port(key) {
    const port = this.ports.get(key) ?? new Port(key);
    if (!this.ports.has(key)) this.version++;
    this.ports.set(key, port);
    return port;
  }

  /** @param {Record<string, Row[] | null>} schemas */
  learn(schemas) {
    for (const [name, rows] of Object.entries(schemas)) this.schemas.set(name, rows);
    for (const [id, [stamp, payload]] of [...this.waiting]) {
      this.waiting.delete(id);
      this.take(id, stamp, payload);
    }
  }

  /** @param {Channel[]} channels */
  meet(channels) {
    for (const channel of channels) this.channels.set(channel.id, channel);
  }

  /** Read a binary frame. @param {DataView} frame */
  read(frame) {
    if (frame.getUint8(0) !== 1) return;
    const bytes = new Uint8Array(frame.buffer);
    for (let at = 1; at < bytes.length; ) {
      const id = frame.getUint16(at, true);
      const stamp = at + 7;
      const payload = stamp + frame.getUint8(at + 2);
      at = payload + frame.getUint32(at + 3, true);
      this.take(id, bytes.subarray(stamp, payload), bytes.subarray(payload, at));
    }
  }

  /** @param {number} id @param {Uint8Array} stamp @param {Uint8Array} payload */
  take(id, stamp, payload) {
    const channel = this.channels.get(id);
    if (!channel) return;
    const rows = this.schemas.get(channel.schema || channel.key);
    if (rows === undefined && channel.key !== "clock/tick" && channel.schema !== "large") {
      this.waiting.set(id, [stamp, payload]);
      return;
    }
    try {
      const words = stamp.length ? decode(stamp) : [];
      const [n, t] = Array.isArray(words) ? words : [];
      const found = decode(payload);
      if (channel.key === "clock/tick") this.beat(found);
      else if (channel.key.includes("/@crowd/") && found instanceof Map) {
        for (const [member, values] of found) {
          this.fill(this.port(channel.key.replace("@crowd", member)), rows, values, n, t);
        }
      } else this.fill(this.port(channel.key), rows, found, n, t);
    } catch (error) {
      if (channel.key.includes("@")) return;
      this.port(channel.key).problem = `not readable: ${error instanceof Error ? error.message : error}`;
    }
  }

  /** @param {unknown} words of a tick */
  beat(words) {
    if (!Array.isArray(words) || words.length !== 7) return;
    [, this.tick, this.t, , this.pace] = words;
  }

  /** @param {Port} port @param {Row[] | null | undefined} rows @param {unknown} found @param {unknown} n @param {unknown} t */
  fill(port, rows, found, n, t) {
    if (!(found instanceof Map)) throw new Error("it is no map of fields");
    const fields = rows ?? guess(found, "");
    if (port.rows !== fields && (rows || !same(port.rows, fields))) {
      port.rows = fields;
      port.values.clear();
      port.history.clear();
      this.version++;
    }
    port.problem = "";
    port.tick = typeof n === "number" ? n : -1;
    port.t = typeof t === "number" && port.tick >= 0 ? t : this.t;
    port.seen = performance.now();
    for (const row of fields) {
      const value = shaped(dig(found, row.path), row);
      port.values.set(row.path, value);
      if (typeof value === "number" || typeof value === "boolean") this.keep(port, row.path, Number(value));
    }
  }

  /** @param {Port} port @param {string} path @param {number} value */
  keep(port, path, value) {
    let history = port.history.get(path);
    if (!history) {
      if (this.kept >= FIELDS && !this.wanted.has(`${port.key}/${path}`)) return;
      this.kept++;
      history = new History();
      port.history.set(path, history);
    }
    history.add(port.t, value);
  }

  /** Find a field by its key, such as robot/sim/state/wheel/left. @param {string} key @returns {{port: Port, row: Row} | null} */
  field(key) {
    const chunks = key.split("/");
    const port = this.ports.get(chunks.slice(0, 3).join("/"));
    const row = port?.row(chunks.slice(3).join("/"));
    return port && row ? { port, row } : null;
  }
}

/** @param {Map<string, unknown>} found @param {string} path @returns {unknown} */
function dig(found, path) {
  return path.split("/").reduce((value, chunk) => (value instanceof Map ? value.get(chunk) : undefined), /** @type {unknown} */ (found));
}

/** Fields of a value without a schema. @param {Map<string, unknown>} found @param {string} prefix @returns {Row[]} */
function guess(found, prefix) {
  return [...found].flatMap(([name, value]) => {
    const path = prefix + name;
    if (value instanceof Map) return guess(value, `${path}/`);
    return [{ path, dtype: typeof value === "number" ? "float" : typeof value, unit: "" }];
  });
}

/** @param {Row[]} one @param {Row[]} other */
function same(one, other) {
  return one.length === other.length && one.every((row, i) => row.path === other[i].path);
}

/** The value of a field; an array comes as bytes. @param {unknown} value @param {Row} row @returns {unknown} */
function shaped(value, row) {
  if (!row.shape || !(value instanceof Uint8Array)) return value;
  const [method, size] = NUMBERS[/** @type {keyof typeof NUMBERS} */ (row.dtype)] ?? [];
  if (!method || value.length > 4096) return `${row.shape.join(" x ")} values`;
  const view = new DataView(value.buffer, value.byteOffset, value.byteLength);
  const found = [];
  for (let at = 0; at + size <= value.length; at += size) found.push(view[method](at, true));
  return found;
}
