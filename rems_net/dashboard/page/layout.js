// A layout: the plots and the view of the arena, as a JSON file.

import { button, by, make } from "./dom.js";
import { SPANS } from "./plot.js";

export class Layout {
  /** @param {import("./plot.js").Plots} plots @param {import("./arena.js").Arena} arena @param {(sentence: string) => void} say */
  constructor(plots, arena, say) {
    this.plots = plots;
    this.arena = arena;
    const file = make("input", { type: "file", accept: ".json", hidden: "", id: "layout", "aria-label": "a layout" });
    file.addEventListener("change", async () => {
      try {
        this.set(JSON.parse(await (file.files?.[0]?.text() ?? "")));
      } catch {
        say("This file is no layout of a page; expected one that `save` of a page has made.");
      }
      file.value = "";
    });
    by("plot-tools").append(button("save", () => this.save(), "save plots and views as a layout"),
      button("load", () => file.click(), "load a layout"), file);
  }

  get() {
    const { span, series } = this.plots;
    return { layout: 1, span, plots: series.map(({ key, shown }) => ({ field: key, unit: shown })), arena: this.arena.view };
  }

  /** Show a layout. Raises an error for what is none. @param {any} plain */
  set(plain) {
    if (plain?.layout !== 1 || !Array.isArray(plain.plots)) throw new Error("no layout");
    this.plots.clear();
    for (const { field, unit } of plain.plots.slice(0, 64)) this.plots.toggle(String(field), String(unit));
    if (SPANS.includes(plain.span)) this.plots.show(plain.span);
    const { scale, x, y } = plain.arena ?? {};
    this.arena.view = scale > 0 && [scale, x, y].every(Number.isFinite) ? { scale, x, y } : null;
  }

  save() {
    const href = URL.createObjectURL(new Blob([JSON.stringify(this.get(), null, 2)], { type: "application/json" }));
    make("a", { href, download: "layout.json" }).click();
  }
}
