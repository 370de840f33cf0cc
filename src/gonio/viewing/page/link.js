// The state of the page as text: in the fragment of its address, which no server sees, or as state.json. It has values,
// and no data.

import { element } from "gonio/elements.js";
import { download } from "gonio/export.js";
import { button } from "gonio/fit.js";
import { served } from "gonio/source.js";
import { printable } from "gonio/words.js";

const VERSION = 1;
const MARK = "#s=";

const isNumber = (v) => typeof v === "number" && Number.isFinite(v);
const oneOf = (...names) => [(v) => names.includes(v), `one of ${names.join(", ")}`];
const TEXT = [(v) => typeof v === "string", "a text"];
const PLACE = [(v) => Number.isInteger(v) && v >= 0, "a whole number"];
const YES = [(v) => typeof v === "boolean", "true or false"];
const TWO = [(v) => Array.isArray(v) && v.length === 2 && v.every(isNumber), "two numbers"];
const PLACES = [(v) => Array.isArray(v) && v.every(PLACE[0]), "a list of whole numbers"];

// What is kept as it is, and what it must be.
const PLAIN = {
  quantity: oneOf("f", "fcos", "pif"),
  scale: oneOf("log", "linear"),
  band: YES,
  pairAs: oneOf("ratio", "difference"),
  mapView: oneOf("both", "data", "model", "ratio", "difference"),
  body: oneOf("sphere", "teapot"),
  litFrom: oneOf("model", "table"),
  exposure: [isNumber, "a number"],
  orbit: TWO,
  lamp: TWO,
};

// What has to be done in an order, and what it must be.
const KINDS = {
  ...PLAIN,
  set: PLACE,
  fit: TEXT,
  model: TEXT,
  values: [(v) => v !== null && typeof v === "object" && Object.values(v).every((own) => Array.isArray(own) && own.every(isNumber)), "an object with a list of numbers for each parameter"],
  locked: [(v) => Array.isArray(v) && v.every((name) => typeof name === "string"), "a list of names"],
  follow: YES,
  block: PLACE,
  lambda: [isNumber, "a number"],
  cell: PLACE,
  incidences: PLACES,
  second: [(v) => Number.isInteger(v) && v >= -1, "a whole number"],
};

export function stateOf(state) {
  const set = state.sets[state.set];
  const names = state.model.declaration.parameters.map((p) => p.name);
  const shown = set.cells.map((_, k) => k).filter((k) => set.cells[k].block === state.block && !state.hidden.has(k));
  const said = {
    v: VERSION,
    set: state.set,
    model: state.model.declaration.name,
    fit: state.fitName,
    values: Object.fromEntries(names.map((name, k) => [name, state.values[k]])),
    locked: [...state.locked].map((k) => names[k]),
    follow: state.follow,
    block: state.block,
    cell: state.cell,
    incidences: shown,
    second: state.second,
  };
  const { wavelength } = set.blocks[state.block];
  if (isNumber(wavelength)) said.lambda = wavelength;
  for (const key of Object.keys(PLAIN)) if (state[key] !== undefined && KINDS[key][0](state[key])) said[key] = state[key];
  return said;
}

