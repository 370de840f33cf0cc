// What follows from the values: reflectance at some angles, and which laws they break; asked of the server when they rest.

import { element } from "gonio/elements.js";
import { sent } from "gonio/fit.js";
import { post, served } from "gonio/source.js";
import { number, printable } from "gonio/words.js";

const REST = 50; // ms after the last change

export function mount(root, store) {
  const line = element("p", { className: "laws" });
  root.append(line);
  let timer = 0;
  let asked = 0;

  async function ask() {
    const mine = ++asked;
    const said = await post("/api/evaluate", sent(store.get()))
      .then((answer) => answer.json())
      .then(words)
      .catch((error) => printable(error.message));
    if (mine === asked) line.textContent = said; // a later question has a later answer
  }

  store.watch(["set", "block", "model", "values", "fit"], (state) => {
    if (!state.model) return;
    if (!served) {
      line.textContent = state.sets[state.set].relative
        ? "Relative: nothing about energy."
        : "Reflectance is computed by gonio: gonio view FILE opens a page that shows it.";
      return;
    }
    clearTimeout(timer);
    timer = setTimeout(ask, REST);
  });
}

export function words(found) {
  const yes = (value) => (value === null ? "unknown" : value ? "yes" : "no");
  const told = found.reflectances.map(([theta, value], k) => {
    if (value === null) return `lobe too narrow to integrate at ${number(theta)} deg`;
    return `${k ? "" : "reflectance "}${number(value, 3)} at ${number(theta)} deg`;
  });
  if (found.relative) told.push("relative: nothing about energy");
  else told.push(`energy conserved: ${yes(found.conserves_energy)}`);
  told.push(`positive: ${yes(found.positive)}`, `reciprocal: ${yes(found.reciprocal)}`);
  const line = told.join("; ");
  return `${line[0].toUpperCase()}${line.slice(1)}.`;
}
