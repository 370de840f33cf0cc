// In a notebook the page is a frame beside a kernel, which reads the values, sets them, and fits. Messages are taken
// from the frame's parent alone, and only where they have the form of one.

import { element } from "gonio/elements.js";
import { notebook } from "gonio/source.js";

const FROM_PAGE = "gonio-page";
const TO_PAGE = "gonio-kernel";

export function mount(root, store, actions) {
  if (!notebook) return;
  const state = store.get();
  const fit = element("button", { type: "button", title: "The kernel of the notebook fits this model; held values stay (f)" }, "Fit");
  root.append(fit);
  let sent = "";

  const now = () => ({ set: state.set, model: state.model.declaration.name, fit: state.fitName, values: state.values });
  const post = (kind, content) => window.parent.postMessage({ gonio: FROM_PAGE, kind, ...content }, "*");

  function said() {
    if (!state.model) return;
    const told = JSON.stringify(now());
    if (told !== sent) post("values", JSON.parse(told));
    sent = told;
  }

  actions.fit = () => {
    if (fit.disabled) return;
    fit.disabled = true;
    fit.textContent = "Fitting …";
    post("fit", { ...now(), locked: [...state.locked] });
  };
  fit.addEventListener("click", actions.fit);

  const answers = {
    values({ model, values }) {
      if (model !== state.model?.declaration.name || !alike(values, state.values)) return;
      store.set({ values: values.map((own) => own.slice()), follow: false });
    },
    async fit({ set, name, record }) {
      ended();
      if (!state.sets[set]) return;
      state.sets[set].fits[name] = record;
      store.set({ sets: state.sets.slice(), error: "" });
      await actions.chooseModel("fit", name);
    },
    error({ text }) {
      ended();
      store.set({ error: String(text) });
    },
  };

  function ended() {
    fit.disabled = false;
    fit.textContent = "Fit";
  }

  window.addEventListener("message", (event) => {
    const told = event.data;
    if (event.source !== window.parent || told?.gonio !== TO_PAGE || !Object.hasOwn(answers, told.kind)) return;
    answers[told.kind](told);
  });
  store.watch(["set", "model", "fit", "values"], said);
  post("ready", {});
}

// Whether there is a finite number for each group of each parameter.
function alike(values, own) {
  if (!Array.isArray(values) || values.length !== own.length) return false;
  return values.every((v, k) => Array.isArray(v) && v.length === own[k].length && v.every(Number.isFinite));
}
