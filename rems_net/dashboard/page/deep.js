// The arena in three dimensions: the bodies' own shapes, turned by mouse, touch and keys.

import { linksOf, point, posed, times, upright } from "./body.js";
import { by, colour, series } from "./dom.js";
import { nice } from "./units.js";
import { Canvas3 } from "./webgl.js";

/** @typedef {import("./arena.js").Scene} Scene @typedef {import("./arena.js").Pose} Pose @typedef {import("./arena.js").Solid} Solid */
/** @typedef {import("./store.js").Port} Port @typedef {import("./body.js").Matrix} Matrix @typedef {import("./webgl.js").Ink} Ink */
/** @typedef {{port: Port, pose: Pose, scene: Scene}} Robot */
/** @typedef {{solids: Solid[], colour: number[], pose: Pose, ghost?: boolean}} Thing @typedef {{ray: {at: number[], direction: number[]}, far: number}} Beam */
/** @typedef {{robots: Robot[], things: Thing[], walls: {solids?: Solid[]}[], rings: Map<number, number>, ghosts: Set<string>, trails: [number, number][][], rays: (robot: Robot) => Beam[]}} What */

/** Pieces of a round wall, and its thickness, m. */
export const [PIECES, WALL] = [64, 0.01];
/** m. Radius of a robot whose shape is not known. */
export const RADIUS = 0.05;
/** rad. Half of the angle that is seen, up and down. */
const HALF = 0.35;
/** rad. From where the arena is seen at first. */
const VIEW = { yaw: -1.2, pitch: 0.6 };

export class Deep {
  constructor() {
    this.canvas = new Canvas3(/** @type {HTMLCanvasElement} */ (by("arena-solid")));
    this.view = { ...VIEW };
    /** the place that is looked at, and its distance, m; null: everything fits */
    this.look = /** @type {{at: number[], far: number} | null} */ (null);
    this.now = { at: [0, 0, 0], far: 1 };
    this.see = posed();
    // corners of the box around all
    this.low = this.high = [0, 0, 0];
    /** positions of joints that nothing measures, by robot @type {Map<string, number[]>} */
    this.bent = new Map();
    this.known = /** @type {Record<string, Scene> | null} */ (null);
  }

  fit() {
    this.look = null;
    this.view = { ...VIEW };
  }

  /** @param {number} dx @param {number} dy pixels */
  turn(dx, dy) {
    this.view.yaw -= dx / 150;
    this.view.pitch = Math.min(1.57, Math.max(-0.2, this.view.pitch + dy / 150));
  }

  zoom(/** @type {number} */ ratio) {
    this.look = this.now = { ...this.now, far: Math.min(1e4, Math.max(0.02, this.now.far / ratio)) };
  }

  /** Move what is looked at. @param {number} dx @param {number} dy pixels @param {number} height of the canvas */
  move(dx, dy, height) {
    const { at, far } = this.now;
    const step = 2 * far * Math.tan(HALF) / height;
    const [s, c] = [Math.sin(this.view.yaw), Math.cos(this.view.yaw)];
    const up = dy * step / Math.max(0.3, Math.sin(this.view.pitch));
    this.look = this.now = { far, at: [at[0] + s * dx * step - c * up, at[1] - c * dx * step - s * up, at[2]] };
  }

  /** @param {number} width @param {number} height @param {What} what */
  draw(width, height, what) {
    this.low = [Infinity, Infinity, Infinity];
    this.high = this.low.map((v) => -v);
    const wall = ink(colour("--wall"), 0.55);
    for (const one of what.walls) this.solids(one.solids ?? [], posed(), wall);
    for (const [radius, tall] of what.rings) this.ring(radius, tall, wall);
    for (const { solids, pose, colour, ghost } of what.things) this.solids(solids, framed(pose, 0), [...colour, ghost ? 0.35 : 1]);
    what.robots.forEach((robot, i) => {
      const ghost = what.ghosts.has(robot.port.agent);
      const frame = this.robot(robot, ink(series(i), ghost ? 0.3 : 1), what.things);
      for (const { ray, far } of what.rays(robot)) {
        const end = ray.at.map((v, k) => v + far * ray.direction[k]);
        this.canvas.line([...point(frame, ray.at), ...point(frame, end)], ink(series(i), 0.6));
      }
    });
    what.trails.forEach((trail, i) => this.canvas.line(trail.flatMap(([x, y]) => [x, y, 0.002]), ink(series(i), 0.7)));
    this.camera(width, height);
    this.grid();
    // The light comes from above, and from the left of the camera.
    this.canvas.draw(this.see, [0.47 * Math.cos(this.view.yaw - 0.6), 0.47 * Math.sin(this.view.yaw - 0.6), 0.88]);
  }

