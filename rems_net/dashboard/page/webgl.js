// Solids and lines in three dimensions, by plain WebGL2.

/** @typedef {import("./body.js").Matrix} Matrix @typedef {number[]} Ink red, green, blue and how solid, 0 to 1 */
/** @typedef {{vao: WebGLVertexArrayObject, count: number, instances: WebGLBuffer}} Shape */

const VERTEX = `#version 300 es
in vec3 corner; in vec4 m0, m1, m2, m3, ink; uniform mat4 see; out vec3 at; out vec4 colour;
void main() {
  vec4 world = mat4(m0, m1, m2, m3) * vec4(corner, 1.0);
  at = world.xyz; colour = ink; gl_Position = see * world; }`;
// The normal comes from the slope of the surface: corners need none, and edges are sharp.
const FRAGMENT = `#version 300 es
precision highp float; in vec3 at; in vec4 colour; uniform vec3 light; uniform float shaded; out vec4 made;
void main() {
  float bright = 1.0;
  if (shaded > 0.5) bright = 0.55 + 0.45 * max(dot(normalize(cross(dFdx(at), dFdy(at))), light), 0.0);
  made = vec4(colour.rgb * bright * colour.a, colour.a); }`;

export class Canvas3 {
  /** @param {HTMLCanvasElement} canvas */
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = /** @type {WebGL2RenderingContext | null} */ (null);
    this.shapes = /** @type {Map<string, Shape>} */ (new Map());
    /** instances of each shape: solid ones, and those that can be seen through @type {Map<string, number[][]>[]} */
    this.solids = [new Map(), new Map()];
    this.lines = /** @type {{places: number[], ink: Ink}[]} */ ([]);
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.gl = null;
    });
  }

  /** Get ready. @returns {boolean} whether this browser can */
  open() {
    if (this.gl) return true;
    const gl = this.canvas.getContext("webgl2");
    if (!gl || gl.isContextLost()) return false;
    const program = gl.createProgram();
    ["corner", "m0", "m1", "m2", "m3", "ink"].forEach((name, i) => gl.bindAttribLocation(program, i, name));
    for (const [kind, text] of /** @type {[number, string][]} */ ([[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]])) {
      const shader = /** @type {WebGLShader} */ (gl.createShader(kind));
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return false;
    gl.useProgram(program);
    const at = (/** @type {string} */ name) => gl.getUniformLocation(program, name);
    this.uniforms = { see: at("see"), light: at("light"), shaded: at("shaded") };
    this.gl = gl;
    this.shapes.clear();
    const side = (/** @type {number} */ r) => [[0, -0.5], [r, -0.5], [r, 0.5], [0, 0.5]];
    this.add("box", ...lathe(4, side(Math.SQRT1_2), Math.PI / 4));
    this.add("cylinder", ...lathe(40, side(0.5)));
    const round = Array.from({ length: 15 }, (_, j) => Math.PI * (j / 14 - 0.5));
    this.add("ball", ...lathe(28, round.map((up) => [Math.cos(up) / 2, Math.sin(up) / 2])));
    this.strokes = this.corners(gl);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    return true;
  }

  /** A buffer of corners, which is bound. @param {WebGL2RenderingContext} gl */
  corners(gl) {
    const [vao, buffer] = [gl.createVertexArray(), gl.createBuffer()];
    gl.bindVertexArray(vao);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(0);
    gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
    return { vao, buffer };
  }

  /** Add a shape by its corners and triangles. @param {string} name @param {number[]} corners @param {number[]} faces */
  add(name, corners, faces) {
    const { gl } = this;
    if (!gl) return;
    const { vao } = this.corners(gl);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(corners), gl.STATIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(faces), gl.STATIC_DRAW);
    const instances = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, instances);
    for (let i = 0; i < 5; i++) {
      gl.enableVertexAttribArray(i + 1);
      gl.vertexAttribPointer(i + 1, 4, gl.FLOAT, false, 80, i * 16); // a matrix and a colour
      gl.vertexAttribDivisor(i + 1, 1);
    }
    this.shapes.set(name, { vao, count: faces.length, instances });
  }

  /** Draw a shape in the next picture. @param {string} name @param {Matrix} pose @param {number[]} size @param {Ink} ink */
  solid(name, pose, [x, y, z], ink) {
    const some = this.solids[ink[3] < 1 ? 1 : 0];
    const made = pose.map((value, i) => value * (i < 4 ? x : i < 8 ? y : i < 12 ? z : 1)).concat(ink);
    if (!some.get(name)?.push(made)) some.set(name, [made]);
  }

  /** Draw a line through places in the next picture. @param {number[]} places @param {Ink} ink */
  line(places, ink) {
    if (places.length) this.lines.push({ places, ink });
  }

  /** Draw all that was added. @param {Matrix} see from the world to the picture @param {number[]} light */
  draw(see, light) {
    const { gl, canvas, uniforms, strokes } = this;
    if (gl && uniforms && strokes) {
      const scale = window.devicePixelRatio || 1;
      const [width, height] = [canvas.clientWidth * scale, canvas.clientHeight * scale].map(Math.round);
      if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
      gl.viewport(0, 0, width, height);
      gl.depthMask(true);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.uniformMatrix4fv(uniforms.see, false, see);
      gl.uniform3fv(uniforms.light, light);
      gl.uniform1f(uniforms.shaded, 0);
      gl.bindVertexArray(strokes.vao);
      gl.bindBuffer(gl.ARRAY_BUFFER, strokes.buffer);
      for (let i = 0; i < 4; i++) gl.vertexAttrib4fv(i + 1, [0, 1, 2, 3].map((k) => Number(k === i)));
      for (const { places, ink } of this.lines) {
        gl.vertexAttrib4fv(5, ink);
        gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(places), gl.STREAM_DRAW);
        gl.drawArrays(gl.LINE_STRIP, 0, places.length / 3);
      }
      gl.uniform1f(uniforms.shaded, 1);
      for (const some of this.solids) {
        for (const [name, all] of some) {
          const shape = this.shapes.get(name);
          if (!shape) continue;
          gl.bindVertexArray(shape.vao);
          gl.bindBuffer(gl.ARRAY_BUFFER, shape.instances);
          gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(all.flat()), gl.STREAM_DRAW);
          gl.drawElementsInstanced(gl.TRIANGLES, shape.count, gl.UNSIGNED_INT, 0, all.length);
        }
        gl.depthMask(false);
      }
    }
    for (const some of this.solids) some.clear();
    this.lines = [];
  }
}

/** What a line makes that turns about z. @param {number} n steps @param {number[][]} line distance from z, and z @param {number} [begin] rad @returns {[number[], number[]]} */
function lathe(n, line, begin = 0) {
  const [corners, faces] = [/** @type {number[]} */ ([]), /** @type {number[]} */ ([])];
  line.forEach(([r, z], j) => {
    for (let i = 0; i < n; i++) {
      const [turn, here, next] = [begin + 2 * Math.PI * i / n, j * n + i, j * n + (i + 1) % n];
      corners.push(r * Math.cos(turn), r * Math.sin(turn), z);
      if (j < line.length - 1) faces.push(here, next, here + n, next, next + n, here + n);
    }
  });
  return [corners, faces];
}
