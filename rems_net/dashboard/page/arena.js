// The arena from above: walls, things, robots at their poses, trails and rays.

import { Deep, RADIUS, WALL } from "./deep.js";
import { button, by, colour, fill, pen, series, stroke, text, write } from "./dom.js";
import { compare } from "./tree.js";
import { factor, multiples, nice } from "./units.js";

/** @typedef {import("./store.js").Store} Store @typedef {import("./store.js").Port} Port */
/** @typedef {[number, number]} Point @typedef {CanvasRenderingContext2D} Pen @typedef {(point: Point) => Point} At from m to pixels */
/** @typedef {{x: number, y: number, heading: number, z?: number, pitch?: number, roll?: number}} Pose m and rad */
/**
 * @typedef {object} Solid one shape, and its pose in the frame of its owner
 * @property {number[]} [box] edges, m @property {number[]} [cylinder] radius and length along z, m
 * @property {number[]} [ball] three radii, m @property {number} [mesh] number among the meshes @property {string} [name] of the mesh @property {number[]} [half] of the box around the mesh
 * @property {number[]} [at] @property {number[][]} [turn] @property {number} [link] -1: the robot itself
 */
/**
 * @typedef {object} Scene what an agent says about its place
 * @property {number} [radius] of a round wall, m @property {number} [height] of a round wall, or of a robot's origin, m
 * @property {boolean} [flat] whether the view from above shows it well
 * @property {{outline: Point[], solids?: Solid[]}[]} [walls]
 * @property {{name: string, outline: Point[], solids?: Solid[], at: number[], heading: number, pitch?: number, roll?: number, colour: number[], ghost?: boolean}[]} [things]
 * @property {Point[]} [outline] of a robot, about its origin, m @property {Solid[]} [solids] @property {import("./body.js").Link[]} [links] @property {import("./body.js").Loop[]} [loops]
 * @property {{corners: number[], faces: number[]}[]} [meshes]
 * @property {{name: string, at: number[], direction: number[], reach: number}[]} [rays]
 * @property {number[]} [place] of a robot that is bolted down @property {string} [made_of]
 * @property {string} [ghost] of a second recording: the agent of which it is the ghost
 * @property {Scene} [arena] of a robot that is alone
 */

/** s. Length of a trail, and points of it at most. */
const TRAIL = 20;
const POINTS = 600;
/** Robots of which names and trails are drawn; more would only be a blot. */
const NAMED = 60;

export class Arena {
  /** @param {Store} store */
  constructor(store) {
    this.store = store;
    this.canvas = /** @type {HTMLCanvasElement} */ (by("arena-canvas"));
    this.scenes = /** @type {Record<string, Scene>} */ ({});
    /** pixels per metre, and the point in the middle; null: everything fits */
    this.view = /** @type {{scale: number, x: number, y: number} | null} */ (null);
    this.now = { scale: 100, x: 0, y: 0 };
    this.trails = true;
    this.rays = true;
    this.deep = new Deep();
    /** whether it is drawn in 3-D; null: if something is not flat */
    this.wanted = /** @type {boolean | null} */ (null);
    this.isDeep = false;
    this.listen();
  }

