// Half the width of the 95 % band of a fitted curve, as gonio has it: the root of J M J^T, with M of the fit and the
// derivatives J of the curve by differences.

import { inPlane, light } from "gonio/angles.js";
import { valuesOf } from "gonio/compute.js";

const STEP = 1e-4; // of a value: the differences are then right to some 1e-8 of the curve
const SMALLEST = 1e-3; // the size of a value that is zero
const FELT = 1e-9; // of the curve, for a change of a value by its own size: below, it takes no part in it

// Whether the values are those of the fit; once a slider has left them its covariance says nothing.
export function atFit(state) {
  if (!state.fit) return false;
  return state.fit.parameters.every((p, k) => p.values.every((v, g) => v === state.values[k][g]));
}

// For each theta_r of a cell, Infinity where a value takes part that the data do not determine; null without a fit.
export function halfWidth(state, cell, x, f) {
  if (!state.band || !atFit(state)) return null;
  const { parameters, expanded } = state.fit;
  const places = parameters.map((p) => p.start + p.cells[cell]);
  const slopes = slopesOf(state, cell, x);
  const known = parameters.map((_, k) => k).filter((k) => !parameters[k].held && parameters[k].determined[parameters[k].cells[cell]]);
  const unknown = parameters.map((_, k) => k).filter((k) => !parameters[k].held && !known.includes(k));
  const base = valuesOf(state, cell);
  const felt = (k, n) => Math.abs(slopes(k)[n]) * Math.max(Math.abs(base[k]), SMALLEST) > FELT * Math.abs(f[n]);
  return f.map((_, n) => {
    if (unknown.some((k) => felt(k, n))) return Infinity;
    const part = known.map((k) => (felt(k, n) ? slopes(k)[n] : 0));
    const variance = known.reduce(
      (sum, k, a) => sum + known.reduce((own, j, b) => own + part[a] * part[b] * expanded[places[k]][places[j]], 0),
      0,
    );
    return Math.sqrt(Math.max(variance, 0));
  });
}

// The derivative of the curve of a cell by each of its values, within the bounds that the model declares.
function slopesOf(state, cell, x) {
  const { module, declaration } = state.model;
  const { theta_i, phi_i } = state.sets[state.set].cells[cell];
  const wi = light(theta_i, phi_i);
  const base = valuesOf(state, cell);
  const found = new Map();

  function curve(k, value) {
    const values = base.map((other, j) => (j === k ? value : other));
    const pre = module.pre(values);
    const inc = module.inc(values, pre, wi);
    return x.map((t) => module.reflected(values, pre, inc, wi, inPlane(t, phi_i)));
  }

  function slope(k) {
    const { lower, upper, weight } = declaration.parameters[k];
    const step = STEP * Math.max(Math.abs(base[k]), SMALLEST);
    const [low, high] = weight ? [-Infinity, Infinity] : [Math.min(lower, base[k]), Math.max(upper, base[k])];
    const inwards = base[k] + step > high ? -step : step;
    const isCentral = base[k] - step >= low && base[k] + step <= high;
    const [once, other] = [curve(k, base[k] + inwards), curve(k, base[k] + (isCentral ? -1 : 2) * inwards)];
    if (isCentral) return once.map((v, n) => (v - other[n]) / (2 * step));
    return curve(k, base[k]).map((own, n) => (4 * (once[n] - own) - (other[n] - own)) / (2 * inwards));
  }

  return (k) => found.get(k) ?? found.set(k, slope(k)).get(k);
}
