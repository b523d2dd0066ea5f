// A recording in place of a run: play, pause, pace, and a bar of its time.

import { button, by, make, paces, write } from "./dom.js";

/** @typedef {import("./store.js").Store} Store @typedef {import("./link.js").Link} Link */
/** @typedef {import("./plot.js").Plots} Plots @typedef {import("./bar.js").Bar} Bar */
/** @typedef {{name: string, begin: number, end: number, dt: number, notes: string[]}} Recording s */

/** ms. Between two requests of a hand that drags the time. */
const PERIOD = 50;
/** ms. For so long the bar stands where a hand has put it, until its values have come. */
const SETTLE = 400;

export class Playback {
  /** @param {Store} store @param {Plots} plots @param {Bar} bar @param {() => Link} link @param {(sentence: string, level?: string) => void} say */
  constructor(store, plots, bar, link, say) {
    this.store = store;
    this.plots = plots;
    this.bar = bar;
    this.link = link;
    this.say = say;
    this.recording = /** @type {Recording | null} */ (null);
    this.playing = false;
    this.pace = 1;
    /** The time where a hand has put it, and when [ms]. */
    this.aim = { t: 0, at: -SETTLE };
    this.dragging = false;
    /** What the server is asked for next. @type {Record<string, unknown>} */
    this.wish = {};
    this.timer = 0;
    this.asked = "";
    this.play = button("play", () => this.toggle(), "play or pause; or the space bar");
    this.time = make("input", { type: "range", "aria-label": "time of the recording" });
    this.shown = make("span", { id: "played" });
    this.free = make("input", { type: "number", min: "0.01", max: "1000", step: "any", "aria-label": "any pace, in times of real time" });
    by("playback").append(
      this.play, button("back", () => this.step(-1), "one tick back; or the left arrow key"),
      button("step", () => this.step(1), "one tick ahead; or the right arrow key"),
      this.time, this.shown,
      paces("pace of the recording", ["0.1", "0.25", "0.5", "1", "2", "5", "10"], (value) => this.ask({ pace: Number(value) })),
      this.free,
    );
    this.listen();
  }

  listen() {
    const { time, free } = this;
    time.addEventListener("pointerdown", () => { this.dragging = true; });
    time.addEventListener("input", () => this.jump(Number(time.value)));
    for (const end of ["change", "pointerup", "pointercancel"]) {
      time.addEventListener(end, () => {
        this.dragging = false;
        this.jump(Number(time.value));
      });
    }
    free.addEventListener("change", () => {
      if (free.checkValidity() && free.value) this.ask({ pace: Number(free.value) });
      else write(this.shown, "A pace is 0.01 to 1000.");
    });
    document.addEventListener("keydown", (event) => {
      const at = event.target;
      const typing = at instanceof HTMLInputElement || at instanceof HTMLSelectElement;
      if (!this.recording || event.defaultPrevented || event.ctrlKey || event.altKey || event.metaKey) return;
      const pressing = at instanceof HTMLButtonElement || (at instanceof HTMLElement && at.tagName === "SUMMARY");
      if (event.code === "Space" && !pressing && (!typing || at === time)) {
        if (!event.repeat) this.toggle();
      } else if (!typing && event.key === "ArrowRight") this.step(1);
      else if (!typing && event.key === "ArrowLeft") this.step(-1);
      else return;
      event.preventDefault();
    });
  }

  /** Show a recording; also after a lost connection, where it was. @param {Recording} recording */
  begin(recording) {
    const again = this.recording !== null;
    this.recording = recording;
    this.bar.recorded = () => this.lights();
    document.body.classList.add("recorded");
    by("playback").hidden = false;
    const { begin, end, dt } = recording;
    Object.assign(this.time, { min: String(begin), max: String(end), step: String(dt) });
    this.asked = "";
    if (again) this.jump(this.store.t);
  }

  /** Forget what was at another time, as the messages after it. */
  rewind() {
    this.store.rewind();
    by("log").replaceChildren();
    for (const note of this.recording?.notes ?? []) this.say(note, "warning");
  }

  /** @param {{playing: boolean, pace: number}} told */
  hear(told) {
    this.playing = told.playing;
    this.pace = told.pace;
    if (document.activeElement !== this.free) this.free.value = String(told.pace);
  }

  toggle() {
    this.plots.hold(null);
    this.ask({ playing: !this.playing });
  }

  /** @param {number} ticks */
  step(ticks) {
    const { dt } = this.recording ?? { dt: 1 };
    if (this.playing) this.ask({ playing: false });
    this.jump((Math.round(this.t / dt) + ticks) * dt);
  }

  /** s. The time where it is, or where a hand has just put it. */
  get t() {
    return performance.now() - this.aim.at < SETTLE ? this.aim.t : this.store.t;
  }

  /** Show another time, earlier or later. @param {number} t s */
  jump(t) {
    const { begin, end } = this.recording ?? { begin: 0, end: 0 };
    this.aim = { t: Math.min(end, Math.max(begin, t)), at: performance.now() };
    this.plots.hold(null);
    this.ask({ t: this.aim.t, dragged: this.dragging });
  }

  /** Ask the server, but not too often. @param {Record<string, unknown>} wish */
  ask(wish) {
    Object.assign(this.wish, wish);
    if (this.timer) return;
    const send = () => {
      this.timer = 0;
      if (!Object.keys(this.wish).length) return;
      if (this.link().send({ play: this.wish })) this.wish = {};
      this.timer = window.setTimeout(send, PERIOD);
    };
    send();
  }

  update() {
    if (!this.recording || this.bar.gone) return;
    const ports = [...new Set(this.plots.series.map(({ key }) => key.split("/").slice(0, 3).join("/")))].sort();
    const wish = { ports: ports.slice(0, 64), past: this.plots.span };
    const text = JSON.stringify(wish);
    if (this.asked !== text) this.ask(wish);
    this.asked = text;
    write(this.play, this.playing ? "pause" : "play");
    const { dt, end } = this.recording;
    const { t } = this;
    const told = `${t.toFixed(2)} s of ${end.toFixed(2)} s, tick ${Math.round(t / dt)}`;
    write(this.shown, told);
    if (!this.dragging) this.time.value = String(t);
    this.time.setAttribute("aria-valuetext", told);
  }

  /** @returns {[string, string][]} class and text of lights */
  lights() {
    const { name = "", notes = [] } = this.recording ?? {};
    return [
      this.playing ? ["good", `plays, pace ${this.pace}`] : ["warn", "paused"],
      ["quiet", `recording: ${name}`],
      ...notes.map(() => /** @type {[string, string]} */ (["bad", "cut off"])),
    ];
  }
}
