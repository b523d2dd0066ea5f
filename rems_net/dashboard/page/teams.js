// The grid of all fabrics at a router: who is there, how it goes, and STOP of each.

import { button, by, held, make, write } from "./dom.js";
import { compare } from "./tree.js";

/** @typedef {import("./link.js").Link} Link @typedef {Record<string, any>} Row one fabric: see teams.py */

/** ms between two looks while the grid is shown, and while it is not. */
const [LOOK, REST] = [1000, 5000];

export class Teams {
  /** @param {() => Link} link @param {(sentence: string, level?: string) => void} say */
  constructor(link, say) {
    this.link = link;
    this.say = say;
    this.fabric = "";
    this.asked = this.shown = false;
    this.before = 0;
    /** whether the grid has been shown, or hidden, by itself or by hand */
    this.chosen = new URLSearchParams(location.search).size > 0;
    this.rows = /** @type {Row[]} */ ([]);
    this.tiles = /** @type {Map<string, ReturnType<Teams["tile"]>>} */ (new Map());
    this.section = by("teams");
    this.toggle = button("teams", () => this.show(Boolean(this.section.hidden)), "all fabrics at this router");
    this.toggle.hidden = true;
    by("time").before(this.toggle);
    by("team-tools").append(
      button("STOP all", () => this.ask("stop_teams", "all"), "stop the robots of every team"),
      held("hold to release all", () => this.ask("release_teams", "all"), "let the robots of every team go on"),
    );
  }

  /** How many robots stand on all fabrics, and of which that is not sure. */
  standing() {
    const held = this.rows.filter((row) => row.stopped);
    const [stand, robots] = ["stand", "robots"].map((key) => held.reduce((sum, row) => sum + (row[key] ?? 0), 0));
    const unsure = this.rows.flatMap((row) => (row.unsure ?? []).map((/** @type {string} */ why) => `${row.fabric}: ${why}`));
    return { holds: `STOP holds in ${held.length} of ${this.rows.length}: ${stand} of ${robots} robots stand`, unsure, stopped: held.length > 0 };
  }

  /** @param {boolean} shown */
  show(shown) {
    this.chosen = true;
    this.section.hidden = !(this.shown = shown);
    document.body.classList.toggle("with-teams", shown);
    this.toggle.setAttribute("aria-expanded", String(shown));
    this.before = 0;
  }

  /** Look at all fabrics, if it is time to. @param {number} now ms */
  look(now) {
    if (this.asked || now - this.before < (this.section.hidden ? REST : LOOK) || document.hidden) return;
    [this.before, this.asked] = [now, true];
    this.link().ask("teams").then((found) => this.hear(found), () => {}).finally(() => { this.asked = false; });
  }

  /** @param {{rows: Row[], teacher: boolean}} found */
  hear({ rows, teacher }) {
    this.rows = rows.sort((a, b) => compare(a.fabric, b.fabric));
    this.toggle.hidden = rows.length < 2;
    write(this.toggle, `teams (${rows.length})`);
    if (!this.chosen && teacher && rows.length > 1) this.show(true);
    if (!this.section.hidden) this.draw();
  }

  draw() {
    const names = this.rows.map((row) => row.fabric);
    if (names.join() !== [...this.tiles.keys()].join()) {
      const old = this.tiles;
      this.tiles = new Map(names.map((name) => [name, old.get(name) ?? this.tile(name)]));
      by("team-list").replaceChildren(...[...this.tiles.values()].map(({ tile }) => tile));
    }
    for (const row of this.rows) {
      const { tile, state, facts, who, stop, release } = this.tiles.get(row.fabric) ?? this.tile(row.fabric);
      const [kind, text] = stateOf(row);
      tile.className = `team${row.fabric === this.fabric ? " own" : ""}`;
      state.className = kind;
      write(state, text);
      const late = row.late?.length ? `, late: ${row.late.slice(0, 3).join(", ")}` : "";
      write(facts, row.clock ? `tick ${row.tick}, ${row.robots} robot${row.robots === 1 ? "" : "s"}${late}` : "");
      const away = row.away.length ? `not here: ${row.away.join(", ")}` : "";
      write(who, [row.here.join(", "), away].filter(Boolean).join("; "));
      stop.hidden = !row.there;
      release.hidden = !row.stopped;
    }
  }

  /** @param {string} name */
  tile(name) {
    const link = make("a", { href: `?fabric=${encodeURIComponent(name)}${location.hash}` }, name);
    const [state, facts, who] = [make("span"), make("p"), make("p", { class: "quiet" })];
    const stop = button("STOP", () => this.ask("stop_teams", [name]), `stop the robots of ${name}`);
    const release = held("hold to release", () => this.ask("release_teams", [name]), `let the robots of ${name} go on`);
    const tile = make("li", {}, make("div", {}, link, state), facts, who, make("div", {}, stop, release));
    return { tile, state, facts, who, stop, release };
  }

  /** Stop or release fabrics, and show what each one answers. @param {string} verb @param {string[] | "all"} fabrics */
  ask(verb, fabrics) {
    this.link().ask(verb, { fabrics }).then((done) => {
      for (const [name, said] of Object.entries(done)) {
        if (typeof said === "string") this.say(`${name}: ${said}`);
        else this.say(`${name}: ${verb === "stop_teams" ? said.join("; ") : "released"}`, "info");
      }
      this.before = 0;
    }, (error) => this.say(error.message));
  }
}

/** How it goes on a fabric: class and text. @param {Row} row @returns {[string, string]} */
function stateOf(row) {
  if (row.error) return ["bad", row.error];
  if (row.stopped) return ["bad", "stopped"];
  if (!row.clock) return ["quiet", "nothing runs"];
  if (row.clock.held) return ["bad", `held by ${row.clock.held}`];
  if (row.clock.paused) return ["warn", "paused"];
  return ["good", "running"];
}
