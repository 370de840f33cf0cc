// Exact weights for the shape that the sliders have: non-negative least squares, as gonio fits them.

import { detector, light } from "gonio/angles.js";
import { valuesOf, weighing } from "gonio/compute.js";

const ROUNDS = 40; // of steps towards the least error of logarithms: some six are enough
const LAST = 1e-6; // of the weights: a smaller step of Newton's method leaves an error of its square
const SMALLEST = 2 ** -1022; // what a model that is zero counts as in a logarithm, as for gonio

// Values with new weights, for each group of weights of the set; locked weights stay.
export function snapped(state) {
  const set = state.sets[state.set];
  const { logarithmic, weight } = weighing(state);
  const { weights, parameters } = state.model.declaration;
  const places = parameters.map((_, k) => k).filter((k) => weights.includes(parameters[k].name));
  const values = state.values.map((own) => own.slice());
  for (const cells of groupsOf(state, places, set.cells.length)) {
    const free = places.filter((k) => !state.locked.has(k));
    if (!free.length) continue;
    const rows = rowsOf(state, { ...set, weight }, cells, places, free);
    const found = solved(rows, logarithmic, free.length);
    if (found) free.forEach((k, n) => (values[k][state.groups[k][cells[0]]] = found[n]));
  }
  return values;
}

// Cells that share the groups of all weights: their weights are found together.
function groupsOf(state, places, count) {
  const found = new Map();
  for (let cell = 0; cell < count; cell++) {
    if (!state.sets[state.set].cells[cell].reflected) continue;
    const key = places.map((k) => state.groups[k][cell]).join();
    found.set(key, [...(found.get(key) ?? []), cell]);
  }
  return found.values();
}

// For each measured value: the terms of free weights, what the locked ones give, the value and its weight.
function rowsOf(state, set, cells, places, free) {
  const { module } = state.model;
  const rows = [];
  for (const cell of cells) {
    const values = valuesOf(state, cell);
    const { theta_i, phi_i, start, end } = set.cells[cell];
    const wi = light(theta_i, phi_i);
    const pre = module.termsPre(values);
    const inc = module.termsInc(values, pre, wi);
    for (let k = start; k < end; k++) {
      const terms = module.termsReflected(values, pre, inc, wi, detector(set.theta_r[k], set.phi[k], phi_i));
      const known = places.reduce((sum, p, n) => (free.includes(p) ? sum : sum + values[p] * terms[n]), 0);
      const own = places.map((p, n) => [p, terms[n]]).filter(([p]) => free.includes(p));
      rows.push({ terms: own.map(([, t]) => t), known, m: set.value[k], g: set.weight[k] });
    }
  }
  const tells = ({ terms, g }) => g > 0 && terms.every(Number.isFinite) && terms.some((t) => t !== 0);
  return rows.filter(tells);
}

// Where logarithms are compared, from the weights of least relative error down to those of the least error of logarithms.
function solved(rows, logarithmic, count) {
  const weight = rows.map(({ g, m }) => (logarithmic ? g / (m * m) : g));
  const found = nonNegative(rows, weight, rows.map(({ m }, n) => weight[n] * m), count);
  return logarithmic && found ? ofLogarithms(rows, raised(rows, found), count) : found;
}

// Newton's steps, which end in the last digits; where one leads upwards, a step of linearised logarithms.
function ofLogarithms(rows, start, count) {
  let found = start;
  let least = cost(rows, found);
  for (let k = 0; k < ROUNDS; k++) {
    const next = stepped(rows, found, count, true);
    if (next && found.every((v, n) => Math.abs(next[n] - v) <= LAST * Math.max(...next))) return next;
    const plain = () => shortened(rows, found, stepped(rows, found, count, false), least);
    const step = shortened(rows, found, next, least) ?? plain();
    if (!step) return found;
    [found, least] = [step.values, step.cost];
  }
  return found;
}

