// Driving: keys, a stick under a finger, or a gamepad; the server makes commands of them.

import { button, by, make, select, write } from "./dom.js";

/** @typedef {import("./link.js").Link} Link */
/** @typedef {{ahead: number, left: number, turn: number}} Stick percent of full speed */
/** @typedef {{drives: boolean, taken: boolean, other?: string}} Driven */

/** ms. A hand that holds its stick reports it so often. */
const PERIOD = 50;
/** ms. Messages of a moving finger are at least so far apart: the server takes 60 a second. */
const APART = 25;
/** ms. Without a beat of the server for so long the picture is frozen. */
const FROZEN = 500;
/** Share of a gamepad's stick that counts as the middle. */
const DEAD = 0.15;
/** Code of a key -> its name, which the server knows. */
const KEYS = new Map([
  ["ArrowUp", "up"], ["ArrowDown", "down"], ["ArrowLeft", "left"], ["ArrowRight", "right"],
  ["KeyW", "w"], ["KeyA", "a"], ["KeyS", "s"], ["KeyD", "d"], ["KeyQ", "q"], ["KeyE", "e"],
  ["ShiftLeft", "shift"], ["ShiftRight", "shift"],
]);
/** Value of the choice that means every robot. */
const ALL = "robot/*";
const HOW = "Arrow keys or w a s d; q and e go sideways, shift is slower. Space is STOP.";
/** ms. A hand that moves robots and gives no sign for so long is at rest: it may be out of reach. */
const SILENT = 1000;
/** Gamepads, and what is wrong with them. */
const TWO = "Two gamepads are moved, so robots stand: let go of one.";
const GONE = "The gamepad was pulled out: robots stand.";
const MUTE = "The gamepad has sent nothing for 1 s: it may be out of range, so robots stand. Let its stick go once.";
const STUCK = "The key that was held down repeats no more, so robots stand. Let it go, and press it again.";

export class Drive {
  /** @param {() => Link} link @param {(sentence: string, level?: string) => void} say */
  constructor(link, say) {
    this.link = link;
    this.say = say;
    /** Agents that this page wants to drive. @type {string[]} */
    this.agents = [];
    this.driving = /** @type {Record<string, Driven>} */ ({});
    this.held = /** @type {Set<string>} */ (new Set());
    /** ms. Time at which the newest key was repeated last; keys before the newest one do not repeat. */
    this.repeated = Infinity;
    /** The stick under a finger. @type {Stick | null} */
    this.finger = null;
    this.beat = 0;
    /** ms. Time at which the newest beat came. */
    this.beaten = 0;
    this.resting = true;
    /** ms. Time of the last message. */
    this.sent = 0;
    /** Whether a gamepad counts only after its sticks were in the middle. */
    this.locked = true;
    /** Whether it is locked since it was moved and sent nothing. */
    this.mute = false;
    /** What the gamepads sent last, and when it changed, ms. */
    this.sign = { text: "", at: 0 };
    /** What is wrong with the gamepads; "" if nothing is. */
    this.trouble = "";
    this.shown = "";
    this.choice = select("robot to drive", [], () => {});
    this.button = button("drive", () => this.toggle(), "drive by arrow keys, or by the stick");
    by("drive-tools").append(this.choice, this.button);
    this.pad = by("pad");
    this.knob = by("knob");
    this.listen();
    setInterval(() => this.work(), PERIOD);
  }