  /** Get ready, with the meshes of new scenes. @param {Record<string, Scene>} scenes @returns {boolean} whether this browser can */
  open(scenes) {
    if (scenes === this.known && this.canvas.gl) return true;
    if (!this.canvas.open()) return false;
    this.known = scenes;
    this.bent.clear();
    for (const [agent, { meshes, solids = [], walls = [], things = [] }] of Object.entries(scenes)) {
      meshes?.forEach(({ corners, faces }, n) => this.canvas.add(`${agent} ${n}`, corners, faces));
      for (const one of [...walls, ...things].flatMap((some) => some.solids ?? []).concat(solids)) {
        if (one.mesh !== undefined) one.name = `${agent} ${one.mesh}`;
      }
    }
    return true;
  }

  /** @param {Solid[]} solids @param {Matrix} frame @param {Ink} ink @param {Matrix[]} [links] */
  solids(solids, frame, ink, links = []) {
    for (const one of solids) {
      const link = one.link ?? -1;
      const on = link >= 0 && links[link] ? times(frame, links[link]) : frame;
      const pose = one.at || one.turn ? times(on, posed(one.at, one.turn)) : on;
      const dark = link >= 0 && link % 2 === 0 ? [...ink.slice(0, 3).map((v) => v * 0.7), ink[3]] : ink;
      if (one.box) this.put("box", pose, one.box, dark);
      else if (one.cylinder) this.put("cylinder", pose, [2 * one.cylinder[0], 2 * one.cylinder[0], one.cylinder[1]], dark);
      else if (one.ball) this.put("ball", pose, one.ball.map((v) => 2 * v), dark);
      else if (one.name && one.half) this.put(one.name, pose, [1, 1, 1], dark, one.half);
    }
  }

  /** @param {string} name @param {Matrix} pose @param {number[]} size @param {Ink} ink @param {number[]} [half] of the box around it */
  put(name, pose, size, ink, half = size.map((v) => v / 2)) {
    this.canvas.solid(name, pose, size, ink);
    for (let k = 0; k < 3; k++) {
      const reach = Math.abs(pose[k]) * half[0] + Math.abs(pose[k + 4]) * half[1] + Math.abs(pose[k + 8]) * half[2];
      this.low[k] = Math.min(this.low[k], pose[12 + k] - reach);
      this.high[k] = Math.max(this.high[k], pose[12 + k] + reach);
    }
  }

  /** A round wall. @param {number} radius @param {number} tall @param {Ink} ink */
  ring(radius, tall, ink) {
    const size = [WALL, 2 * (radius + WALL) * Math.tan(Math.PI / PIECES), tall];
    for (let turn = 0; turn < 6.28; turn += 2 * Math.PI / PIECES) {
      this.put("box", times(upright([0, 0, 0], turn), posed([radius + WALL / 2, 0, tall / 2])), size, ink);
    }
  }

  /** @param {Robot} robot @param {Ink} ink @param {Thing[]} things @returns {Matrix} of the robot's frame */
  robot({ port, pose, scene }, ink, things) {
    const up = scene.height ?? 0;
    const frame = pose.z !== undefined || scene.place
      ? framed(pose, up)
      : times(standing(pose, things), posed([0, 0, up]));
    if (!scene.solids?.length) {
      this.put("cylinder", times(frame, posed([0, 0, RADIUS / 2])), [2 * RADIUS, 2 * RADIUS, RADIUS], ink);
    }
    const bent = this.bent.get(port.agent) ?? [];
    this.bent.set(port.agent, bent);
    const links = linksOf(scene.links ?? [], scene.loops ?? [], (link) =>
      [port.as(link.field, link.slides ? "m" : "rad")].find(Number.isFinite) ?? 0, bent);
    this.solids(scene.solids ?? [], frame, ink, links);
    const ahead = Math.max(RADIUS, ...(scene.outline ?? []).map((corner) => corner[0])) * 1.5;
    if (!scene.place) this.canvas.line([...point(frame, [0, 0, 0.002 - up]), ...point(frame, [ahead, 0, 0.002 - up])], ink);
    return frame;
  }

