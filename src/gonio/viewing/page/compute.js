// What the model gives: curves in the plane of incidence, values at the measured directions, and how well they agree.

import { detector, inPlane, light } from "gonio/angles.js";
import { halfWidth } from "gonio/band.js";

const STEP = 0.5; // deg, of the curves
const MOST = 20000; // values of which the agreement is computed at each move of a slider
const SMALLEST = 2 ** -1022; // what a model that is zero counts as in a logarithm, as for gonio

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

// A function of directions for one cell: unit vectors to the light and to the detector. Models describe reflection: of
// light that went through they say nothing.
export function evaluator(state, cell) {
  if (!state.sets[state.set].cells[cell].reflected) return () => () => NaN;
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
    curves.set(cell, { x, f, half: halfWidth(state, cell, x, f) });
  }
  return { curves, ...compared(state, shown) };
}

// Model and data over the whole scan; of one with too many values over what is shown, and of that the curves alone.
function compared(state, shown) {
  const { cells } = state.sets[state.set];
  const countOf = (some) => some.reduce((n, c) => n + cells[c].end - cells[c].start, 0);
  const all = cells.map((_, k) => k).filter((k) => cells[k].reflected);
  const [block, drawn] = [shown, shown.filter((cell) => !state.hidden.has(cell))].map((some) => some.filter((k) => all.includes(k)));
  const over = [all, block, drawn].find((some) => countOf(some) <= MOST) ?? drawn;
  const modelled = atRows(state, over);
  const found = { modelled, count: countOf(over), part: { isAll: over === all, isBlock: over === block } };
  return { ...found, ...agreement(state, over, modelled) };
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

// What each value counts for, below which value a logarithm says nothing, and whether logarithms are compared: as the
// fit has them, else as gonio takes them for the scan.
export function weighing(state) {
  const set = state.sets[state.set];
  const { weighting, logarithmic, floor, weight } = { ...set, ...(state.fit?.weighting ? state.fit : {}) };
  return { weighting, logarithmic, floor, weight: weight ?? set.weight };
}

// E as the fit has it (guo2023, eq 11, or of logarithms), and the rms difference of decimal logarithms.
function agreement(state, cells, modelled) {
  const set = state.sets[state.set];
  const { logarithmic, floor, weight } = weighing(state);
  let [above, below, squares, positive] = [0, 0, 0, 0];
  for (const cell of cells) {
    for (let k = set.cells[cell].start; k < set.cells[cell].end; k++) {
      const [m, f, g] = [set.value[k], modelled[k], weight[k]];
      if (logarithmic) {
        above += g * Math.log(Math.max(f, SMALLEST) / m) ** 2;
        below += g;
      } else {
        above += g * (f - m) ** 2;
        below += g * m * m;
      }
      if (m > 0) {
        squares += Math.log10(Math.max(f, floor) / Math.max(m, floor)) ** 2;
        positive += 1;
      }
    }
  }
  return { cost: above / below, lgRmse: Math.sqrt(squares / positive) };
}
