// The page: its state, its views, and what happens first.

import { actionsOf, fetched } from "gonio/actions.js";
import { computed } from "gonio/compute.js";
import * as alone from "gonio/alone.js";
import * as curves from "gonio/curves.js";
import * as keys from "gonio/keys.js";
import * as notebook from "gonio/notebook.js";
import * as panel from "gonio/panel.js";
import * as source from "gonio/source.js";
import { createStore } from "gonio/state.js";
import * as status from "gonio/status.js";
import * as top from "gonio/top.js";

const place = (id) => document.getElementById(id);

async function start() {
  const session = await source.session();
  const store = createStore({
    version: session.version,
    sets: session.sets,
    models: session.models,
    first: session.model,
    given: session.values,
    beginWithModel: session.begin_with_model,
    set: 0,
    block: 0,
    cell: 0,
    hidden: new Set(),
    model: null,
    values: [],
    groups: [],
    locked: new Set(),
    fit: null,
    fitName: "",
    follow: true,
    band: true,
    quantity: "f",
    scale: "log",
    ranges: [],
    result: null,
    cursor: null,
    error: "",
  });
  const state = store.get();
  const actions = actionsOf(store);
  await fetched(state, 0);
  store.watch(["set", "block", "hidden", "model", "values", "groups", "band", "fit"], () => {
    if (state.model) store.set({ result: computed(state) });
  });
  top.mount(place("top"), store, actions);
  panel.mount(place("panel"), store, actions);
  curves.mount(place("curves"), store, actions);
  status.mount(place("status"), store);
  keys.mount(document, store, actions);
  alone.mount(place("panel"), store);
  notebook.mount(place("top").querySelector(".actions"), store, actions);
  await actions.chooseSet(0);
  store.set({ sets: state.sets.slice() });
  window.gonio = { store, actions }; // for tests, and for the curious
  document.documentElement.dataset.ready = "true";
}

start().catch((error) => {
  document.documentElement.dataset.ready = "failed";
  place("status").replaceChildren(Object.assign(document.createElement("p"), { className: "error", textContent: String(error.message ?? error) }));
  throw error;
});
