// What a user can do to the state: every control and every key goes through here.

import { hiddenAtFirst } from "gonio/curves.js";
import * as source from "gonio/source.js";
import { snapped } from "gonio/weights.js";

export function actionsOf(store) {
  const state = store.get();
  let choices = 0;
  const actions = {
    async chooseSet(k) {
      const turn = (choices += 1);
      if (!state.sets[k].value) await fetched(state, k);
      if (turn !== choices) return; // another was chosen while this one was fetched
      const [fitted] = Object.keys(state.sets[k].fits);
      const name = state.model?.declaration.name ?? state.first;
      await (fitted !== undefined && !(state.beginWithModel && k === 0) ? actions.chooseModel("fit", fitted, k) : actions.chooseModel("model", name, k));
    },

    chooseBlock(block) {
      const cell = state.sets[state.set].cells.findIndex((c) => c.block === block);
      store.set({ block, cell, cursor: null });
      store.set({ hidden: hiddenAtFirst(state) });
    },

    // A fit of the scan by name, or a model of the catalogue with its default shape and exact weights.
    // Both change at once: what is drawn of a scan never has the groups of another.
    async chooseModel(kind, name, k = state.set) {
      const set = state.sets[k];
      const fit = kind === "fit" ? set.fits[name] : null;
      const turn = (choices += 1);
      const module = await source.model(fit ? fit.model : name);
      if (turn !== choices) return; // another was chosen meanwhile: the last choice holds, whichever comes first
      const { declaration } = module;
      const model = { declaration, module };
      const groups = fit ? fit.parameters.map((p) => p.cells) : groupsOf(set, declaration);
      const values = fit ? fit.parameters.map((p) => p.values.slice()) : firstValues(declaration, groups, kind === "model" ? state.given : {});
      const block = k === state.set && state.block < set.blocks.length ? state.block : 0;
      const isSame = k === state.set && Boolean(state.model);
      const cell = isSame ? state.cell : set.cells.findIndex((c) => c.block === block);
      const chosen = { fit, fitName: fit ? name : "", locked: heldOf(fit ? fit.parameters : declaration.parameters), follow: !fit };
      store.set({ set: k, block, cell, model, groups, values, ...chosen });
      if (!isSame) store.set({ cursor: null, hidden: hiddenAtFirst(state) });
      if (!fit) store.set({ values: withGiven(snapped(state), state, declaration) });
      store.set({ first_values: state.values, ranges: rangesOf(state) });
    },

    move(k, value) {
      const values = state.values.slice();
      values[k] = values[k].slice();
      values[k][state.groups[k][state.cell]] = value;
      store.set({ values });
      const isWeight = state.model.declaration.parameters[k].weight;
      if (state.follow && !isWeight) store.set({ values: snapped(state) });
      else if (isWeight) store.set({ follow: false });
    },

    refused(k, value) {
      const { lower, upper, name } = state.model.declaration.parameters[k];
      if (!Number.isFinite(value)) return `${name}: give a number`;
      if (value < lower || value > (upper ?? Infinity)) return `${name}: between ${lower} and ${upper ?? "infinity"}`;
      return "";
    },

    snap() {
      store.set({ values: snapped(state) });
      store.set({ ranges: rangesOf(state) });
    },

    follow(follow) {
      store.set({ follow });
      if (follow) store.set({ values: snapped(state) });
    },

    lock(k) {
      const locked = new Set(state.locked);
      if (!locked.delete(k)) locked.add(k);
      store.set({ locked });
    },

    reset() {
      store.set({ values: state.first_values });
    },
  };
  return actions;
}

export async function fetched(state, k) {
  Object.assign(state.sets[k], await source.columns(k));
}

// What the fit held, or a fit would hold, until it is freed.
function heldOf(parameters) {
  return new Set(parameters.map((_, k) => k).filter((k) => parameters[k].held));
}

// Without a fit: one shape for the scan, and weights for each block, as a fit has them.
function groupsOf(set, declaration) {
  return declaration.parameters.map((p) => set.cells.map((c) => (p.weight ? c.block : 0)));
}

function firstValues(declaration, groups, given) {
  return declaration.parameters.map((p, k) =>
    Array(1 + groups[k].reduce((a, b) => Math.max(a, b), 0)).fill(given[p.name] ?? p.default ?? 1),
  );
}

// Weights that were named on the command line stay as they were given.
function withGiven(values, state, declaration) {
  return values.map((own, k) => {
    const given = state.given[declaration.parameters[k].name];
    return given === undefined ? own : own.map(() => given);
  });
}

// How far the slider of a weight goes: it has no upper bound.
function rangesOf(state) {
  return state.values.map((own) => 4 * own.reduce((a, b) => Math.max(a, b), 0) || 1);
}
