// Where the links of a robot are, from its joints. A matrix has 16 numbers, by columns.

/** @typedef {number[]} Matrix @typedef {number[]} Point */
/** A link on its parent (-1: the robot itself); its joint is at the state's field times the ratio. @typedef {{parent: number, at: Point, axis: Point, slides: boolean, field: string, ratio: number}} Link */
/** @typedef {[number, Point, number, Point]} Loop a link and a point on it, another link and its point */

/** m. A loop is closed if its ends are this near. */
const CLOSED = 1e-4;
/** Steps in which joints first move from zero, so that loops fold as they should. */
const STEPS = 20;

/** @param {Matrix} a @param {Matrix} b @returns {Matrix} */
export function times(a, b) {
  const made = new Array(16);
  for (let c = 0; c < 16; c += 4) {
    for (let r = 0; r < 4; r++) {
      made[c + r] = a[r] * b[c] + a[r + 4] * b[c + 1] + a[r + 8] * b[c + 2] + a[r + 12] * b[c + 3];
    }
  }
  return made;
}

/** A pose from a place and the rows of a rotation. @param {Point} [at] @param {number[][]} [rows] @returns {Matrix} */
export function posed([x, y, z] = [0, 0, 0], [[a, b, c], [d, e, f], [g, h, i]] = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]) {
  return [a, d, g, 0, b, e, h, 0, c, f, i, 0, x, y, z, 1];
}

/** The rows of a rotation about a unit vector. @param {Point} axis @param {number} angle rad @returns {number[][]} */
export function about([x, y, z], angle) {
  const [s, c, v] = [Math.sin(angle), Math.cos(angle), 1 - Math.cos(angle)];
  return [
    [c + x * x * v, x * y * v - z * s, x * z * v + y * s],
    [y * x * v + z * s, c + y * y * v, y * z * v - x * s],
    [z * x * v - y * s, z * y * v + x * s, c + z * z * v],
  ];
}

/** The pose of a body with heading, pitch (up) and roll, in rad. @param {Point} at @param {number} heading @param {number} [pitch] @param {number} [roll] */
export function upright(at, heading, pitch = 0, roll = 0) {
  const lean = times(posed([0, 0, 0], about([0, 1, 0], -pitch)), posed([0, 0, 0], about([1, 0, 0], roll)));
  return times(posed(at, about([0, 0, 1], heading)), lean);
}

/** @param {Matrix} m @param {Point} p @returns {Point} */
export function point(m, [x, y, z]) {
  return [0, 1, 2].map((r) => m[r] * x + m[r + 4] * y + m[r + 8] * z + m[r + 12]);
}

/** @param {Link[]} links @param {number[]} positions rad or m @returns {Matrix[]} in the robot's frame */
function chain(links, positions) {
  return links.reduce((found, { parent, at, axis, slides }, i) => {
    const step = slides ? posed(at.map((v, k) => v + positions[i] * axis[k])) : posed(at, about(axis, positions[i]));
    return [...found, parent < 0 ? step : times(found[parent], step)];
  }, /** @type {Matrix[]} */ ([]));
}

/**
 * The poses of a robot's links, in its own frame.
 * @param {Link[]} links @param {Loop[]} loops @param {(link: Link) => number} read the position of a joint
 * @param {number[]} bent positions of the joints that nothing measures, kept for the next call
 */
export function linksOf(links, loops, read, bent) {
  const wanted = links.map((link) => (link.field ? read(link) * link.ratio : 0));
  if (!loops.length) return chain(links, wanted);
  for (let step = bent.length ? STEPS : 1; step <= STEPS; step++) {
    const now = links.map((link, i) => (link.field ? wanted[i] * step / STEPS : bent[i] ?? 0));
    close(links, loops, now);
    Object.assign(bent, now);
  }
  return chain(links, bent);
}

/** Close the loops: each joint that nothing measures points its end at the other. @param {Link[]} links @param {Loop[]} loops @param {number[]} positions */
function close(links, loops, positions) {
  for (let round = 0; round < 60; round++) {
    let gap = 0;
    for (const [one, at, other, there] of loops) {
      for (const [mine, point1, yours, point2] of /** @type {Loop[]} */ ([[one, at, other, there], [other, there, one, at]])) {
        for (let joint = mine; joint >= 0; joint = links[joint].parent) {
          if (links[joint].field || links[joint].slides) continue;
          const poses = chain(links, positions);
          const [end, goal] = [point(poses[mine], point1), point(poses[yours], point2)];
          gap = Math.max(gap, Math.hypot(...end.map((v, k) => v - goal[k])));
          positions[joint] += angle(poses[joint], links[joint].axis, end, goal);
        }
      }
    }
    if (gap < CLOSED) return;
  }
}

/** By how much a hinge turns to point from one place to the other, rad. @param {Matrix} pose @param {Point} axis @param {Point} end @param {Point} goal */
function angle(pose, axis, end, goal) {
  const along = [0, 1, 2].map((r) => pose[r] * axis[0] + pose[r + 4] * axis[1] + pose[r + 8] * axis[2]);
  const [p, q] = [end, goal].map((place) => place.map((v, k) => v - pose[12 + k]));
  const across = [p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]];
  const dot = (/** @type {Point} */ a, /** @type {Point} */ b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  return Math.atan2(dot(along, across), dot(p, q) - dot(p, along) * dot(q, along));
}
