// Searches a built site as its own page does, and prints the results as JSON.
// node search.mjs SITE WORD...: {word: [docname, ...]}, best first, each page once.
import fs from "node:fs";
import path from "node:path";
import vm from "node:vm";

const [site, ...words] = process.argv.slice(2);
const shelf = { setItem() {}, getItem: () => null, removeItem() {} };
const page = {
  readyState: "loading", // so that nothing of the page's own starts
  addEventListener() {},
  getElementById: () => null,
  documentElement: { dataset: {} },
};
const world = vm.createContext({ document: page, localStorage: shelf, console });
vm.runInContext("globalThis.window = globalThis", world);
const scripts = fs
  .readFileSync(path.join(site, "search.html"), "utf8")
  .matchAll(/<script src="([^"?]+)/g);
for (const [, script] of scripts) {
  if (!script.includes("furo")) {
    vm.runInContext(fs.readFileSync(path.join(site, script), "utf8"), world);
  }
}
world.words = words;
const found = vm.runInContext(
  `Object.fromEntries(words.map((word) => {
    const results = Search._performSearch(...Search._parseQuery(word)).reverse();
    return [word, [...new Set(results.map((result) => result[0]))]];
  }))`,
  world,
);
console.log(JSON.stringify(found));
