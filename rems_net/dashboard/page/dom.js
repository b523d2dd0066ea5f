// Elements, made without HTML: no text of a fabric is ever parsed.

/**
 * Make an element. @template {keyof HTMLElementTagNameMap} T @param {T} tag @param {Record<string, string>} [attributes]
 * @param {(Node | string)[]} children @returns {HTMLElementTagNameMap[T]}
 */
export function make(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  made.append(...children);
  return made;
}

/** The element with this id. @param {string} id @returns {HTMLElement} */
export function by(id) {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no element ${id}`);
  return found;
}

/** Make a button. @param {string} label @param {() => void} pressed @param {string} [title] */
export function button(label, pressed, title = "") {
  const made = make("button", { type: "button", ...(title ? { title } : {}) }, label);
  made.addEventListener("click", pressed);
  return made;
}

/** ms. Some buttons must be held so long: nobody presses them by mistake. */
const HOLD = 1000;

/** Make a button that must be held. @param {string} label @param {() => void} done @param {string} [title] */
export function held(label, done, title) {
  const made = button(label, () => {}, title);
  made.classList.add("hold");
  let timer = 0;
  const end = () => {
    clearTimeout(timer);
    timer = 0;
    made.classList.remove("held");
  };
  const begin = () => {
    if (timer) return;
    made.classList.add("held");
    timer = window.setTimeout(() => { end(); done(); }, HOLD);
  };
  made.addEventListener("pointerdown", begin);
  for (const name of ["pointerup", "pointerleave", "pointercancel", "blur"]) made.addEventListener(name, end);
  made.addEventListener("keydown", (event) => { if (event.key === "Enter") begin(); });
  made.addEventListener("keyup", (event) => { if (event.key === "Enter") end(); });
  return made;
}

/** Make a choice. @param {string} label @param {[string, string][]} options value and text @param {(value: string) => void} chosen */
export function select(label, options, chosen) {
  const made = make("select", { "aria-label": label });
  for (const [value, text] of options) made.append(make("option", { value }, text));
  made.addEventListener("change", () => chosen(made.value));
  return made;
}

/** Make a choice of a pace; it then shows its own name again. @param {string} label @param {string[]} values @param {(value: string) => void} chosen */
export function paces(label, values, chosen) {
  const options = values.map((one) => /** @type {[string, string]} */ ([one, Number(one) ? `${one} x` : one]));
  const made = select(label, [["", "pace"], ...options], (value) => {
    if (value) chosen(value);
    made.value = "";
  });
  return made;
}

/** Set a text, only if it differs. @param {Node} node @param {string} text */
export function write(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/** A canvas as large as its place. @param {HTMLCanvasElement} canvas @returns {{pen: CanvasRenderingContext2D, width: number, height: number} | null} null if it cannot be seen */
export function pen(canvas) {
  const { clientWidth: width, clientHeight: height } = canvas;
  const drawn = canvas.getContext("2d");
  if (!drawn || !width || !height) return null;
  const scale = window.devicePixelRatio || 1;
  const [wide, high] = [width * scale, height * scale].map(Math.round);
  if (canvas.width !== wide || canvas.height !== high) Object.assign(canvas, { width: wide, height: high });
  drawn.setTransform(scale, 0, 0, scale, 0, 0);
  drawn.clearRect(0, 0, width, height);
  return { pen: drawn, width, height };
}

/** @typedef {[number, number]} Spot a place on a canvas, in pixels */

/** Draw lines; one that ends where it begins is closed. @param {CanvasRenderingContext2D} on @param {Spot[][]} lines @param {string} ink @param {{wide?: number, solid?: number, dash?: number[]}} [how] */
export function stroke(on, lines, ink, { wide = 1, solid = 1, dash = [] } = {}) {
  Object.assign(on, { strokeStyle: ink, lineWidth: wide, globalAlpha: solid });
  on.setLineDash(dash);
  on.beginPath();
  for (const line of lines) {
    line.forEach((spot, i) => (i ? on.lineTo(...spot) : on.moveTo(...spot)));
    if (line.length > 2 && line.at(-1) === line[0]) on.closePath();
  }
  on.stroke();
  on.setLineDash([]);
  on.globalAlpha = 1;
}

/** Fill a polygon. @param {CanvasRenderingContext2D} on @param {Spot[]} corners @param {string} ink @param {number} [solid] 0 to 1 */
export function fill(on, corners, ink, solid = 1) {
  Object.assign(on, { fillStyle: ink, globalAlpha: solid });
  on.beginPath();
  for (const corner of corners) on.lineTo(...corner);
  on.fill();
  on.globalAlpha = 1;
}

/** Draw a text. @param {CanvasRenderingContext2D} on @param {string} words @param {Spot} at @param {string} ink @param {CanvasTextAlign} [align] @param {string} [halo] ink around it */
export function text(on, words, at, ink, align = "center", halo = "") {
  Object.assign(on, { font: "12px system-ui, sans-serif", textAlign: align, fillStyle: ink, strokeStyle: halo, lineWidth: 3 });
  if (halo) on.strokeText(words, ...at);
  on.fillText(words, ...at);
}

/** A colour of the style sheet. @param {string} name such as --ink */
export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}

/** Colours of robots and series; colour-blind people can tell them apart. */
export function series(/** @type {number} */ i) {
  return colour(`--series-${i % 8}`);
}
