// Above: what is drawn, and how.

import { element, oneOf } from "gonio/elements.js";
import { QUANTITIES } from "gonio/words.js";

export function mount(root, store) {
  const state = store.get();
  const quantities = Object.entries(QUANTITIES).map(([name, { label, title }]) => [name, label, title]);
  root.append(
    element("h1", {}, "gonio"),
    oneOf("quantity", "quantity", quantities, state.quantity, (quantity) => store.set({ quantity })),
    oneOf("scale", "scale", [["log", "log", "Logarithmic scales"], ["linear", "linear", "Linear scales"]], state.scale, (scale) => store.set({ scale })),
    element("div", { className: "actions" }),
  );
  store.watch(["quantity", "scale"], (now) => {
    for (const input of root.querySelectorAll("input[type=radio]")) input.checked = input.value === now[input.name];
  });
}