  listen() {
    const { canvas } = this;
    const tools = by("arena-tools");
    this.solid = button("3-D", () => { this.wanted = !this.isDeep; }, "show the bodies' own shapes");
    tools.append(this.solid, button("fit", () => this.fit(), "show everything"));
    for (const what of /** @type {const} */ (["trails", "rays"])) {
      const toggle = button(what, () => {
        this[what] = !this[what];
        toggle.setAttribute("aria-pressed", String(this[what]));
      });
      toggle.setAttribute("aria-pressed", "true");
      tools.append(toggle);
    }
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.zoom(Math.exp(-event.deltaY / 500), event.offsetX, event.offsetY);
    }, { passive: false });
    /** @type {Map<number, Point>} */
    const down = new Map();
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      down.set(event.pointerId, [event.offsetX, event.offsetY]);
    });
    canvas.addEventListener("pointermove", (event) => {
      const last = down.get(event.pointerId);
      if (!last) return;
      const here = /** @type {Point} */ ([event.offsetX, event.offsetY]);
      const other = [...down].find(([id]) => id !== event.pointerId)?.[1];
      if (other) {
        const ratio = Math.hypot(here[0] - other[0], here[1] - other[1]) / (Math.hypot(last[0] - other[0], last[1] - other[1]) || 1);
        this.zoom(ratio, other[0], other[1]);
      } else this.move(here[0] - last[0], here[1] - last[1], !event.shiftKey);
      down.set(event.pointerId, here);
    });
    for (const end of /** @type {const} */ (["pointerup", "pointercancel"])) {
      canvas.addEventListener(end, (event) => down.delete(event.pointerId));
    }
    canvas.addEventListener("dblclick", () => this.fit());
    canvas.addEventListener("keydown", (event) => {
      const step = 40;
      const moves = /** @type {Record<string, Point>} */ ({ ArrowLeft: [step, 0], ArrowRight: [-step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] });
      if (event.key in moves) this.move(...moves[event.key], !event.shiftKey);
      else if (event.key === "+") this.zoom(1.25);
      else if (event.key === "-") this.zoom(0.8);
      else if (event.key === "0") this.fit();
      else return;
      event.preventDefault();
    });
  }

  /** Show everything. */
  fit() {
    this.view = null;
    this.deep.fit();
  }

  /** @param {number} ratio @param {number} [px] @param {number} [py] the spot that stays */
  zoom(ratio, px = this.canvas.clientWidth / 2, py = this.canvas.clientHeight / 2) {
    if (this.isDeep) return this.deep.zoom(ratio);
    const old = this.now;
    const scale = Math.min(1e5, Math.max(0.1, old.scale * ratio));
    const dx = px - this.canvas.clientWidth / 2;
    const dy = py - this.canvas.clientHeight / 2;
    this.view = this.now = { scale, x: old.x + dx / old.scale - dx / scale, y: old.y - dy / old.scale + dy / scale };
  }

  /** @param {number} dx @param {number} dy pixels @param {boolean} turning in 3-D: turn, not move */
  move(dx, dy, turning) {
    if (this.isDeep) return turning ? this.deep.turn(dx, dy) : this.deep.move(dx, dy, this.canvas.clientHeight);
    const old = this.now;
    this.view = this.now = { ...old, x: old.x - dx / old.scale, y: old.y + dy / old.scale };
  }

  /** The robots that have a place, by name. @returns {{port: Port, pose: Pose, scene: Scene}[]} */
  robots() {
    const found = [];
    for (const port of this.store.ports.values()) {
      if (port.kind !== "robot" || port.name !== "state") continue;
      const scene = this.scenes[port.agent] ?? {};
      const pose = poseOf(port, scene);
      if (pose) found.push({ port, pose, scene });
    }
    return found.sort((a, b) => compare(a.port.agent, b.port.agent));
  }

  draw() {
    const got = pen(this.canvas);
    if (!got) return;
    const { pen: on, width, height } = got;
    const robots = this.robots();
    const places = [...Object.values(this.scenes), ...robots.map((one) => one.scene.arena ?? {})];
    const walls = places.flatMap((one) => one.walls ?? []);
    const rings = new Map(places.filter((one) => one.radius).map((one) => [one.radius ?? 0, one.height ?? 0.1]));
    const things = this.things();
    this.choose(places);
    if (this.isDeep) return this.drawDeep(on, width, height, { robots, things, walls: unique(walls), rings });
    this.now = this.view ?? fit([
      ...walls.flatMap((one) => one.outline),
      ...[...rings.keys()].flatMap((r) => /** @type {Point[]} */ ([[-r, -r], [r, r]])),
      ...things.flatMap((one) => one.outline.map((corner) => place(corner, one.pose))),
      ...robots.flatMap(({ pose, scene }) => (scene.outline?.length ? scene.outline : [[RADIUS, RADIUS], [-RADIUS, -RADIUS]])
        .map((corner) => place(/** @type {Point} */ (corner), pose))),
    ], width, height, this.now);
    const { scale, x, y } = this.now;
    /** @type {At} */
    const at = ([px, py]) => [width / 2 + (px - x) * scale, height / 2 - (py - y) * scale];
    this.grid(on, width, height, at);
    for (const wall of unique(walls)) fill(on, wall.outline.map(at), colour("--wall"));
    Object.assign(on, { strokeStyle: colour("--wall"), lineWidth: WALL * scale });
    for (const radius of rings.keys()) {
      on.beginPath();
      on.arc(...at([0, 0]), (radius + WALL / 2) * scale, 0, 2 * Math.PI);
      on.stroke();
    }
    for (const thing of things) {
      fill(on, thing.outline.map((corner) => at(place(corner, thing.pose))), rgb(thing.colour), thing.ghost ? 0.35 : 1);
      const named = thing.ghost && robots.some(({ port }) => port.agent === `robot/${thing.name}`);
      if (scale > 60 && !named) label(on, thing.name, at([thing.pose.x, thing.pose.y]));
    }
    const few = robots.length <= NAMED;
    const ghosts = this.ghosts(robots);
    robots.forEach((robot, i) => {
      const of = robots.findIndex(({ port }) => port.agent === robot.scene.ghost);
      const ink = series(of < 0 ? i : of);
      if (few && this.trails) stroke(on, [trailOf(robot.port).map(at)], ink, { wide: 1.5, solid: 0.5 });
      if (few && this.rays) this.beams(on, robot, ink, at);
      this.robot(on, robot, ink, ghosts.has(robot.port.agent), at);
    });
    for (const { port, pose } of few ? robots : []) {
      const [px, py] = at([pose.x, pose.y]);
      label(on, port.agent.split("/")[1], [px, py - 14]);
    }
    if (!robots.length && !walls.length && !rings.size) {
      label(on, "No robot here has a place on the floor.", [width / 2, height / 2], "--quiet");
    }
    this.describe("from above", robots);
  }

  /** Draw in 3-D if that is wanted, and this browser can. @param {Scene[]} places */
  choose(places) {
    const wanted = this.wanted ?? places.some((one) => one.flat === false);
    const able = !wanted || this.deep.open(this.scenes);
    this.isDeep = wanted && able;
    this.deep.canvas.canvas.hidden = !this.isDeep;
    write(by("arena-note"), able ? "" : "This browser has no WebGL2, so the arena is shown from above.");
    this.solid?.setAttribute("aria-pressed", String(this.isDeep));
  }

  /** @param {CanvasRenderingContext2D} on @param {number} width @param {number} height @param {Omit<import("./deep.js").What, "ghosts" | "trails" | "rays">} what */
  drawDeep(on, width, height, what) {
    const [robots, few] = [what.robots, what.robots.length <= NAMED];
    this.deep.draw(width, height, {
      ...what, ghosts: this.ghosts(robots),
      trails: few && this.trails ? robots.map((one) => trailOf(one.port)) : [],
      rays: (robot) => (few && this.rays ? this.seen(robot) : []),
    });
    for (const { port, pose } of few ? robots : []) {
      const at = this.deep.project([pose.x, pose.y, pose.z ?? 0], width, height);
      if (at) label(on, port.agent.split("/")[1], [at[0], at[1] + 16]);
    }
    this.describe("in 3-D", robots);
  }

  /** Say what the picture shows. @param {string} how @param {{port: Port, pose: Pose}[]} robots */
  describe(how, robots) {
    const names = robots.slice(0, 20).map(({ port, pose }) => `${port.agent} at ${pose.x.toFixed(2)} m, ${pose.y.toFixed(2)} m`);
    const said = `The arena ${how}. ${names.join("; ")}`;
    if (performance.now() - this.told > 2000 && said !== this.canvas.getAttribute("aria-label")) {
      this.told = performance.now();
      this.canvas.setAttribute("aria-label", said);
    }
  }

  told = -1e9;

  /** Things with their poses of now; ghosts if they are there. */
  things() {
    return Object.entries(this.scenes).flatMap(([world, scene]) => (scene.things ?? []).flatMap((thing) => {
      const port = this.store.ports.get(`${world}/${thing.name}`);
      const pose = port && poseOf(port, {}, "pose/");
      const { at: [x, y, z], heading, pitch, roll } = thing;
      const gone = thing.ghost && !port?.values.get("there");
      return gone ? [] : [{ ...thing, solids: thing.solids ?? [], pose: pose ?? { x, y, z, heading, pitch, roll } }];
    }));
  }

  /** Robots that are the same as another one, done otherwise: drawn as outlines. @param {{port: Port, scene: Scene}[]} robots */
  ghosts(robots) {
    const first = new Set();
    const found = new Set(robots.filter(({ scene }) => scene.ghost).map(({ port }) => port.agent));
    // Robots of one world meet each other, so none is a ghost.
    if (robots.some(({ scene }) => !scene.arena)) return found;
    for (const { port, scene } of robots) {
      if (!scene.made_of) continue;
      if (first.has(scene.made_of)) found.add(port.agent);
      first.add(scene.made_of);
    }
    return found;
  }

  /** @param {Pen} on @param {{pose: Pose, scene: Scene}} robot @param {string} ink @param {boolean} ghost @param {At} at */
  robot(on, { pose, scene }, ink, ghost, at) {
    const outline = scene.outline?.length ? scene.outline : arrow(RADIUS);
    const corners = outline.map((corner) => at(place(corner, pose)));
    fill(on, corners, ink, ghost ? 0.15 : 0.55);
    stroke(on, [[...corners, corners[0]]], ink, { wide: 2, dash: ghost ? [5, 3] : [] });
    const ahead = Math.max(...outline.map((corner) => corner[0]), 0.01);
    const from = at([pose.x, pose.y]);
    const to = at(place([ahead, 0], pose));
    const long = Math.hypot(to[0] - from[0], to[1] - from[1]) || 1;
    const least = Math.max(1, 8 / long);
    stroke(on, [[from, [from[0] + (to[0] - from[0]) * least, from[1] + (to[1] - from[1]) * least]]], ink, { wide: 2 });
  }

  /** @param {Pen} on @param {{port: Port, pose: Pose, scene: Scene}} robot @param {string} ink @param {At} at */
  beams(on, robot, ink, at) {
    for (const { ray, far } of this.seen(robot)) {
      const [x, y] = ray.at;
      const [dx, dy] = ray.direction;
      const [begin, end] = [at(place([x, y], robot.pose)), at(place([x + dx * far, y + dy * far], robot.pose))];
      stroke(on, [[begin, end]], ink, { solid: 0.6, dash: far < ray.reach ? [] : [2, 4] });
      if (far < ray.reach) on.strokeRect(end[0] - 1.5, end[1] - 1.5, 3, 3);
    }
  }

  /** What a robot's distance sensors measure now, m. @param {{port: Port, scene: Scene}} robot */
  seen({ port, scene }) {
    const sensors = this.store.ports.get(`${port.agent}/sensors`);
    return (scene.rays ?? []).map((ray) => ({ ray, far: sensors?.as(ray.name, "m") ?? NaN })).filter(({ far }) => Number.isFinite(far));
  }

  /** @param {Pen} on @param {number} width @param {number} height @param {At} at */
  grid(on, width, height, at) {
    const { scale, x, y } = this.now;
    const step = nice(70 / scale);
    const [wide, high] = [width / 2 / scale, height / 2 / scale];
    const columns = multiples(step, x - wide, x + wide).map((v) => [at([v, y - high]), at([v, y + high])]);
    const rows = multiples(step, y - high, y + high).map((v) => [at([x - wide, v]), at([x + wide, v])]);
    stroke(on, [...columns, ...rows], colour("--grid"));
    stroke(on, [[[12, height - 12], [12 + step * scale, height - 12]]], colour("--quiet"), { wide: 2 });
    text(on, step < 1 ? `${Number((step * 100).toPrecision(3))} cm` : `${step} m`, [14, height - 17], colour("--quiet"), "left");
  }
}

