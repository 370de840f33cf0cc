// What the model gives: curves in the plane of incidence, values at the measured directions, and how well they agree.

import { detector, inPlane, light } from "gonio/angles.js";
import { uncertainty } from "gonio/band.js";

const STEP = 0.5; // deg, of the curves
const MOST = 20000; // values of which the agreement is computed at each move of a slider

// The values of the model for one cell, in the order of its functions.
export const valuesOf = (state, cell) => state.values.map((own, k) => own[state.groups[k][cell]]);

// Whether model and values are those of the set that is shown: while another is loaded they are not yet.
export function isReady(state) {
  const { cells } = state.sets[state.set];
  return Boolean(state.model && cells?.[state.cell] && state.groups.length === state.values.length && state.groups.every((own) => own.length === cells.length));
}

// The cells of the block that is shown.
export function cellsShown(state) {
  const { cells } = state.sets[state.set];
  return cells.map((_, k) => k).filter((k) => cells[k].block === state.block);
}

// A function of directions for one cell: unit vectors to the light and to the detector.
export function evaluator(state, cell) {
  const { module } = state.model;
  const values = valuesOf(state, cell);
  const pre = module.pre(values);
  return (wi) => {
    const inc = module.inc(values, pre, wi);
    return (wr) => module.reflected(values, pre, inc, wi, wr);
  };
}

// theta_r of the curve of a cell: even steps, and the measured angles.
export function abscissae(set, cell) {
  const { start, end } = set.cells[cell];
  const found = new Set();
  for (let t = -90; t <= 90; t += STEP) found.add(t);
  for (let k = start; k < end; k++) if (Number.isFinite(set.signed[k])) found.add(set.signed[k]);
  return Float64Array.from(found).sort();
}

export function computed(state) {
  const set = state.sets[state.set];
  const shown = cellsShown(state);
  const curves = new Map();
  for (const cell of shown) {
    if (state.hidden.has(cell)) continue;
    const x = abscissae(set, cell);
    const { theta_i, phi_i } = set.cells[cell];
    const at = evaluator(state, cell)(light(theta_i, phi_i));
    const f = x.map((t) => at(inPlane(t, phi_i)));
    curves.set(cell, { x, f, u: uncertainty(state, cell, x, f) });
  }
  return { curves, ...agreement(state, shown) };
}

// The model at the rows of some cells.
export function atRows(state, cells) {
  const set = state.sets[state.set];
  const modelled = new Float64Array(set.value.length).fill(NaN);
  for (const cell of cells) {
    const { theta_i, phi_i, start, end } = set.cells[cell];
    const at = evaluator(state, cell)(light(theta_i, phi_i));
    for (let k = start; k < end; k++) modelled[k] = at(detector(set.theta_r[k], set.phi[k], phi_i));
  }
  return modelled;
}

// E as the fit has it (guo2023, eq 11, or of logarithms), and the rms difference of decimal logarithms.
function agreement(state, cells) {
  const set = state.sets[state.set];
  const count = cells.reduce((n, c) => n + set.cells[c].end - set.cells[c].start, 0);
  if (count > MOST) return { modelled: null, cost: NaN, lgRmse: NaN, count };
  const modelled = atRows(state, cells);
  let [above, below, squares, positive] = [0, 0, 0, 0];
  let least = Infinity;
  for (const m of set.value) if (m > 0 && m < least) least = m;
  for (const cell of cells) {
    for (let k = set.cells[cell].start; k < set.cells[cell].end; k++) {
      const [m, f, g] = [set.value[k], modelled[k], set.weight[k]];
      if (set.logarithmic) {
        above += g * Math.log(f / m) ** 2;
        below += g;
      } else {
        above += g * (f - m) ** 2;
        below += g * m * m;
      }
      if (m > 0) {
        squares += Math.log10(Math.max(f, least / 10) / m) ** 2;
        positive += 1;
      }
    }
  }
  return { modelled, cost: above / below, lgRmse: Math.sqrt(squares / positive), count };
}
