// The left side: which scan, which model, and a slider for every parameter.

import { anew, choice, element } from "gonio/elements.js";
import { blockLabel, cellLabel, number, printable, shownOf, symbol, unitOf } from "gonio/words.js";

const STEPS = 1000; // of a slider

export function mount(root, store, actions) {
  const data = element("section", { className: "data" }, element("h2", {}, "Data"));
  const models = choice("model", [], "", (value) => actions.chooseModel(...split(value)));
  const model = element("div", {});
  root.append(data, element("section", { className: "model" }, element("h2", {}, "Model"), models, model));
  const warned = element("div", { role: "status" });
  const several = element("p", { className: "note" });
  let rows = [];
  let showBlock = () => {};

  function showData(state) {
    const set = state.sets[state.set];
    const names = state.sets.map((one, k) => [String(k), printable(one.name)]);
    data.replaceChildren(data.firstChild);
    if (names.length > 1) data.append(choice("scan", names, String(state.set), (k) => actions.showSet(Number(k))));
    else data.append(element("p", { className: "name" }, printable(set.name)));
    const masked = set.masked ? `, ${set.masked} masked` : "";
    data.append(element("p", { className: "note" }, `${set.total} ${set.origin} values${masked}${set.unit_label === "1" ? "" : `, ${set.unit_label}`}`));
    if (set.light) data.append(element("p", { className: "note" }, printable(set.light)));
    if (set.interpolated) data.append(element("p", { className: "note" }, `${shownOf(set)} The agreement is that of these.`));
    else if (set.shown < set.total) data.append(element("p", { className: "note" }, `Shown are ${set.shown} of them, whole curves chosen evenly: a page holds no more. The agreement is that of the values shown.`));
    if (set.relative) data.append(element("p", { className: "note" }, "Relative: it says nothing about energy."));
    showBlock = () => {};
    if (set.blocks.length > 1) data.append(blocks(state, set));
    data.append(warned);
    showFindings(state);
  }

  function showFindings(state) {
    const said = state.sets[state.set].findings ?? [];
    warned.replaceChildren(...said.map(({ severity, text }) => element("p", { className: severity }, printable(text))));
  }

  // Its slider stays while it is moved.
  function blocks(state, set) {
    if (set.by.length === 1 && set.by[0] === "wavelength") {
      const out = element("output", {});
      const input = element("input", { type: "range", min: 0, max: set.blocks.length - 1, step: 1 });
      input.addEventListener("input", () => actions.chooseBlock(Number(input.value)));
      showBlock = ({ block }) => {
        input.value = block;
        out.textContent = input.ariaValueText = blockLabel(set, block);
      };
      return element("label", { className: "choice" }, element("span", {}, "wavelength"), input, out);
    }
    const options = set.blocks.map((_, k) => [String(k), blockLabel(set, k)]);
    const made = choice(set.by.join(", "), options, String(state.block), (k) => actions.chooseBlock(Number(k)));
    showBlock = ({ block }) => (made.lastChild.value = String(block));
    return made;
  }

  // The list stays where its names do: who types in it is at a place of it.
  function showModels(state) {
    const select = models.lastChild;
    const named = [
      ...Object.entries(state.sets[state.set].fits).map(([name, fit]) => [`fit ${name}`, nameOfFit(name, fit)]),
      ...state.models.map(({ name, title }) => [`model ${name}`, `${name}: ${title}`]),
    ];
    const known = Array.from(select.options, (one) => one.value).join("\n");
    if (known !== named.map(([value]) => value).join("\n")) select.replaceChildren(...named.map(([value, text]) => element("option", { value }, text)));
    select.value = state.fit ? `fit ${state.fitName}` : `model ${state.model.declaration.name}`;
  }

  function showModel(state) {
    model.replaceChildren();
    const { violates } = state.model.declaration;
    if (violates.length) model.append(element("p", { className: "note" }, `It violates: ${violates.join(", ")}.`));
    rows = state.model.declaration.parameters.map((_, k) => row(state, k));
    model.append(element("div", { className: "parameters" }, element("p", { className: "held" }, "hold"), ...rows.map(({ box }) => box)), several, buttons(state));
  }

  function buttons(state) {
    const follow = element("input", { type: "checkbox", checked: state.follow });
    follow.addEventListener("change", () => actions.follow(follow.checked));
    const button = (text, title, act) => {
      const made = element("button", { type: "button", title }, text);
      made.addEventListener("click", act);
      return made;
    };
    return element(
      "div",
      { className: "buttons" },
      element("label", {}, follow, element("span", {}, "weights follow the shape")),
      button("Best weights", "Exact weights for this shape (w)", () => actions.snap()),
      button("Reset", "Back to the first values (r)", () => actions.reset()),
    );
  }

  // The slider of one parameter: a name, a track with the fit and its uncertainty, a number, a lock.
  function row(state, k) {
    const parameter = state.model.declaration.parameters[k];
    const id = `parameter-${parameter.name}`;
    const scale = scaleOf(parameter, state, k);
    const slider = element("input", { type: "range", min: 0, max: STEPS, step: 1, id, title: parameter.help });
    const entry = element("input", { type: "text", inputMode: "decimal", className: "number", size: 8 });
    entry.ariaLabel = `${parameter.name}, a number`;
    const lock = element("input", { type: "checkbox", title: "Hold it where it is: fits and best weights leave it" });
    lock.ariaLabel = `hold ${parameter.name} where it is`;
    const label = element("label", { htmlFor: id, title: parameter.help }, symbol(parameter.name));
    const tick = element("span", { className: "tick", ariaHidden: "true" });
    const unit = element("span", { className: "unit" }, unitOf(parameter, state.sets[state.set]));
    const track = element("span", { className: "track" }, slider, tick);
    const box = element("div", { className: "parameter" }, label, track, entry, unit, lock);

    slider.addEventListener("input", () => actions.move(k, scale.value(Number(slider.value))));
    slider.addEventListener("keydown", (event) => {
      const step = { ArrowRight: 10, ArrowUp: 10, ArrowLeft: -10, ArrowDown: -10 }[event.key];
      if (!step || !event.shiftKey) return;
      event.preventDefault();
      slider.value = Number(slider.value) + step;
      actions.move(k, scale.value(Number(slider.value)));
    });
    entry.addEventListener("change", () => {
      const asked = Number(entry.value.replace("−", "-").replace(",", "."));
      const wrong = actions.refused(k, asked);
      entry.setCustomValidity(wrong);
      entry.reportValidity();
      if (!wrong) actions.move(k, asked);
    });
    lock.addEventListener("change", () => actions.lock(k));

    function show(now) {
      const value = now.values[k][now.groups[k][now.cell]];
      slider.value = scale.place(value);
      slider.ariaValueText = `${number(value)} ${unit.textContent}`.trim();
      entry.value = number(value);
      lock.checked = now.locked.has(k);
      const own = now.fit?.parameters[k];
      const group = now.groups[k][now.cell];
      tick.hidden = !own || own.held;
      if (!tick.hidden) {
        const u = own.uncertainty[group] ?? 0;
        const ends = [own.values[group] - u, own.values[group] + u].map((v) => scale.place(v) / STEPS);
        tick.style.setProperty("--from", ends[0]);
        tick.style.setProperty("--to", ends[1]);
        const sure = own.held ? "held" : own.determined[group] ? `± ${number(own.uncertainty[group], 2)}` : "the data do not determine it";
        tick.title = `fit: ${number(own.values[group])}, ${sure}`;
      }
    }
    return { box, show };
  }

  // Nothing is built anew while a slider in it is dragged, unless another scan is shown or named.
  let known = "";
  store.watch(["set", "sets"], (state) => {
    const now = [state.set, ...state.sets.map((one) => one.name)].join("\n");
    if (now !== known) anew(data, () => showData(state));
    known = now;
  });
  store.watch(["set", "sets", "block"], (state) => showBlock(state));
  store.watch(["set", "model", "fit", "sets"], showModels);
  store.watch(["set", "block", "model", "fit", "sets", "ranges"], (state) => anew(model, () => showModel(state)));
  store.watch(["findings"], showFindings);
  store.watch(["set", "sets", "block", "model", "fit", "values", "cell", "locked", "follow", "ranges"], (state) => {
    for (const { show } of rows) show(state);
    several.replaceChildren(...aboutGroups(state));
    const follow = model.querySelector(".buttons input");
    if (follow) follow.checked = state.follow;
  });
}