/** @param {Port} port @param {Scene} scene @param {string} [prefix] @returns {Pose | null} */
export function poseOf(port, scene, prefix = "") {
  const of = (/** @type {string} */ path, /** @type {string} */ unit, /** @type {number | undefined} */ other) =>
    [port.as(prefix + path, unit), other].find(Number.isFinite);
  const x = of("x", "m", scene.place?.[0]);
  const y = of("y", "m", scene.place?.[1]);
  if (x === undefined || y === undefined) return null;
  const [z, pitch, roll] = [of("z", "m", undefined), of("pitch", "rad", undefined), of("roll", "rad", undefined)];
  return { x, y, z, pitch, roll, heading: of("heading", "rad", scene.place?.[2]) ?? 0 };
}

/** Where a robot has been, m. @param {Port} port @returns {Point[]} */
function trailOf(port) {
  const [xs, ys] = [port.history.get("x"), port.history.get("y")];
  if (!xs || !ys || xs.count !== ys.count) return [];
  const [begin, found] = [xs.find(port.t - TRAIL), /** @type {Point[]} */ ([])];
  const step = Math.max(1, Math.ceil((xs.count - begin) / POINTS));
  const [toX, toY] = [factor(port.row("x")?.unit ?? "m", "m"), factor(port.row("y")?.unit ?? "m", "m")];
  for (let i = begin; i < xs.count; i += step) found.push([xs.values[i] * toX, ys.values[i] * toY]);
  return found;
}

