// The bar on top: lights, time, STOP and its release.

import { button, by, held, make, paces, write } from "./dom.js";

/** @typedef {import("./store.js").Store} Store @typedef {import("./link.js").Link} Link */
/** @typedef {Record<string, any>} Status */

export class Bar {
  /** @param {Store} store @param {() => Link} link @param {(sentence: string, level?: string) => void} say */
  constructor(store, link, say) {
    this.store = store;
    this.link = link;
    this.say = say;
    this.status = /** @type {Status} */ ({});
    /** why there is no connection; "" once the server has let this page in */
    this.gone = "not yet";
    this.asked = false;
    /** lights of a recording, in which nothing is stopped @type {(() => [string, string][]) | null} */
    this.recorded = null;
    this.stopButton = /** @type {HTMLButtonElement} */ (by("stop"));
    this.teams = /** @type {import("./teams.js").Teams | null} the grid: while it is shown, STOP is for all */ (null);
    this.releaseButton = held("hold to release", () => this.teams?.shown ? this.teams.ask("release_teams", "all") : this.ask("release"));
    this.releaseButton.id = "release";
    this.stopButton.before(this.releaseButton);
    this.clock = make("span", { id: "clock" });
    this.pause = button("pause", () => this.ask(this.status.clock?.paused ? "resume" : "pause"), "stop time");
    this.step = button("step", () => this.ask("step", { count: 1 }), "make one tick");
    this.pace = paces("pace of the run", ["0.1", "0.25", "0.5", "1", "2", "5", "fast"], (value) =>
      this.ask("pace", { pace: value === "fast" ? value : Number(value) }));
    by("time").append(this.clock, this.pause, this.step, this.pace);
    this.stopButton.addEventListener("click", () => this.stop());
    document.addEventListener("keydown", (event) => {
      if (this.recorded || event.code !== "Space" || event.ctrlKey || event.altKey || event.metaKey) return;
      const at = event.target;
      if (at instanceof HTMLInputElement && ["search", "text", "number"].includes(at.type)) return;
      // Space stops, also where it would press a button.
      event.preventDefault();
      if (!event.repeat) this.stop();
    });
    document.addEventListener("keyup", (event) => {
      if (!this.recorded && event.code === "Space" && !(event.target instanceof HTMLInputElement)) event.preventDefault();
    });
  }

  stop() {
    this.asked = true;
    if (this.teams?.shown) return this.teams.ask("stop_teams", "all");
    this.link().ask("stop").then((lines) => this.say(lines.join("; "), "info"), (error) => this.say(error.message));
  }

  /** @param {string} verb @param {Record<string, unknown>} [more] */
  ask(verb, more) {
    this.link().ask(verb, more).then(() => {}, (error) => this.say(error.message));
  }

  /** @param {Status} status */
  hear(status) {
    this.status = status;
    if (!status.stopped) this.asked = false;
  }

  update() {
    const { status, store } = this;
    const clock = status.clock;
    const t = store.tick ? `${store.t.toFixed(2)} s` : "";
    const pace = store.pace ? `pace ${store.pace}` : "as fast as it goes";
    write(this.clock, clock ? `${t}, tick ${store.tick}, ${clock.paused ? "paused" : pace}` : "no clock");
    write(this.pause, clock?.paused ? "go on" : "pause");
    for (const one of [this.pause, this.step, this.pace]) one.disabled = !clock || this.gone !== "";
    const stopped = Boolean(this.standing().stopped);
    this.stopButton.classList.toggle("holds", stopped);
    write(this.stopButton, this.teams?.shown ? "STOP all" : "STOP");
    this.releaseButton.hidden = !stopped;
    this.lights();
  }

  /** How many robots stand, here or in the grid that is shown, and of which that is not sure. */
  standing() {
    if (this.teams?.shown) return this.teams.standing();
    const { robots = {}, by, stopped } = this.status;
    const unsure = Object.values(/** @type {Record<string, string>} */ (robots)).filter(Boolean);
    const count = Object.keys(robots).length;
    return { holds: `STOP${by ? ` by ${by}` : ""} holds: ${count - unsure.length} of ${count} robots stand`, unsure, stopped };
  }

  lights() {
    const { status } = this, { holds, unsure, stopped } = this.standing();
    const lights = /** @type {[string, string][]} class and text */ ([]);
    if (this.gone) lights.push(["bad", "no connection"]);
    else if (this.recorded) lights.push(...this.recorded());
    else if (status.router === false) lights.push(["bad", "the router is gone"]);
    else if (!status.clock) lights.push(["quiet", "no run"]);
    else if (status.clock.held) lights.push(["bad", `held by ${status.clock.held}`]);
    else if (status.clock.paused) lights.push(["warn", "paused"]);
    else lights.push(["good", "live"]);
    if (this.asked || stopped) lights.push([unsure.length || !stopped ? "bad" : "warn", stopped ? holds : "STOP is sent"]);
    if (unsure.length) lights.push(["bad", some(unsure)]);
    const agents = /** @type {string[][]} */ (status.agents ?? []);
    if (status.late?.length && !status.clock?.paused) lights.push(["bad", `late: ${some(status.late)}`]);
    const { here } = status, remote = agents.filter(([, , host]) => here && !host.startsWith(`${here}:`)).map(([agent]) => agent);
    if (remote.length) lights.push(["quiet", `remote: ${some(remote)}`]);
    const recording = agents.filter(([, kind]) => kind === "output").map(([agent]) => agent);
    if (recording.length) lights.push(["good", `recording: ${some(recording)}`]);
    const [place, text] = [by("lights"), JSON.stringify(lights)];
    if (place.dataset.shown === text) return;
    place.dataset.shown = text;
    place.replaceChildren(...lights.map(([kind, word]) => make("span", { class: `light ${kind}` }, word)));
  }
}

/** @param {string[]} names */
function some(names) {
  return names.slice(0, 4).join(", ") + (names.length > 4 ? ` and ${names.length - 4} more` : "");
}
