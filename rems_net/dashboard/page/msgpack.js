// Decoder of msgpack, as far as rems_net writes it. Bytes may come from any program, so
// sizes and depth are bounded, and anything unexpected is an error.

/** Most levels of maps in each other. */
const DEEPEST = 8;
/** How the numbers of a dtype are read: a method of DataView, and their size in bytes. */
export const NUMBERS = /** @type {const} */ ({
  f4: ["getFloat32", 4], f8: ["getFloat64", 8], bool: ["getUint8", 1],
  u1: ["getUint8", 1], u2: ["getUint16", 2], u4: ["getUint32", 4],
  i1: ["getInt8", 1], i2: ["getInt16", 2], i4: ["getInt32", 4],
});
/** Their dtypes by the head, from 0xca; those of 8 bytes are read apart. */
const DTYPES = /** @type {const} */ (["f4", "f8", "u1", "u2", "u4", null, "i1", "i2", "i4"]);
const utf8 = new TextDecoder("utf-8", { fatal: true });

/** Decode one value; throw an Error for malformed bytes. @param {Uint8Array} bytes @returns {unknown} numbers, texts, booleans, null, arrays, Uint8Array, and Map for maps */
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

  /** @param {keyof typeof NUMBERS} dtype */
  number(dtype) {
    const [method, size] = NUMBERS[dtype];
    return this.view[method](this.take(size));
  }

  /** A length of 1, 2 or 4 bytes. @param {number} power of two: 0, 1 or 2 */
  length(power) {
    return this.number(/** @type {const} */ (["u1", "u2", "u4"])[power]);
  }

  /** @param {number} count */
  text(count) {
    return utf8.decode(this.binary(count));
  }

  /** @param {number} count */
  binary(count) {
    const at = this.take(count);
    return this.bytes.subarray(at, at + count);
  }

  /** @param {number} count @param {number} depth */
  list(count, depth) {
    if (count > this.bytes.length - this.at) throw new Error("a list is too long");
    return Array.from({ length: count }, () => this.value(depth + 1));
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
    const dtype = DTYPES[head - 0xca];
    if (dtype) return this.number(dtype);
    switch (head) {
      case 0xc0: return null;
      case 0xc2: return false;
      case 0xc3: return true;
      case 0xc4: case 0xc5: case 0xc6: return this.binary(this.length(head - 0xc4));
      case 0xcf: return Number(this.view.getBigUint64(this.take(8)));
      case 0xd3: return Number(this.view.getBigInt64(this.take(8)));
      case 0xd9: case 0xda: case 0xdb: return this.text(this.length(head - 0xd9));
      case 0xdc: case 0xdd: return this.list(this.length(head - 0xdb), depth);
      case 0xde: case 0xdf: return this.map(this.length(head - 0xdd), depth);
      default: throw new Error(`0x${head.toString(16)} is not used here`);
    }
  }
}
