// Plots over time: one axis for each unit; pause, look back, another unit by a click.

import { button, by, colour, make, pen, select, series, stroke, text, write } from "./dom.js";
import { alternatives, digits, factor, multiples, nice, written } from "./units.js";

/** @typedef {import("./store.js").Store} Store @typedef {import("./store.js").History} History */
/** @typedef {import("./dom.js").Spot} Spot */
/** @typedef {{key: string, ink: number, shown: string, wish: string}} Series `shown`: its unit; `wish`: of its layout */
/** @typedef {{canvas: HTMLCanvasElement, legend: HTMLElement, head: HTMLElement}} Panel */

/** s. How much of the past is shown. */
export const SPANS = [5, 10, 30, 60, 300, 600];
const LEFT = 64;
const BOTTOM = 20;

export class Plots {
  /** @param {Store} store */
  constructor(store) {
    this.store = store;
    this.series = /** @type {Series[]} */ ([]);
    this.span = 10;
    /** s. The newest time that is shown; null: now. */
    this.end = /** @type {number | null} */ (null);
    /** @type {Map<string, Panel>} by unit */
    this.panels = new Map();
    /** s. Time under the pointer. */
    this.cursor = NaN;
    this.inks = 0;
    const tools = by("plot-tools");
    this.pause = button("pause", () => this.hold(this.end === null ? this.store.t : null), "look at the past");
    this.spans = select("length of the plots", SPANS.map((s) => [String(s), s < 60 ? `${s} s` : `${s / 60} min`]), (s) => this.show(Number(s)));
    this.show(10);
    tools.append(this.pause, this.spans,
      button("earlier", () => this.shift(-this.span / 2)), button("later", () => this.shift(this.span / 2)),
      button("clear", () => this.clear(), "remove all plots"));
  }

  /** @param {number} span s */
  show(span) {
    this.span = span;
    this.spans.value = String(span);
  }

  /** @param {number | null} end */
  hold(end) {
    this.end = end;
    write(this.pause, end === null ? "pause" : "go on");
  }

  /** @param {number} s */
  shift(s) {
    const end = (this.end ?? this.store.t) + s;
    this.hold(end >= this.store.t ? null : Math.max(0, end));
  }

  clear() {
    this.series = [];
    this.inks = 0;
    this.rebuild();
  }

  /** Show a field, or no longer. @param {string} key @param {string} [wish] unit */
  toggle(key, wish = "") {
    if (this.series.some((one) => one.key === key)) {
      this.series = this.series.filter((one) => one.key !== key);
    } else {
      this.series.push({ key, ink: this.inks++, shown: "", wish });
      this.store.wanted.add(key);
    }
    this.rebuild();
  }

  rebuild() {
    for (const one of this.series) {
      const own = this.store.field(one.key)?.row.unit ?? "";
      if (!one.shown) one.shown = alternatives(own).includes(one.wish) ? one.wish : own;
    }
    const units = [...new Set(this.series.map((one) => one.shown))];
    this.panels = new Map(units.map((unit) => [unit, this.panels.get(unit) ?? this.panel()]));
    const list = by("plot-list");
    list.replaceChildren(...[...this.panels].map(([unit, panel]) => {
      this.head(unit, panel);
      return make("figure", {}, panel.canvas, make("figcaption", {}, panel.head, panel.legend));
    }));
    if (!units.length) list.replaceChildren(make("p", { class: "quiet" }, "Click a field among the values to plot it."));
    this.version = this.store.version;
  }

  version = -1;

  /** @returns {Panel} */
  panel() {
    const canvas = make("canvas", { role: "img" });
    canvas.addEventListener("pointermove", (event) => {
      const [begin, end] = this.window();
      this.cursor = begin + (event.offsetX - LEFT) / (canvas.clientWidth - LEFT) * (end - begin);
      if (event.buttons) this.shift(-event.movementX / (canvas.clientWidth - LEFT) * this.span);
    });
    canvas.addEventListener("pointerleave", () => { this.cursor = NaN; });
    return { canvas, legend: make("span", { class: "legend" }), head: make("span", { class: "unit-line" }) };
  }

  /** @param {string} unit @param {Panel} panel */
  head(unit, panel) {
    const own = this.series.filter((one) => one.shown === unit);
    const first = this.store.field(own[0]?.key ?? "")?.row.unit ?? unit;
    const choices = alternatives(first);
    const change = button(written(unit) || "no unit", () => {
      const next = choices[(choices.indexOf(unit) + 1) % choices.length];
      for (const one of own) one.shown = next;
      this.rebuild();
    }, "another unit");
    change.disabled = choices.length < 2;
    panel.head.replaceChildren(change);
    panel.canvas.setAttribute("aria-label", `${own.map((one) => one.key).join(", ")} over time`);
    panel.legend.replaceChildren(...own.map((one) => {
      const value = make("span", { class: "number" });
      const swatch = make("span", { class: "swatch" });
      swatch.style.background = `var(--series-${one.ink % 8})`;
      const remove = button("×", () => this.toggle(one.key), `remove ${one.key}`);
      remove.setAttribute("aria-label", `remove ${one.key}`);
      const line = make("span", { class: "series" }, swatch, `${one.key} `, value, remove);
      line.dataset.key = one.key;
      return line;
    }));
  }

