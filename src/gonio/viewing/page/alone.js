// What a page that is a file cannot do, and what can.

import { element } from "gonio/elements.js";
import { notebook, served } from "gonio/source.js";

export function mount(root, store) {
  if (served) return;
  const note = element("p", { className: "note alone" });
  root.append(note);

  store.watch(["sets", "set"], (state) => {
    const names = state.models.map((m) => m.name).join(", ");
    const others = notebook ? `gonio.view(scan, model="…") begins with another` : "gonio view FILE has every model, fits and exports";
    note.textContent = `This page holds the model${state.models.length > 1 ? "s" : ""} ${names}: ${others}.`;
  });
}
