// The tree of all values: agents, their ports, and fields with units.

import { by, button, make, write } from "./dom.js";
import { alternatives, factor, show, written } from "./units.js";

/** @typedef {import("./store.js").Store} Store @typedef {import("./store.js").Port} Port @typedef {import("./store.js").Row} Row */

/** Agents that are listed; a search finds the others. */
const MOST = 100;
/** So many agents are all open at first. */
const FEW = 8;
/** ms between two updates of the numbers. */
const PAUSE = 100;
const ORDER = ["clock", "input", "robot", "world", "process", "output"];

export class Tree {
  /** @param {Store} store @param {(key: string) => void} plot @param {(key: string) => Promise<string[]>} why @param {(agent: string) => HTMLElement} settings */
  constructor(store, plot, why, settings) {
    this.settings = settings;
    this.store = store;
    this.plot = plot;
    this.why = why;
    this.version = -1;
    this.words = "";
    this.drawn = 0;
    /** @type {Map<string, boolean>} whether an agent is open */
    this.open = new Map();
    /** Agents that are open: the server sends all their ports. @type {Set<string>} */
    this.shown = new Set();
    /** @type {Map<string, string>} key of a field -> unit in which it is shown */
    this.units = new Map();
    this.lines = /** @type {{port: Port, row: Row, cell: HTMLElement, unit: HTMLElement}[]} */ ([]);
    const search = /** @type {HTMLInputElement} */ (by("search"));
    search.addEventListener("input", () => {
      this.words = search.value.trim().toLowerCase();
      this.version = -1;
    });
  }

  /** Show the newest values. @param {number} now ms */
  update(now) {
    if (now - this.drawn < PAUSE) return;
    this.drawn = now;
    if (this.version !== this.store.version) this.build();
    for (const { port, row, cell, unit } of this.lines) {
      const shown = this.units.get(`${port.key}/${row.path}`) ?? row.unit;
      const value = port.values.get(row.path);
      const number = typeof value === "number" ? value * factor(row.unit, shown) : value;
      write(cell, port.problem || show(number));
      write(unit, written(shown));
    }
  }

  build() {
    const at = document.activeElement;
    this.version = this.store.version;
    this.lines = [];
    this.shown.clear();
    /** @type {Map<string, Port[]>} */
    const agents = new Map();
    for (const name of this.store.agents) {
      if (!this.words || name.toLowerCase().includes(this.words)) agents.set(name, []);
    }
    for (const port of this.store.ports.values()) {
      if (this.words && !this.finds(port)) continue;
      agents.set(port.agent, [...(agents.get(port.agent) ?? []), port]);
    }
    const names = [...agents.keys()].sort((a, b) => order(a) - order(b) || compare(a, b));
    /** @type {HTMLElement[]} */
    const shown = names.slice(0, MOST).map((name) => this.agent(name, agents.get(name) ?? [], names.length));
    const rest = names.length - shown.length;
    if (rest > 0) shown.push(make("p", { class: "quiet" }, `and ${rest} more agents: search for a name`));
    const none = this.words ? "Nothing has this name." : "No agent publishes a value yet.";
    if (!names.length) shown.push(make("p", { class: "quiet" }, none));
    by("tree").replaceChildren(...shown);
    if (at instanceof HTMLElement) at.focus(); // a slider stays in the hand
  }

  /** @param {Port} port */
  finds(port) {
    return port.rows.some((row) => `${port.key}/${row.path}`.toLowerCase().includes(this.words))
      || port.key.toLowerCase().includes(this.words);
  }

  /** @param {string} name @param {Port[]} ports @param {number} count */
  agent(name, ports, count) {
    const made = make("details", {}, make("summary", {}, name));
    made.open = this.open.get(name) ?? (count <= FEW || (this.words !== "" && count <= 30));
    if (made.open) this.shown.add(name);
    const fill = () => {
      made.append(...ports.sort((a, b) => compare(a.name, b.name)).map((port) => this.port(port)));
      const told = make("p", { class: "quiet why" });
      if (!name.startsWith("clock/")) made.append(this.settings(name));
      made.append(button("why?", () => {
        write(told, "...");
        this.why(name).then((lines) => write(told, lines.join(" ")), (error) => write(told, error.message));
      }, `why values of ${name} are missing or old`), told);
    };
    // The fields of a closed agent are not made: there may be thousands.
    if (made.open) fill();
    made.addEventListener("toggle", () => {
      this.open.set(name, made.open);
      if (made.open) this.shown.add(name);
      else this.shown.delete(name);
      if (made.open && made.children.length === 1) fill();
    });
    return made;
  }

  /** @param {Port} port */
  port(port) {
    const table = make("table", { "aria-label": port.key }, make("caption", {}, port.name));
    const all = port.name.toLowerCase().includes(this.words) || port.agent.includes(this.words);
    for (const row of port.rows) {
      const key = `${port.key}/${row.path}`;
      if (this.words && !all && !key.toLowerCase().includes(this.words)) continue;
      const cell = make("td", { class: "value" });
      const choices = alternatives(row.unit);
      const unit = button("", () => {
        const now = this.units.get(key) ?? row.unit;
        this.units.set(key, choices[(choices.indexOf(now) + 1) % choices.length]);
        this.drawn = 0;
      }, `another unit of ${row.path}`);
      Object.assign(unit, { className: "unit", disabled: choices.length < 2 });
      const name = button(row.path, () => this.plot(key), `plot ${key}${row.doc ? `: ${row.doc}` : ""}`);
      table.append(make("tr", {}, make("th", { scope: "row" }, name), cell, make("td", {}, unit)));
      this.lines.push({ port, row, cell, unit });
    }
    return table;
  }
}

/** @param {string} agent */
function order(agent) {
  return ORDER.indexOf(agent.split("/")[0]);
}

/** Compare names with numbers in them. @param {string} a @param {string} b */
export function compare(a, b) {
  return a.localeCompare(b, "en", { numeric: true });
}