const nameOfFit = (name, { model }) => (name === "fit" ? `fit: ${model}` : `fit: ${printable(name)}${name.startsWith(model) ? "" : ` (${model})`}`);

// Which of several values the sliders have: those of the curve that was touched last.
function aboutGroups(state) {
  const set = state.sets[state.set];
  const names = state.model.declaration.parameters.filter((_, k) => state.values[k].length > 1).map((p) => p.name);
  if (!names.length) return [];
  const of = [set.blocks.length > 1 ? blockLabel(set, state.block) : "", `θᵢ ${cellLabel(set, state.cell)}`].filter(Boolean);
  const listed = names.flatMap((name, k) => (k ? [", ", symbol(name)] : [symbol(name)]));
  return [...listed, `: several values; shown and moved are those for ${of.join(", ")}.`];
}

function split(text) {
  const space = text.indexOf(" ");
  return [text.slice(0, space), text.slice(space + 1)];
}

// Between places of a slider and values: by ratios where the bounds are far apart, else evenly.
function scaleOf(parameter, state, k) {
  const lower = parameter.lower;
  const upper = parameter.upper ?? state.ranges[k] ?? 1;
  const clamp = (place) => Math.min(Math.max(place, 0), STEPS);
  if (parameter.wide) {
    const range = Math.log(upper / lower);
    return {
      value: (place) => tidy(lower * Math.exp((range * place) / STEPS), lower, upper),
      place: (value) => clamp((STEPS * Math.log(Math.max(value, lower) / lower)) / range),
    };
  }
  return {
    value: (place) => tidy(lower + ((upper - lower) * place) / STEPS, lower, upper),
    place: (value) => clamp((STEPS * (value - lower)) / (upper - lower)),
  };
}

const tidy = (value, lower, upper) => Math.min(Math.max(Number(value.toPrecision(5)), lower), upper);
