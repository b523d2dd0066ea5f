// What `rems router status` finds between this page's server and its fabric.

import { button, make } from "./dom.js";

/** A panel with the findings. @param {() => Promise<[boolean, string][]>} ask */
export function doctor(ask) {
  const list = make("ul");
  const made = make("details", { id: "doctor" }, make("summary", {}, "doctor"), list);
  const look = () => {
    list.replaceChildren(make("li", {}, "examines the connection ..."));
    ask().catch((error) => /** @type {[boolean, string][]} */ ([[false, error.message]])).then((found) => {
      const lines = found.map(([well, text]) => make("li", { class: well ? "" : "bad" }, `${well ? "ok" : "BAD"}  ${text}`));
      list.replaceChildren(...lines, make("li", {}, button("again", look)));
    });
  };
  made.addEventListener("toggle", () => made.open && look());
  return made;
}
