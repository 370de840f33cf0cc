// Above: what is drawn, and how.

import { element, oneOf } from "gonio/elements.js";
import { QUANTITIES } from "gonio/words.js";

export function mount(root, store) {
  const state = store.get();
  const quantities = Object.entries(QUANTITIES).map(([name, { label }]) => [name, label]);
  root.append(
    element("h1", {}, "gonio"),
    oneOf("quantity", "quantity", quantities, state.quantity, (quantity) => store.set({ quantity })),
    oneOf("scale", "scale", [["log", "log"], ["linear", "lin"]], state.scale, (scale) => store.set({ scale })),
    element("div", { className: "actions" }),
  );
}
