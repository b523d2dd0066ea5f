// The page: joins the connection, the values, and what shows them.

import { Arena } from "./arena.js";
import { Bar } from "./bar.js";
import { by, make, write } from "./dom.js";
import { doctor } from "./doctor.js";
import { Drive } from "./drive.js";
import { Layout } from "./layout.js";
import { Link } from "./link.js";
import { Playback } from "./playback.js";
import { Plots } from "./plot.js";
import { Settings } from "./settings.js";
import { Store } from "./store.js";
import { Teams } from "./teams.js";
import { Tree } from "./tree.js";

/** Messages that are shown. */
const LINES = 300;

const store = new Store();
const plots = new Plots(store);
const arena = new Arena(store);
const layout = new Layout(plots, arena, say);
const bar = new Bar(store, () => link, say);
const drive = new Drive(() => link, say);
const teams = new Teams(() => link, say);
bar.teams = teams;
const settings = new Settings((verb, more) => link.ask(verb, more), say);
by("log").before(doctor(() => link.ask("doctor")));
const tree = new Tree(store, (key) => plots.toggle(key), (key) => link.ask("why", { key }), (agent) => settings.of(agent));

const playback = new Playback(store, plots, bar, () => link, say);

const asked = new URLSearchParams(location.search);
for (const key of asked.getAll("field").slice(0, 16)) plots.toggle(key);
plots.rebuild();

const link = new Link(location.hash.slice(1), {
  text(message) {
    if (message.forget) store.forget();
    if (message.channels) store.meet(message.channels);
    if (message.schemas) store.learn(message.schemas);
    if (message.rewind) playback.rewind();
    if (message.playback) playback.hear(message.playback);
    if (message.scenes) arena.scenes = message.scenes;
    if (message.status) {
      bar.hear(message.status);
      store.attend((message.status.agents ?? []).map((/** @type {string[]} */ one) => one[0]));
      drive.attend(message.status);
    }
    for (const one of message.events ?? []) say(`tick ${one.tick}, ${one.agent}: ${one.text}`, one.level ?? "info");
    if (message.beat) drive.hear(message.beat);
    if (message.welcome) {
      if (message.welcome.layout && !teams.fabric && !plots.series.length) layout.set(message.welcome.layout);
      const { fabric, at, user, version } = message.welcome;
      write(by("title"), fabric);
      teams.fabric = fabric;
      by("title").title = `rems_net ${version}, ${at}${user ? `, as ${user}` : ""}`;
      document.title = `${fabric}: rems`;
      if (message.welcome.recording) playback.begin(message.welcome.recording);
    }
  },
  frame: (frame) => store.read(frame),
  state(sentence) {
    bar.gone = sentence;
    if (sentence) drive.lose();
    const notice = by("notice");
    notice.hidden = !sentence;
    write(notice, sentence);
  },
}, asked.get("fabric") ?? "");

/** Add a message. @param {string} text @param {string} [level] */
function say(text, level = "error") {
  const log = by("log");
  const atEnd = log.scrollTop + log.clientHeight >= log.scrollHeight - 8;
  const known = ["info", "warning", "error"].includes(level) ? level : "info";
  log.append(make("p", { class: known }, text));
  while (log.children.length > LINES) log.firstChild?.remove();
  if (atEnd) log.scrollTop = log.scrollHeight;
}

let looked = 0;
/** Ask for the ports that are shown, at most five times a second. @param {number} now */
function look(now) {
  if (now - looked < 200 || bar.gone) return;
  looked = now;
  teams.look(now);
  const plotted = plots.series.map(({ key }) => key.split("/").slice(0, 2).join("/"));
  link.look(new Set([...tree.shown, ...plotted]));
}

let drawn = 0;
/** Frames that were drawn and the time they took, for tests. @type {{frames: number, ms: number}} */
const cost = { frames: 0, ms: 0 };
Object.assign(window, { rems: { store, plots, arena, bar, drive, teams, link, playback, cost } });

/** @param {number} now */
function draw(now) {
  requestAnimationFrame(draw);
  if (link.frames === drawn && now % 250 > 20) return;
  drawn = link.frames;
  const begin = performance.now();
  arena.draw();
  plots.draw();
  tree.update(now);
  bar.update();
  playback.update();
  look(now);
  cost.frames++;
  cost.ms += performance.now() - begin;
}
requestAnimationFrame(draw);
