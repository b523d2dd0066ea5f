// Units in which a value can be shown: those of the same dimension.

/** Each family's units, by their size in the first one. @type {Record<string, number>[]} */
const FAMILIES = [
  { m: 1, cm: 0.01, mm: 0.001, km: 1000, inch: 0.0254, ft: 0.3048 },
  { rad: 1, deg: Math.PI / 180, rev: 2 * Math.PI },
  { s: 1, ms: 0.001, us: 1e-6, min: 60, hr: 3600 },
  { kg: 1, g: 0.001 },
  { N: 1, mN: 0.001, kN: 1000 },
  { V: 1, mV: 0.001 },
  { A: 1, mA: 0.001 },
  { Pa: 1, hPa: 100, kPa: 1000 },
  { Hz: 1, kHz: 1000 },
  { W: 1, mW: 0.001 },
  { percent: 0.01, "": 1 },
];
/** The same unit, as it may be written. */
const SPELLINGS = new Map([["degree", "deg"], ["radian", "rad"], ["in", "inch"], ["h", "hr"], ["rpm", "rev/min"]]);
/** Sums of units: how each may be shown in one of its family. */
const SHOWN = new Map([
  ["m/s", ["m/s", "cm/s", "mm/s", "km/hr"]],
  ["rad/s", ["rad/s", "deg/s", "rev/min"]],
]);

/** How large a unit is in its family's first, and which family each part has. @param {string} unit such as rad/s @returns {{size: number, dimension: string} | null} */
function measure(unit) {
  let size = 1;
  /** @type {string[]} */
  const dimension = [];
  const parts = (SPELLINGS.get(unit) ?? unit).split(/([*/])/);
  for (let i = 0; i < parts.length; i += 2) {
    const [, name, power] = /^([A-Za-z]*)\^?(-?\d*)$/.exec(parts[i].trim()) ?? [];
    if (name === undefined) return null;
    const known = SPELLINGS.get(name) ?? name;
    const family = FAMILIES.findIndex((one) => known in one);
    if (family < 0) return null;
    const exponent = (power ? Number(power) : 1) * (parts[i - 1] === "/" ? -1 : 1);
    size *= FAMILIES[family][known] ** exponent;
    dimension.push(`${family}^${exponent}`);
  }
  return { size, dimension: dimension.sort().join(" ") };
}

/** Units in which a value can be shown, its own first. @param {string} unit @returns {string[]} */
export function alternatives(unit) {
  const own = measure(unit);
  if (!own || unit === "") return [unit];
  const families = FAMILIES.map((one) => Object.keys(one));
  const candidates = [...SHOWN.values(), ...families].find((some) =>
    some.some((one) => measure(one)?.dimension === own.dimension));
  return [unit, ...(candidates ?? []).filter((one) => one !== unit && factor(unit, one) !== 1)];
}

/** The number by which a value is multiplied; 1 if the units do not fit. @param {string} from @param {string} to */
export function factor(from, to) {
  const [one, other] = [measure(from), measure(to)];
  return one && other && one.dimension === other.dimension ? one.size / other.size : 1;
}

/** A unit as people write it. @param {string} unit */
export function written(unit) {
  return unit === "percent" ? "%" : unit.replaceAll("**", "^");
}

/** 1, 2 or 5 times a power of ten, at least so large. @param {number} least */
export function nice(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return power * ([1, 2, 5].find((one) => one * power >= least) ?? 10);
}

/** The multiples of a step in a range. @param {number} step @param {number} low @param {number} high */
export function multiples(step, low, high) {
  const first = Math.ceil(low / step);
  return Array.from({ length: Math.floor(high / step) - first + 1 }, (_, i) => (first + i) * step);
}

/** A number with six digits, at most. @param {number} value */
export function digits(value) {
  if (!Number.isFinite(value)) return String(value);
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e7)) return value.toExponential(3);
  return String(Number(value.toPrecision(5)));
}

/** Any value as a short text. @param {unknown} value @returns {string} */
export function show(value) {
  if (typeof value === "number") return digits(value);
  if (value === undefined) return "";
  if (value instanceof Uint8Array) return `${value.length} bytes`;
  if (value instanceof Map) return [...value].map(([k, v]) => `${k} ${show(v)}`).join(", ");
  if (Array.isArray(value)) {
    const shown = value.slice(0, 8).map(show).join(", ");
    return value.length > 8 ? `${shown}, and ${value.length - 8} more` : shown;
  }
  return String(value).slice(0, 200);
}
