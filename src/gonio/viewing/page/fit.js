// Fits from the page: started and cancelled here, done by the server in a process of its own.

import { element } from "gonio/elements.js";
import { ended, notebook, post, remove, served } from "gonio/source.js";
import { number, printable } from "gonio/words.js";

const WEIGHTINGS = ["auto", "uniform", "relative", "solid-angle", "uncertainty", "log"];
export const WHY_NOT = `This page ${notebook ? "stands in a notebook" : "is a file"}. gonio view FILE opens one that can do this.`;

// What the server needs to know of the sliders.
export function sent(state) {
  const names = state.model.declaration.parameters.map((p) => p.name);
  return {
    set: state.set,
    model: state.model.declaration.name,
    fit: state.fitName,
    values: Object.fromEntries(names.map((name, k) => [name, state.values[k]])),
    block: state.block,
    cell: state.cell,
  };
}

export function mount(root, store, actions) {
  if (notebook) return; // its kernel fits, by a button of its own
  const section = element("section", { className: "fit" }, element("h2", {}, "Fit"));
  const weighting = element("select", {}, ...WEIGHTINGS.map((name) => element("option", { value: name }, name)));
  const label = element("label", { className: "choice" }, element("span", {}, "weighting"), weighting);
  const one = button("Fit", "Fit this model; what is held stays (f)", () => actions.fit(false));
  const all = button("Compare all", "Try every model, and show the best", () => actions.fit(true));
  const bar = element("progress", { max: 1, ariaLabel: "Progress of the fit" });
  const cancel = button("Cancel", "End this fit", () => actions.cancelFit());
  const running = element("div", { className: "running", hidden: true }, bar, cancel);
  const said = element("p", { className: "note", role: "status" });
  const wrong = element("p", { className: "error", role: "alert" });
  const ranking = element("ol", { className: "ranking note" });
  // Beside the title too: the panel may be far below on a telephone.
  const above = element("span", { className: "note job", hidden: true });
  document.querySelector("#top h1").after(above);
  section.append(label, element("div", { className: "buttons" }, one, all), running, said, wrong, ranking);
  root.append(section);
  if (!served) {
    for (const control of [weighting, one, all]) control.disabled = true;
    said.textContent = WHY_NOT;
  }

  // left: whether a fit that nobody asked for is not wanted any more.
  actions.fit = async (best, left = null) => {
    const state = store.get();
    if (!served || state.job) return;
    wrong.textContent = "";
    ranking.replaceChildren();
    const { set } = state;
    const locked = [...state.locked].map((k) => state.model.declaration.parameters[k].name);
    const asked = best ? { set, model: "best" } : { ...sent(state), locked };
    store.set({ job: { number: 0, set, fraction: 0, name: best ? "all models" : asked.model, unasked: Boolean(left) } });
    try {
      const { job } = await (await post("/api/fit", { ...asked, weighting: weighting.value })).json();
      store.set({ job: { ...store.get().job, number: job } });
      if (left?.()) await actions.cancelFit();
      const event = await listened(job, (told) => store.set({ job: { ...store.get().job, ...told } }));
      await follow(event, set, left?.());
    } catch (error) {
      const isRefused = left && !store.get().job?.number; // another page fits this scan: no mistake of who looks at this one
      failed(error.message);
      if (isRefused) [said.textContent, wrong.textContent] = [wrong.textContent, ""];
    }
  };

  actions.cancelFit = async () => {
    const { job } = store.get();
    if (job?.number) await remove(`/api/job/${job.number}`).catch((error) => failed(error.message));
  };

  function failed(words) {
    store.set({ job: null });
    said.textContent = "";
    wrong.textContent = printable(words);
  }

  async function follow(event, set, isLeft) {
    if (event.failed) return failed(event.failed);
    store.set({ job: null });
    if (event.cancelled || isLeft) {
      said.textContent = isLeft ? "The first fit gave way to what you chose: Fit starts it again." : "Cancelled.";
      return;
    }
    const state = store.get();
    const { name, record } = event.done;
    state.sets[set].fits[name] = record;
    store.set({ sets: state.sets.slice() });
    if (state.set === set) await actions.chooseModel("fit", name);
    said.textContent = printable(`${event.verdict ?? `${record.model}: ${record.status}, E ${number(record.cost, 3)}, ${record.weighting} weighting`}.`);
    ranking.replaceChildren(...(event.ranking ?? []).map((row) => element("li", {}, `${row.model}: ${number(row.error, 3)}`)));
  }

  store.watch(["set"], ({ job }) => {
    if (!served || job) return;
    said.textContent = wrong.textContent = "";
    ranking.replaceChildren();
  });
  store.watch(["job"], ({ job }) => {
    running.hidden = above.hidden = !job;
    one.disabled = all.disabled = !served || Boolean(job);
    if (!job) return;
    bar.value = job.fraction;
    said.textContent = above.textContent = `${job.fraction < 0.01 ? "Starting" : "Fitting"}: ${printable(job.name)}, ${Math.round(100 * job.fraction)} %`;
  });
}

// The last event of a job; `told` hears the others.
function listened(number, told) {
  return new Promise((resolve, reject) => {
    const stream = new EventSource(`/api/job/${number}`);
    stream.onmessage = ({ data }) => {
      const event = JSON.parse(data);
      if ("fraction" in event) return told(event.name ? event : { fraction: event.fraction });
      stream.close();
      return resolve(event);
    };
    stream.onerror = () => {
      stream.close();
      reject(new Error(ended));
    };
  });
}

export function button(text, title, act) {
  const made = element("button", { type: "button", title }, text);
  made.addEventListener("click", act);
  return made;
}
