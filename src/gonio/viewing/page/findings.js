// What `gonio check` warns of: asked for when a scan is first shown, so that its curves do not wait.

import { get, served } from "gonio/source.js";

export function mount(store) {
  async function fetched(state) {
    const set = state.sets[state.set];
    if (!served || set.findings) return;
    set.findings = [];
    try {
      set.findings = await (await get(`/api/set/${state.set}/findings`)).json();
      store.set({ findings: set.findings });
    } catch (error) {
      store.set({ error: error.message });
    }
  }
  store.watch(["set", "sets"], fetched);
  fetched(store.get());
}