// With r = ln(f/m) and the relative step d of f: r^2 + 2 r d + (1 - r) d^2 by Newton, (r + d)^2 by linearised logarithms.
function stepped(rows, found, count, newton) {
  const f = rows.map((row) => total(row, found));
  const r = rows.map(({ m }, n) => Math.log(f[n] / m));
  const curvature = r.map((v) => (newton ? 1 - v : 1));
  const weight = rows.map(({ g }, n) => (g * curvature[n]) / f[n] ** 2);
  return nonNegative(rows, weight, rows.map(({ g }, n) => (g * (curvature[n] - r[n])) / f[n]), count);
}

// A model that is zero at a measured value has no logarithm there: its weights are then a little above zero.
function raised(rows, found) {
  const largest = Math.max(...found) || 1;
  return rows.every((row) => total(row, found) > SMALLEST) ? found : found.map((v) => Math.max(v, 1e-6 * largest));
}

const total = (row, weights) => Math.max(row.known + row.terms.reduce((sum, t, n) => sum + t * weights[n], 0), SMALLEST);

const cost = (rows, weights) => rows.reduce((sum, r) => sum + r.g * Math.log(total(r, weights) / r.m) ** 2, 0);

// The whole step, or the part of it that does better.
function shortened(rows, from, to, before) {
  for (let part = 1; to && part > 1e-3; part /= 2) {
    const values = from.map((v, n) => v + part * (to[n] - v));
    const after = cost(rows, values);
    if (after < before) return { values, cost: after };
  }
  return null;
}

// Least squares of each subset of the terms: of those whose weights are positive the best. There are at most five terms.
// weight: of each row; aim: the value that it aims at, times its weight.
function nonNegative(rows, weight, aim, count) {
  const [matrix, side] = normal(rows, weight, aim, count);
  let best = null;
  let least = Infinity;
  for (let subset = 0; subset < 1 << count; subset++) {
    const chosen = Array.from({ length: count }, (_, k) => k).filter((k) => subset & (1 << k));
    const x = linear(chosen.map((a) => chosen.map((b) => matrix[a][b])), chosen.map((a) => side[a]));
    if (!x || x.some((v) => v < 0)) continue;
    const error = -x.reduce((sum, v, n) => sum + v * side[chosen[n]], 0); // less a constant
    if (error < least) {
      least = error;
      best = Array(count).fill(0);
      chosen.forEach((k, n) => (best[k] = x[n]));
    }
  }
  return best;
}

function normal(rows, weight, aim, count) {
  const matrix = Array.from({ length: count }, () => Array(count).fill(0));
  const side = Array(count).fill(0);
  rows.forEach(({ terms, known }, n) => {
    for (let a = 0; a < count; a++) {
      side[a] += terms[a] * (aim[n] - weight[n] * known);
      for (let b = 0; b < count; b++) matrix[a][b] += weight[n] * terms[a] * terms[b];
    }
  });
  return [matrix, side];
}

// Gauss elimination with pivots on a scaled matrix; null where it is singular.
export function linear(matrix, side) {
  const n = side.length;
  const scale = matrix.map((row, k) => 1 / Math.sqrt(row[k]) || 0);
  const a = matrix.map((row, i) => [...row.map((v, j) => v * scale[i] * scale[j]), side[i] * scale[i]]);
  for (let c = 0; c < n; c++) {
    let p = c;
    for (let r = c + 1; r < n; r++) if (Math.abs(a[r][c]) > Math.abs(a[p][c])) p = r;
    if (!(Math.abs(a[p][c]) > 1e-13)) return null;
    [a[c], a[p]] = [a[p], a[c]];
    for (let r = 0; r < n; r++) {
      const ratio = r === c ? 0 : a[r][c] / a[c][c];
      for (let k = c; k <= n; k++) a[r][k] -= ratio * a[c][k];
    }
  }
  return a.map((row, k) => (row[n] / row[k]) * scale[k]);
}