/** @param {Point} corner @param {Pose} pose @returns {Point} */
export function place([x, y], pose) {
  const [c, s] = [Math.cos(pose.heading), Math.sin(pose.heading)];
  return [pose.x + c * x - s * y, pose.y + s * x + c * y];
}

/** @param {number} r @returns {Point[]} */
function arrow(r) {
  return [[r, 0], [-r * 0.7, r * 0.7], [-r * 0.4, 0], [-r * 0.7, -r * 0.7]];
}

/** The view of all points. @param {Point[]} points @param {number} width @param {number} height @param {{scale: number, x: number, y: number}} old */
function fit(points, width, height, old) {
  let [left, right, low, high] = [Infinity, -Infinity, Infinity, -Infinity];
  for (const [x, y] of points.filter((one) => one.every(Number.isFinite))) {
    [left, right] = [Math.min(left, x), Math.max(right, x)];
    [low, high] = [Math.min(low, y), Math.max(high, y)];
  }
  if (left > right) return { scale: 100, x: 0, y: 0 };
  const margin = 40;
  const scale = Math.min((width - 2 * margin) / Math.max(right - left, 0.2), (height - 2 * margin) / Math.max(high - low, 0.2));
  const wanted = { scale: Math.max(0.1, scale), x: (left + right) / 2, y: (low + high) / 2 };
  // Robots that drive away would let the picture shake: it follows with slack.
  const fits = Math.abs(wanted.scale / old.scale - 1) < 0.15
    && Math.abs(wanted.x - old.x) * old.scale < 20 && Math.abs(wanted.y - old.y) * old.scale < 20;
  return fits && wanted.scale >= old.scale * 0.95 ? old : wanted;
}

/** Robots of one arena each say its walls. @param {{outline: Point[], solids?: Solid[]}[]} walls */
function unique(walls) {
  return [...new Map(walls.map((wall) => [JSON.stringify(wall), wall])).values()];
}

/** A text with a halo. @param {Pen} on @param {string} words @param {Point} at @param {string} [ink] */
function label(on, words, at, ink = "--ink") {
  text(on, words, at, colour(ink), "center", colour("--paper"));
}

/** @param {number[]} parts 0 to 1 */
function rgb(parts) {
  return `rgb(${parts.map((one) => Math.round(255 * Number(one))).join(" ")})`;
}

