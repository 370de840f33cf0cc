// The standard uncertainty of a fitted curve: J C J^T, with the derivatives J by central differences.

import { inPlane, light } from "gonio/angles.js";
import { valuesOf } from "gonio/compute.js";

const STEP = 1e-4; // of a value: the differences are then right to some 1e-8 of the curve

// Whether the values are those of the fit; once a slider has left them its covariance says nothing.
export function atFit(state) {
  if (!state.fit) return false;
  return state.fit.parameters.every((p, k) => p.values.every((v, g) => v === state.values[k][g]));
}

// For each theta_r of a cell; null where the fit says nothing.
export function uncertainty(state, cell, x, f) {
  if (!state.band || !atFit(state)) return null;
  const { parameters, covariance } = state.fit;
  const { module } = state.model;
  const set = state.sets[state.set].cells[cell];
  const wi = light(set.theta_i, set.phi_i);
  const base = valuesOf(state, cell);
  const places = parameters.map((p) => p.start + p.cells[cell]);
  const free = parameters.map((_, k) => k).filter((k) => covariance[places[k]][places[k]] > 0);

  function curve(values) {
    const pre = module.pre(values);
    const inc = module.inc(values, pre, wi);
    return x.map((t) => module.reflected(values, pre, inc, wi, inPlane(t, set.phi_i)));
  }

  const derivatives = free.map((k) => {
    const [group, own] = [parameters[k].cells[cell], parameters[k]];
    const step = STEP * (Math.abs(base[k]) || 1);
    const upper = own.upper[group] ?? Infinity;
    const up = Math.min(base[k] + step, upper);
    const down = Math.max(base[k] - step, own.lower[group] ?? -Infinity);
    const [above, below] = [up, down].map((v) => curve(base.map((other, j) => (j === k ? v : other))));
    return above.map((value, n) => (value - below[n]) / (up - down));
  });

  return f.map((_, n) => {
    let variance = 0;
    for (let a = 0; a < free.length; a++) {
      for (let b = 0; b < free.length; b++) {
        variance += derivatives[a][n] * derivatives[b][n] * covariance[places[free[a]]][places[free[b]]];
      }
    }
    return Math.sqrt(Math.max(variance, 0));
  });
}