  /** Lines on the floor. */
  grid() {
    const reach = Math.max(0.3, ...[0, 1].flatMap((k) => [this.high[k], -this.low[k]]).filter(Number.isFinite)) * 1.2;
    const step = nice(reach / 8);
    const end = Math.ceil(reach / step) * step;
    for (let at = -end; at < end + step / 2; at += step) {
      this.canvas.line([at, -end, 0, at, end, 0], ink(colour("--line"), 1));
      this.canvas.line([-end, at, 0, end, at, 0], ink(colour("--line"), 1));
    }
  }

  /** @param {number} width @param {number} height */
  camera(width, height) {
    const [[s, c], [up, flat]] = [this.view.yaw, this.view.pitch].map((v) => [Math.sin(v), Math.cos(v)]);
    const turned = [[-s, c, 0], [-c * up, -s * up, flat], [c * flat, s * flat, up]];
    if (!this.look && Number.isFinite(this.low[0])) this.follow(turned, Math.tan(HALF), width / height);
    const { at, far } = this.now;
    const seen = turned.map((axis) => -axis.reduce((sum, v, k) => sum + v * at[k], 0));
    seen[2] -= far;
    const view = [0, 1, 2].flatMap((k) => [...turned.map((axis) => axis[k]), 0]).concat(seen, 1);
    const [near, end, f] = [far / 50, far * 50, 1 / Math.tan(HALF)];
    const lens = [f * height / width, 0, 0, 0, 0, f, 0, 0, 0, 0, (end + near) / (near - end), -1, 0, 0, 2 * end * near / (near - end), 0];
    this.see = times(lens, view);
  }

  /** Look at everything, from where all of it is seen. @param {number[][]} axes of the camera @param {number} slope @param {number} wide */
  follow(axes, slope, wide) {
    const half = this.low.map((low, k) => (this.high[k] - low) / 2);
    const at = this.low.map((low, k) => low + half[k]);
    const far = Math.max(...[0, 1, 2, 3, 4, 5, 6, 7].map((corner) => {
      const [x, y, z] = axes.map((axis) => axis.reduce((sum, v, k) => sum + v * half[k] * (corner >> k & 1 ? 1 : -1), 0));
      return z + Math.max(Math.abs(x) / wide, Math.abs(y), 0.02) / slope / 0.85;
    }));
    // Robots that drive would let the picture shake: it follows with slack.
    if (Math.abs(far / this.now.far - 1) > 0.1 || Math.hypot(...at.map((v, k) => v - this.now.at[k])) > 0.05 * far) this.now = { at, far };
  }

  /** Where a place is in the picture; null behind the camera. @param {number[]} place @param {number} width @param {number} height @returns {[number, number] | null} */
  project(place, width, height) {
    const { see } = this;
    const w = see[3] * place[0] + see[7] * place[1] + see[11] * place[2] + see[15];
    if (w <= 0) return null;
    const [x, y] = point(see, place);
    return [width / 2 * (1 + x / w), height / 2 * (1 - y / w)];
  }
}

/** The frame on the floor below a robot, or on the ramp on which it stands. @param {Pose} pose @param {Thing[]} things @returns {Matrix} */
function standing({ x, y, heading }, things) {
  for (const { pose, solids } of things) {
    const box = solids[0]?.box;
    const frame = framed(pose, 0);
    const normal = frame.slice(8, 11);
    // A thing that has fallen over is no ramp, and a level one is not driven on.
    if (!box || normal[2] < 0.7 || normal[2] > 0.9999) continue;
    const top = point(frame, [0, 0, box[2] / 2]);
    const z = top[2] - (normal[0] * (x - top[0]) + normal[1] * (y - top[1])) / normal[2];
    const from = [x - top[0], y - top[1], z - top[2]];
    const off = [0, 4].map((c) => Math.abs(from.reduce((sum, v, k) => sum + v * frame[c + k], 0)));
    if (z < 0 || off[0] > box[0] / 2 || off[1] > box[1] / 2) continue;
    const [[c, s], [l, m, n]] = [[Math.cos(heading), Math.sin(heading)], normal];
    const rise = -(l * c + m * s) / n;
    const [a, b, d] = [c, s, rise].map((v) => v / Math.hypot(1, rise));
    return [a, b, d, 0, m * d - n * b, n * a - l * d, l * b - m * a, 0, l, m, n, 0, x, y, z, 1];
  }
  return upright([x, y, 0], heading);
}

/** The frame of a body. @param {Pose} pose @param {number} up its height if the pose has none, m */
function framed({ x, y, z, heading, pitch, roll }, up) {
  return upright([x, y, z ?? up], heading, pitch, roll);
}

/** @param {string} hex such as #0072b2 @param {number} solid @returns {Ink} */
function ink(hex, solid) {
  return [...[1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255), solid];
}
