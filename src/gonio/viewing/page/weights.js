// Exact weights for the shape that the sliders have: non-negative least squares, as gonio fits them.

import { detector, light } from "gonio/angles.js";
import { valuesOf } from "gonio/compute.js";

const ROUNDS = 12; // of linearised logarithms: each halves the error at least

// Values with new weights, for each group of weights of the set; locked weights stay.
export function snapped(state) {
  const set = state.sets[state.set];
  const { weights, parameters } = state.model.declaration;
  const places = parameters.map((_, k) => k).filter((k) => weights.includes(parameters[k].name));
  const values = state.values.map((own) => own.slice());
  for (const cells of groupsOf(state, places, set.cells.length)) {
    const free = places.filter((k) => !state.locked.has(k));
    if (!free.length) continue;
    const rows = rowsOf(state, set, cells, places, free);
    const found = solved(rows, set.logarithmic, free.length);
    if (found) free.forEach((k, n) => (values[k][state.groups[k][cells[0]]] = found[n]));
  }
  return values;
}

// Cells that share the groups of all weights: their weights are found together.
function groupsOf(state, places, count) {
  const found = new Map();
  for (let cell = 0; cell < count; cell++) {
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
  return rows.filter(({ terms, g }) => g > 0 && terms.every(Number.isFinite));
}

// Logarithms are made linear about the last curve: ln f - ln m = (f - m)/f + .., so a row weighs 1/f^2.
function solved(rows, logarithmic, count) {
  let found = nonNegative(rows, rows.map(({ g, m }) => (logarithmic ? g / (m * m) : g)), rows.map((r) => r.m), count);
  if (!logarithmic || !found) return found;
  let best = cost(rows, found);
  for (let k = 0; k < ROUNDS; k++) {
    const f = rows.map((r) => total(r, found));
    const aim = rows.map((r, n) => f[n] * (1 - Math.log(f[n] / r.m)));
    const next = nonNegative(rows, rows.map(({ g }, n) => g / (f[n] * f[n])), aim, count);
    if (!next) break;
    const step = shortened(rows, found, next, best);
    if (!step || best - step.cost <= 1e-13 * best) break;
    [found, best] = [step.values, step.cost];
  }
  return found;
}

const total = (row, weights) => row.known + row.terms.reduce((sum, t, n) => sum + t * weights[n], 0);

const cost = (rows, weights) => rows.reduce((sum, r) => sum + r.g * Math.log(total(r, weights) / r.m) ** 2, 0);

// The whole step, or the part of it that does better.
function shortened(rows, from, to, before) {
  for (let part = 1; part > 1e-3; part /= 2) {
    const values = from.map((v, n) => v + part * (to[n] - v));
    const after = cost(rows, values);
    if (after < before) return { values, cost: after };
  }
  return null;
}

// Least squares of each subset of the terms: of those whose weights are positive the best. There are at most five terms.
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
      side[a] += weight[n] * terms[a] * (aim[n] - known);
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
