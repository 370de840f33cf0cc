// Keys, for who has no mouse; `?` lists them.

import { element } from "gonio/elements.js";

export const KEYS = [
  ["w", "best weights for this shape"],
  ["f", "fit this model"],
  ["r", "back to the first values"],
  ["1 … 9", "show or hide an incidence angle"],
  ["← →", "in the plot: read value by value"],
  ["↑ ↓", "in the plot: the next curve"],
  ["+ −", "in the plot: move the curve at that value by 2 %"],
  ["Shift + arrow", "on a slider: ten steps"],
  ["Home, End", "on a slider: its bounds"],
  ["?", "this list"],
];

export function mount(root, store, actions) {
  const close = element("button", { type: "button" }, "Close");
  const rows = KEYS.flatMap(([key, what]) => [element("dt", {}, key), element("dd", {}, what)]);
  const list = element("dialog", {}, element("h2", {}, "Keys"), element("dl", {}, ...rows), close);
  close.addEventListener("click", () => list.close());
  document.body.append(list);
  const open = element("button", { type: "button", title: "The keys (?)" }, "Keys");
  open.addEventListener("click", () => list.showModal());
  document.querySelector("#top .actions").append(open);

  root.addEventListener("keydown", (event) => {
    const inText = event.target.matches?.("input[type=text], input[type=number], select, textarea");
    if (inText || event.ctrlKey || event.metaKey || event.altKey) return;
    if (event.key === "w") actions.snap();
    else if (event.key === "r") actions.reset();
    else if (event.key === "f") actions.fit(false);
    else if (event.key === "?") list.showModal();
    else if (/^[1-9]$/.test(event.key)) document.querySelectorAll(".chip")[Number(event.key) - 1]?.click();
    else actions.onKey?.(event.key);
  });
}
