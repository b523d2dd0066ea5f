// Settings of an agent: listed, and those that it allows are changed while it runs.

import { make, select, write } from "./dom.js";
import { show, written } from "./units.js";

/** @typedef {{name: string, value: unknown, unit: string, dtype: string, adjustable: boolean, range?: [number, number], choices?: string[], doc?: string}} Row */

/** ms. A slider that moves changes its setting so often. */
const PERIOD = 100;

export class Settings {
  /** @param {(verb: string, more: Record<string, unknown>) => Promise<Row[]>} ask @param {(sentence: string) => void} say */
  constructor(ask, say) {
    this.ask = ask;
    this.say = say;
    /** @type {Map<string, HTMLElement>} by agent; they stay when the tree is built anew */
    this.made = new Map();
  }

  /** The settings of an agent, which are asked for when they are opened. @param {string} agent */
  of(agent) {
    const old = this.made.get(agent);
    if (old) return old;
    const table = make("table", { "aria-label": `settings of ${agent}` });
    const made = make("details", { class: "settings" }, make("summary", {}, "settings"), table);
    made.addEventListener("toggle", () => {
      if (made.open) this.ask("settings", { agent }).then((rows) => this.fill(agent, table, rows), (error) => this.say(error.message));
    });
    return this.made.set(agent, made) && made;
  }

  /** @param {string} agent @param {HTMLTableElement} table @param {Row[]} rows */
  fill(agent, table, rows) {
    table.replaceChildren(...rows.map((row) => {
      const text = make("td", { class: "value" }, show(row.value));
      const name = make("th", { scope: "row", title: String(row.doc ?? "") }, String(row.name));
      if (row.adjustable === true) name.append(this.control(agent, row, text));
      return make("tr", {}, name, text, make("td", {}, written(String(row.unit))));
    }));
    if (!rows.length) table.replaceChildren(make("caption", {}, "It has no settings."));
  }

  /** What changes a setting. @param {string} agent @param {Row} row @param {HTMLElement} text */
  control(agent, row, text) {
    const label = `${row.name} of ${agent}`;
    const set = (/** @type {unknown} */ value) => this.set(agent, row.name, value, text);
    const choices = row.dtype === "bool" ? ["false", "true"] : row.choices;
    if (choices) {
      const made = select(label, choices.map((one) => [one, one]), (one) => set(row.choices ? one : one === "true"));
      made.value = String(row.value);
      return made;
    }
    const [low, high] = row.range ?? [];
    const slides = Number.isFinite(low) && Number.isFinite(high);
    const number = typeof row.value === "number";
    const made = make("input", { type: slides ? "range" : number ? "number" : "text", "aria-label": label, step: "any" });
    const step = row.dtype.startsWith("f") ? (Number(high) - Number(low)) / 200 : 1;
    if (slides) Object.assign(made, { min: String(low), max: String(high), step: String(step) });
    made.value = String(row.value);
    let timer = 0;
    const later = () => {
      timer = 0;
      set(number ? made.valueAsNumber : made.value);
    };
    made.addEventListener(slides ? "input" : "change", () => { timer ||= window.setTimeout(later, PERIOD); });
    return made;
  }

  /** @param {string} agent @param {string} name @param {unknown} value @param {HTMLElement} text */
  set(agent, name, value, text) {
    this.ask("adjust", { agent, values: { [name]: value } }).then(
      (rows) => write(text, show(rows.find((row) => row.name === name)?.value)),
      (error) => this.say(error.message),
    );
  }
}