  listen() {
    document.addEventListener("keydown", (event) => this.key(event, true));
    document.addEventListener("keyup", (event) => this.key(event, false));
    for (const name of ["blur", "pagehide"]) window.addEventListener(name, () => this.rest());
    document.addEventListener("visibilitychange", () => { if (document.hidden) this.rest(); });
    window.addEventListener("gamepaddisconnected", () => { if (this.agents.length) this.say(GONE, "warning"); });
    this.pad.addEventListener("pointerdown", (event) => {
      this.pad.setPointerCapture(event.pointerId);
      this.touch(event);
      this.send();
    });
    this.pad.addEventListener("pointermove", (event) => {
      if (!this.finger) return;
      this.touch(event);
      if (performance.now() >= this.sent + APART) this.send();
    });
    for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) {
      this.pad.addEventListener(name, () => {
        this.finger = null;
        this.send();
      });
    }
  }

  /** @param {KeyboardEvent} event @param {boolean} down */
  key(event, down) {
    this.repeated = event.repeat ? performance.now() : Infinity;
    const name = KEYS.get(event.code);
    const at = event.target;
    const typing = at instanceof HTMLInputElement || at instanceof HTMLSelectElement;
    if (!name || !this.agents.length || event.ctrlKey || event.altKey || event.metaKey || (typing && down)) return;
    event.preventDefault();
    if (event.repeat || this.held.has(name) === down) return;
    if (down) this.held.add(name);
    else this.held.delete(name);
    this.send();
  }

  /** @param {PointerEvent} event */
  touch(event) {
    const place = this.pad.getBoundingClientRect();
    const half = place.width / 2;
    const x = limited((event.clientX - place.x - half) / half);
    const y = limited((event.clientY - place.y - half) / half);
    this.finger = { ahead: percent(-y), left: 0, turn: percent(-x) };
  }

  /** The stick of the gamepad that is moved; null if none is, or none counts. @returns {Stick | null} */
  gamepad() {
    this.trouble = "";
    // Browsers report old positions to a page that is hidden or has no focus.
    if (document.hidden || !document.hasFocus()) this.locked = true;
    const pads = window.isSecureContext && navigator.getGamepads ? navigator.getGamepads() : [];
    const moved = [];
    let sign = "";
    for (const one of pads) {
      if (!one) continue;
      sign += JSON.stringify([one.timestamp, one.axes, one.buttons?.map((button) => button.value)]);
      const axes = [0, 1, 2].map((axis) => percent(-dead(one.axes[axis] ?? 0)));
      if (!axes.some((axis) => axis)) continue;
      if (one.mapping === "standard") moved.push({ ahead: axes[1], left: axes[2], turn: axes[0] });
      else this.trouble = `The browser does not know the axes of ${one.id}; use another gamepad, or keys.`;
    }
    if (sign !== this.sign.text) this.sign = { text: sign, at: performance.now() };
    if (!moved.length) this.locked = this.mute = false;
    else if (!this.locked && performance.now() > this.sign.at + SILENT) this.locked = this.mute = true;
    if (this.mute) this.trouble = MUTE;
    if (moved.length > 1) this.trouble = TWO;
    return moved.length === 1 && !this.locked ? moved[0] : null;
  }

  /** Whether the picture is new enough to drive by. */
  get fresh() {
    return performance.now() - this.beaten < FROZEN;
  }

  work() {
    if (!this.agents.length) return;
    if (this.held.size && performance.now() > this.repeated + SILENT) {
      this.rest();
      this.say(STUCK, "warning");
    }
    const pad = this.gamepad();
    const moves = pad || this.finger || this.held.size;
    if (moves ? performance.now() >= this.sent + APART : !this.resting) this.send(pad);
    this.show();
  }

  /** Report what the hand does now. @param {Stick | null} [pad] */
  send(pad = null) {
    if (!this.agents.length || !this.beat) return;
    const stick = this.finger ?? pad;
    const held = [...this.held];
    this.resting = !stick && !held.length;
    const shown = stick ?? { turn: 0, ahead: 0 };
    this.knob.style.translate = `${-shown.turn * 0.4}% ${-shown.ahead * 0.4}%`;
    if (!this.fresh && !this.resting) return;
    this.sent = performance.now();
    this.link().send({ hand: stick ? { stick, held } : { held }, beat: this.beat });
  }

  /** Let go of everything. */
  rest() {
    this.held.clear();
    this.finger = null;
    this.locked = true;
    if (!this.resting) this.send();
  }

  toggle() {
    const chosen = this.choice.value;
    const every = [...this.choice.options].map((one) => one.value);
    const robots = every.filter((one) => one.startsWith("robot/") && one !== ALL);
    this.drive(this.agents.length ? [] : chosen === ALL ? robots : [chosen]);
    this.button.blur();
  }

  /** Drive these agents; none lets go. @param {string[]} agents */
  drive(agents) {
    this.rest();
    this.agents = agents;
    this.driving = {};
    this.show();
    this.link().ask("drive", { agents }).catch((error) => {
      this.agents = [];
      this.show();
      this.say(error.message);
    });
  }

  /** Forget all: the connection is lost, and the server lets go by itself. */
  lose() {
    this.agents = [];
    this.beat = 0;
    this.rest();
    this.show();
  }

  /** @param {Record<string, any>} status */
  attend(status) {
    const rows = /** @type {string[][]} */ (status.agents ?? []);
    const drivers = status.drivers ?? {};
    const names = rows.filter(([, kind]) => kind === "robot" || kind === "input").map(([agent]) => agent);
    names.sort((a, b) => b[0].localeCompare(a[0]) || a.localeCompare(b, undefined, { numeric: true }));
    const options = names.map((name) => [name, drivers[name] ? `${name} (${drivers[name]})` : name]);
    if (names.filter((name) => name.startsWith("robot/")).length > 1) options.push([ALL, "all robots"]);
    const text = JSON.stringify(options);
    if (text === this.shown) return;
    this.shown = text;
    const before = this.choice.value;
    this.choice.replaceChildren(...options.map(([value, label]) => make("option", { value }, label)));
    if (options.some(([value]) => value === before)) this.choice.value = before;
    this.show();
  }

  /** @param {{number: number, driving: Record<string, Driven>}} beat */
  hear(beat) {
    this.beat = beat.number;
    this.beaten = performance.now();
    this.driving = beat.driving;
    const taken = Object.keys(beat.driving).filter((agent) => beat.driving[agent].taken);
    for (const agent of taken) this.say(`${agent} was taken by ${beat.driving[agent].other}`, "warning");
    if (taken.length) this.drive(this.agents.filter((agent) => !taken.includes(agent)));
  }

  show() {
    const on = this.agents.length > 0;
    write(this.button, on ? "let go" : "drive");
    this.button.disabled = !on && !this.choice.options.length;
    this.choice.disabled = on;
    this.pad.hidden = !on;
    const frozen = on && this.beat > 0 && !this.fresh;
    const bad = frozen ? "The picture is frozen: driving is locked, and robots stand." : on ? this.trouble : "";
    const place = by("driving");
    place.classList.toggle("bad", bad !== "");
    write(place, bad || (on ? this.others() : ""));
  }

  /** Who else drives, or wants to; else how to drive. */
  others() {
    for (const [agent, one] of Object.entries(this.driving)) {
      if (!one.drives && !one.taken) return `${one.other ?? "Nobody"} drives ${agent}; you get it in 5 s.`;
      if (one.other) return `${one.other} asks for ${agent}, and gets it in 5 s.`;
    }
    return HOW;
  }
}

/** @param {number} value */
function limited(value) {
  return Math.max(-1, Math.min(1, value));
}

/** @param {number} value from -1 to 1 */
function percent(value) {
  return Math.round(value * 1000) / 10;
}

/** A value without the dead middle of its stick. @param {number} value */
function dead(value) {
  if (!Number.isFinite(value)) return 0;
  return Math.sign(value) * Math.max(0, Math.abs(value) - DEAD) / (1 - DEAD);
}
