// The page: its state, its views, and what happens first.

import { actionsOf, fetched } from "gonio/actions.js";
import * as compare from "gonio/compare.js";
import { computed } from "gonio/compute.js";
import * as alone from "gonio/alone.js";
import * as curves from "gonio/curves.js";
import * as drag from "gonio/drag.js";
import * as exporting from "gonio/export.js";
import * as files from "gonio/files.js";
import * as findings from "gonio/findings.js";
import * as first from "gonio/first.js";
import * as fitting from "gonio/fit.js";
import * as keys from "gonio/keys.js";
import * as laws from "gonio/laws.js";
import * as link from "gonio/link.js";
import * as gl from "gonio/gl.js";
import * as lobe from "gonio/lobe.js";
import * as map from "gonio/map.js";
import { fetchTables } from "gonio/modelled.js";
import * as notebook from "gonio/notebook.js";
import * as panel from "gonio/panel.js";
import * as source from "gonio/source.js";
import * as sphere from "gonio/sphere.js";
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
    beginsWithFits: session.begins_with_fits,
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
    job: null,
    second: session.pair[1] ?? -1,
    pair: null,
    pairAs: "ratio",
    dragging: false,
    uploadLimit: session.upload_limit,
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
  fitting.mount(place("panel"), store, actions);
  first.mount(store, actions);
  compare.mount(place("panel"), place("curves"), store);
  files.mount(place("panel"), store, actions);
  drag.mount(place("curves"), store, actions);
  gl.start(store);
  fetchTables(store);
  map.mount(place("map"), store);
  lobe.mount(place("lobe"), store);
  sphere.mount(place("sphere"), store);
  status.mount(place("status"), store);
  laws.mount(place("status"), store);
  link.mount(store);
  exporting.mount(store);
  keys.mount(document, store, actions);
  alone.mount(place("panel"), store);
  notebook.mount(place("top").querySelector(".actions"), store, actions);
  await actions.chooseSet(0);
  await link.begin(store, actions, session.state);
  store.set({ sets: state.sets.slice() });
  window.gonio = { store, actions }; // for tests, and for the curious
  document.documentElement.dataset.ready = "true";
  if (!location.hash) actions.begin();
  findings.mount(store);
}

start().catch((error) => {
  document.documentElement.dataset.ready = "failed";
  place("status").replaceChildren(Object.assign(document.createElement("p"), { className: "error", textContent: String(error.message ?? error) }));
  throw error;
});
