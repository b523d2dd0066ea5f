// Decoder of msgpack, as far as rems_net writes it. Bytes may come from any program, so
// sizes and depth are bounded, and anything unexpected is an error.

/** Most levels of maps in each other. */
const DEEPEST = 8;
const utf8 = new TextDecoder("utf-8", { fatal: true });

/**
 * Decode one value; throw an Error for malformed bytes.
 * @param {Uint8Array} bytes
 * @returns {unknown} numbers, texts, booleans, null, arrays, Uint8Array, and Map for maps
 */
export function decode(bytes) {
  const reader = new Reader(bytes);
  const value = reader.value(0);
  if (reader.at !== bytes.length) throw new Error("bytes are left over");
  return value;
}

class Reader {
  /** @param {Uint8Array} bytes */
  constructor(bytes) {
    this.bytes = bytes;
    this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    this.at = 0;
  }

  /** @param {number} count @returns {number} where these bytes begin */
  take(count) {
    const begin = this.at;
    if (begin + count > this.bytes.length) throw new Error("bytes are missing");
    this.at += count;
    return begin;
  }

  /** @param {number} size @returns {number} an unsigned number of 1, 2 or 4 bytes */
  length(size) {
    const at = this.take(size);
    if (size === 1) return this.view.getUint8(at);
    return size === 2 ? this.view.getUint16(at) : this.view.getUint32(at);
  }

  /** @param {number} count */
  text(count) {
    const at = this.take(count);
    return utf8.decode(this.bytes.subarray(at, at + count));
  }

  /** @param {number} count */
  binary(count) {
    const at = this.take(count);
    return this.bytes.subarray(at, at + count);
  }

  /** @param {number} count @param {number} depth */
  list(count, depth) {
    if (count > this.bytes.length - this.at) throw new Error("a list is too long");
    const found = [];
    for (let i = 0; i < count; i++) found.push(this.value(depth + 1));
    return found;
  }

  /** @param {number} count @param {number} depth */
  map(count, depth) {
    if (count > this.bytes.length - this.at) throw new Error("a map is too long");
    /** @type {Map<string, unknown>} */
    const found = new Map();
    for (let i = 0; i < count; i++) {
      const key = this.value(DEEPEST);
      found.set(String(key), this.value(depth + 1));
    }
    return found;
  }

  /** @param {number} depth @returns {unknown} */
  value(depth) {
    if (depth > DEEPEST) throw new Error("nested too deeply");
    const head = this.view.getUint8(this.take(1));
    if (head < 0x80) return head;
    if (head < 0x90) return this.map(head & 15, depth);
    if (head < 0xa0) return this.list(head & 15, depth);
    if (head < 0xc0) return this.text(head & 31);
    if (head >= 0xe0) return head - 256;
    const view = this.view;
    switch (head) {
      case 0xc0: return null;
      case 0xc2: return false;
      case 0xc3: return true;
      case 0xc4: return this.binary(this.length(1));
      case 0xc5: return this.binary(this.length(2));
      case 0xc6: return this.binary(this.length(4));
      case 0xca: return view.getFloat32(this.take(4));
      case 0xcb: return view.getFloat64(this.take(8));
      case 0xcc: return this.length(1);
      case 0xcd: return this.length(2);
      case 0xce: return this.length(4);
      case 0xcf: return Number(view.getBigUint64(this.take(8)));
      case 0xd0: return view.getInt8(this.take(1));
      case 0xd1: return view.getInt16(this.take(2));
      case 0xd2: return view.getInt32(this.take(4));
      case 0xd3: return Number(view.getBigInt64(this.take(8)));
      case 0xd9: return this.text(this.length(1));
      case 0xda: return this.text(this.length(2));
      case 0xdb: return this.text(this.length(4));
      case 0xdc: return this.list(this.length(2), depth);
      case 0xdd: return this.list(this.length(4), depth);
      case 0xde: return this.map(this.length(2), depth);
      case 0xdf: return this.map(this.length(4), depth);
      default: throw new Error(`0x${head.toString(16)} is not used here`);
    }
  }
}