// base64url of the JSON in UTF-8.
export function encoded(said) {
  const bytes = new TextEncoder().encode(JSON.stringify(said));
  return btoa(Array.from(bytes, (b) => String.fromCharCode(b)).join("")).replace(/\+/g, "-").replace(/\//g, "_").replace(/=+$/, "");
}

export function decoded(text) {
  try {
    const bytes = Uint8Array.from(atob(text.replace(/-/g, "+").replace(/_/g, "/")), (c) => c.charCodeAt(0));
    return JSON.parse(new TextDecoder("utf-8", { fatal: true }).decode(bytes));
  } catch {
    throw new Error("The link is damaged: it holds no state of a page.");
  }
}

// What is wrong with a state, in a word; nothing where it may be applied. Names that are not known are ignored.
export function refused(said) {
  if (said === null || typeof said !== "object" || Array.isArray(said)) return "The state is no object.";
  if (said.v !== undefined && said.v !== VERSION) return `The state is of version ${printable(said.v)}; this page reads version ${VERSION}.`;
  const [wrong] = Object.keys(KINDS).filter((key) => said[key] !== undefined && !KINDS[key][0](said[key]));
  return wrong ? `The state is refused: ${wrong} must be ${KINDS[wrong][1]}.` : "";
}

// Make the page as it was; says what could not be.
export async function restored(store, actions, said) {
  const words = refused(said);
  if (words) return words;
  const state = store.get();
  const set = said.set ?? state.set;
  if (set >= state.sets.length) return `The state is of scan ${set + 1}, and this page has ${state.sets.length}.`;
  if (said.fit && !Object.hasOwn(state.sets[set].fits, said.fit)) return `This page has no fit ${printable(said.fit)}: the state is not applied.`;
  if (said.model && !state.models.some(({ name }) => name === said.model)) return `This page has no model ${printable(said.model)}: the state is not applied.`;
  if (set !== state.set || !state.model) await actions.chooseSet(set);
  if (said.fit) await actions.chooseModel("fit", said.fit);
  else if (said.model) await actions.chooseModel("model", said.model);
  const left = [values(state, said.values ?? {}, store), directions(state, said, store, actions)].filter(Boolean);
  const { parameters } = state.model.declaration;
  const patch = Object.fromEntries(Object.keys(PLAIN).filter((key) => said[key] !== undefined).map((key) => [key, said[key]]));
  if (said.locked) patch.locked = new Set(parameters.map((_, k) => k).filter((k) => said.locked.includes(parameters[k].name)));
  if (said.follow !== undefined) patch.follow = said.follow;
  if (said.second !== undefined && said.second < state.sets.length) patch.second = said.second;
  store.set(patch);
  return left.join(" ");
}

function values(state, given, store) {
  const { parameters } = state.model.declaration;
  const next = state.values.slice();
  for (const [k, { name, lower, upper }] of parameters.entries()) {
    const own = given[name];
    if (!own) continue;
    if (own.length !== next[k].length) return `The values are refused: ${name} has ${next[k].length} here, and ${own.length} in the state.`;
    if (own.some((v) => v < lower || v > (upper ?? Infinity))) return `The values are refused: ${name} is outside its bounds.`;
    next[k] = own.slice();
  }
  store.set({ values: next });
  return "";
}

function directions(state, said, store, actions) {
  const set = state.sets[state.set];
  const of = set.blocks.findIndex((block) => block.wavelength === said.lambda);
  const block = said.lambda !== undefined && of >= 0 ? of : (said.block ?? 0);
  if (block >= set.blocks.length) return "The scan has no such wavelength or channel.";
  if (block !== state.block) actions.chooseBlock(block);
  const own = set.cells.map((_, k) => k).filter((k) => set.cells[k].block === block);
  if (said.incidences) store.set({ hidden: new Set(own.filter((k) => !said.incidences.includes(k))) });
  if (own.includes(said.cell)) store.set({ cell: said.cell });
  return "";
}

export async function begin(store, actions, given) {
  const fromLink = location.hash.startsWith(MARK);
  const said = () => (location.hash.startsWith(MARK) ? decoded(location.hash.slice(MARK.length)) : given);
  async function apply() {
    try {
      store.set({ error: await restored(store, actions, said()) });
    } catch (error) {
      store.set({ error: error.message });
    }
  }
  if (fromLink || Object.keys(given ?? {}).length) await apply();
  window.addEventListener("hashchange", () => location.hash.startsWith(MARK) && apply());
}

export function mount(store) {
  const address = element("input", { type: "text", readOnly: true, ariaLabel: "link to this state" });
  const said = element("p", { className: "note", role: "status" });
  const text = served
    ? "The link opens this page as it is now, while its server runs. state.json does so later: gonio view FILE --state state.json."
    : "The link opens this file as it is now.";
  const dialog = element(
    "dialog",
    { className: "share", ariaLabel: "Share" },
    element("h2", {}, "Share"),
    element("p", { className: "note" }, `${text} Both hold values, and no data.`),
    address,
    element(
      "div",
      { className: "buttons" },
      button("Copy link", "Copy the link", copy),
      button("state.json", "The state as a file", () => download("state.json", `${JSON.stringify(stateOf(store.get()), null, 2)}\n`, "application/json")),
      button("Close", "Close", () => dialog.close()),
    ),
    said,
  );
  document.body.append(dialog);
  document.querySelector("#top .actions").append(button("Share", "A link to this state", open));

  function open() {
    const here = `${location.href.split("#")[0]}${MARK}${encoded(stateOf(store.get()))}`;
    history.replaceState(null, "", here);
    address.value = here;
    dialog.showModal();
    copy();
  }

  async function copy() {
    address.select();
    const done = await navigator.clipboard?.writeText(address.value).then(() => true, () => false);
    said.textContent = done ? "Copied." : "Copy the link above.";
  }
}