  /** @returns {[number, number]} s */
  window() {
    const end = this.end ?? this.store.t;
    return [end - this.span, end];
  }

  draw() {
    if (this.version !== this.store.version) this.rebuild();
    for (const [unit, panel] of this.panels) this.drawOne(unit, panel);
  }

  /** @param {string} unit @param {Panel} panel */
  drawOne(unit, { canvas, legend }) {
    const got = pen(canvas);
    if (!got) return;
    const { pen: on, width, height } = got;
    const [begin, end] = this.window();
    const columns = Math.max(1, Math.floor(width - LEFT));
    const drawn = this.series.filter((one) => one.shown === unit).map((one) => {
      const found = this.store.field(one.key);
      const history = found?.port.history.get(found.row.path);
      const scale = found ? factor(found.row.unit, unit) : 1;
      return { one, history, scale, band: history && reduce(history, begin, end, columns, scale) };
    });
    const bands = drawn.flatMap(({ band }) => (band ? [band] : []));
    let low = Math.min(...bands.map((band) => band.least));
    let high = Math.max(...bands.map((band) => band.most));
    if (low > high) [low, high] = [-1, 1];
    const margin = (high - low) * 0.06 || Math.abs(high) * 0.1 || 1;
    low -= margin;
    high += margin;
    const bottom = height - BOTTOM;
    const y = (/** @type {number} */ v) => bottom - (v - low) / (high - low) * (bottom - 6);
    axes(on, width, bottom, begin, end, low, high, y);
    for (const { one, band } of drawn) if (band) line(on, band, series(one.ink), y);
    if (this.cursor >= begin && this.cursor <= end) {
      const x = LEFT + (this.cursor - begin) / (end - begin) * columns;
      stroke(on, [[[x + 0.5, 0], [x + 0.5, bottom]]], colour("--quiet"));
    }
    drawn.forEach(({ one, history, scale }) => {
      const at = Number.isFinite(this.cursor) ? this.cursor : end;
      let i = history ? Math.min(history.count - 1, history.find(at)) : -1;
      if (history && i > 0 && history.times[i] > at) i--;
      const node = legend.querySelector(`[data-key="${CSS.escape(one.key)}"] .number`);
      if (node) write(node, history && i >= 0 ? digits(history.values[i] * scale) : "no value yet");
    });
  }
}

/** @typedef {{low: Float32Array, high: Float32Array, least: number, most: number}} Band */

/** Minimum and maximum for each column; NaN if nothing is there. @param {History} history @param {number} begin @param {number} end @param {number} columns @param {number} scale @returns {Band} */
function reduce(history, begin, end, columns, scale) {
  const low = new Float32Array(columns).fill(NaN);
  const high = new Float32Array(columns).fill(NaN);
  let [least, most] = [Infinity, -Infinity];
  const { times, values, count } = history;
  const ratio = columns / (end - begin);
  for (let i = Math.max(0, history.find(begin) - 1); i < count && times[i] <= end; i++) {
    const value = values[i] * scale;
    if (value !== value) continue;
    const column = Math.min(columns - 1, Math.max(0, Math.floor((times[i] - begin) * ratio)));
    if (!(low[column] <= value)) low[column] = value;
    if (!(high[column] >= value)) high[column] = value;
    if (value < least) least = value;
    if (value > most) most = value;
  }
  return { low, high, least, most };
}

/** @param {CanvasRenderingContext2D} on @param {Band} band @param {string} ink @param {(v: number) => number} y */
function line(on, { low, high }, ink, y) {
  on.strokeStyle = ink;
  on.lineWidth = 1.5;
  on.beginPath();
  for (let i = 0; i < low.length; i++) {
    if (low[i] !== low[i]) continue;
    on.lineTo(LEFT + i, y(high[i]));
    if (high[i] !== low[i]) on.lineTo(LEFT + i, y(low[i]));
  }
  on.stroke();
}

/** @param {CanvasRenderingContext2D} on @param {number} width @param {number} bottom @param {number} begin @param {number} end @param {number} low @param {number} high @param {(v: number) => number} y */
function axes(on, width, bottom, begin, end, low, high, y) {
  const quiet = colour("--quiet");
  const x = (/** @type {number} */ t) => LEFT + (t - begin) / (end - begin) * (width - LEFT);
  const values = multiples(nice((high - low) * 28 / bottom), low, high);
  const times = multiples(nice((end - begin) * 90 / (width - LEFT)), Math.max(0, begin), end);
  const levels = values.map((v) => /** @type {Spot[]} */ ([[LEFT, y(v)], [width, y(v)]]));
  const instants = times.map((t) => /** @type {Spot[]} */ ([[x(t), 0], [x(t), bottom]]));
  stroke(on, [...levels, ...instants], colour("--grid"));
  for (const v of values) text(on, digits(v), [LEFT - 6, y(v) + 4], quiet, "right");
  for (const t of times) if (x(t) < width - 16) text(on, `${digits(t)} s`, [x(t), bottom + 15], quiet);
}
