// A point of the curve dragged to where it should be: the values that are not held move as little as they can.
//
// With J the derivatives of ln f by the scaled values at the measured directions, g those at the dragged point, and d the
// change of ln f that is wanted there, the step is the s of least |J s|^2 + lambda |s|^2 with g s = d:
//     s = d A^-1 g / (g A^-1 g),    A = J'J + lambda.

import { detector, inPlane, light } from "gonio/angles.js";
import { cellsShown, valuesOf } from "gonio/compute.js";
import { extensions, factor } from "gonio/curves.js";
import { element } from "gonio/elements.js";
import { linear } from "gonio/weights.js";
import { number } from "gonio/words.js";

const STEP = 1e-4; // of a value, for differences
const DAMPED = 1e-3; // of the mean of the diagonal of J'J
const MOST = 160; // directions elsewhere that are looked at
const FARTHEST = 1.0; // change of ln f in one step: beyond it a straight line is no guide
const ROUNDS = 6;
const NEAR = 0.05; // of ln f: farther from the pointer the page says so
const REACH = 25; // px from the pointer to a curve

export function mount(root, store, actions) {
  const toggle = element("input", { type: "checkbox" });
  const label = element("label", { className: "drag" }, toggle, element("span", {}, "drag the curve"));
  label.title = "Drag a point of a curve: the parameters that are not held follow";
  const note = element("span", { className: "note", role: "status" });
  root.querySelector(".chips").after(element("div", { className: "tools" }, label, note));
  toggle.addEventListener("change", () => store.set({ dragging: toggle.checked }));

  // Move the curve of a cell at theta_r to a value; says what stands in the way.
  actions.drag = (cell, signed, target) => {
    const state = store.get();
    const before = state.values;
    const reached = dragged(state, cell, signed, target);
    if (reached.values !== before) store.set({ values: reached.values, follow: false });
    note.textContent = reached.why;
  };

  extensions.ready.push((plot, cells) => listen(plot, cells, store, actions));
  store.watch(["set", "model", "fit"], () => (note.textContent = ""));
  store.watch(["dragging"], ({ dragging }) => root.classList.toggle("dragging", dragging));

  root.addEventListener("keydown", (event) => {
    const state = store.get();
    if (!state.cursor || !["+", "-"].includes(event.key) || !event.target.matches?.(".plot")) return;
    event.preventDefault();
    const { cell, row } = state.cursor;
    const signed = state.sets[state.set].signed[row];
    const f = valueAt(state, cell, signed);
    actions.drag(cell, signed, event.key === "+" ? f * 1.02 : f / 1.02);
    note.textContent ||= `model ${number(valueAt(store.get(), cell, signed))}`;
  });
}

function listen(plot, cells, store, actions) {
  let held = null;
  const { over } = plot;
  const place = (event) => {
    const box = over.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  over.addEventListener("pointerdown", (event) => {
    const state = store.get();
    if (!state.dragging) return;
    const [left, top] = place(event);
    const signed = plot.posToVal(left, "x");
    const far = (cell) => Math.abs(plot.valToPos(valueAt(state, cell, signed) * factor(state, signed), "y") - top);
    const cell = cells.reduce((best, one) => (far(one) < far(best) ? one : best));
    if (!(far(cell) < REACH)) return;
    held = { cell, signed };
    over.setPointerCapture(event.pointerId);
    store.set({ cell });
  });
  over.addEventListener("pointermove", (event) => {
    if (!held) return;
    const state = store.get();
    const q = factor(state, held.signed);
    const target = plot.posToVal(place(event)[1], "y") / q;
    actions.drag(held.cell, held.signed, target);
  });
  const letGo = () => (held = null);
  over.addEventListener("pointerup", letGo);
  over.addEventListener("pointercancel", letGo);
}

export function valueAt(state, cell, signed) {
  return curve(state, cell, [[cell, point(state, cell, signed)]])(valuesOf(state, cell))[0];
}

const point = (state, cell, signed) => inPlane(signed, state.sets[state.set].cells[cell].phi_i);

// f at some places of the group of a cell, as a function of its values; other groups keep theirs.
function curve(state, cell, places) {
  const { module } = state.model;
  const { cells } = state.sets[state.set];
  return (values) => {
    const known = new Map();
    return places.map(([own, wr]) => {
      if (!known.has(own)) {
        const mixed = values.map((v, k) => (state.groups[k][own] === state.groups[k][cell] ? v : state.values[k][state.groups[k][own]]));
        const pre = module.pre(mixed);
        const wi = light(cells[own].theta_i, cells[own].phi_i);
        known.set(own, { mixed, pre, wi, inc: module.inc(mixed, pre, wi) });
      }
      const { mixed, pre, wi, inc } = known.get(own);
      return module.reflected(mixed, pre, inc, wi, wr);
    });
  };
}

// The values with which the curve of a cell is at theta_r as near to the target as they allow.
export function dragged(state, cell, signed, target) {
  const parameters = state.model.declaration.parameters;
  let free = parameters.map((_, k) => k).filter((k) => !state.locked.has(k));
  if (!free.length) return { values: state.values, why: "Every parameter is held." };
  if (!(target > 0)) return { values: state.values, why: "" };
  const here = [[cell, point(state, cell, signed)]];
  const elsewhere = others(state, cell);
  let values = valuesOf(state, cell);
  let why = "";
  for (let round = 0; round < ROUNDS && free.length; round++) {
    const at = curve(state, cell, [...here, ...elsewhere]);
    const now = at(values);
    const wanted = Math.min(Math.max(Math.log(target / now[0]), -FARTHEST), FARTHEST);
    if (!(now[0] > 0) || Math.abs(wanted) < 1e-4) break;
    const scales = free.map((k) => scaleOf(state, k, values[k]));
    const slopes = derivatives(at, values, free, scales, parameters);
    const step = stepTo(slopes, wanted);
    if (!step) {
      if (!round) return { values: state.values, why: "No parameter that is free moves the curve here." };
      break;
    }
    const next = values.slice();
    const stopped = [];
    free.forEach((k, n) => {
      const { lower, upper } = parameters[k];
      const asked = moved(values[k], step[n], scales[n], lower);
      next[k] = Math.min(Math.max(asked, lower), upper ?? Infinity);
      if (next[k] !== asked) stopped.push(k);
    });
    // What met its bound stays there, and the others go on.
    free = free.filter((k) => !stopped.includes(k));
    if (stopped.length) why = `At its bound: ${stopped.map((k) => parameters[k].name).join(", ")}.`;
    values = next;
  }
  const reached = curve(state, cell, here)(values)[0];
  if (!(Math.abs(Math.log(target / reached)) < NEAR)) why ||= "The curve goes no nearer.";
  return { values: state.values.map((own, k) => replaced(own, state.groups[k][cell], values[k])), why };
}

const replaced = (own, group, value) => (own[group] === value ? own : own.map((v, g) => (g === group ? value : v)));

// What a value must change by to matter: a part of itself, or of its range where it is zero.
function scaleOf(state, k, value) {
  const { lower, upper, weight } = state.model.declaration.parameters[k];
  if (isRatio(value, lower)) return value;
  return weight ? 1e-3 * (state.ranges[k] ?? 1) : 0.25 * (upper - lower);
}

// Positive values move by ratios, so that no step meets zero.
const isRatio = (value, lower) => value > 0 && lower >= 0;

const moved = (value, step, scale, lower) => (isRatio(value, lower) ? value * Math.exp(step) : value + step * scale);

// d ln f by the scaled values, at every place: one column for each free value.
function derivatives(at, values, free, scales, parameters) {
  return free.map((k, n) => {
    const { lower, upper } = parameters[k];
    const up = Math.min(values[k] + STEP * scales[n], upper ?? Infinity);
    const down = Math.max(values[k] - STEP * scales[n], lower);
    const [above, below] = [up, down].map((v) => at(values.map((other, j) => (j === k ? v : other))));
    return above.map((f, row) => {
      const slope = ((Math.log(f) - Math.log(below[row])) * scales[n]) / (up - down);
      return Number.isFinite(slope) ? slope : 0;
    });
  });
}

function stepTo(slopes, wanted) {
  const g = slopes.map((column) => column[0]);
  const product = (a, b) => a.reduce((sum, v, row) => (row ? sum + v * b[row] : sum), 0) / Math.max(a.length - 1, 1);
  const matrix = slopes.map((a) => slopes.map((b) => product(a, b)));
  const damping = DAMPED * (matrix.reduce((sum, row, k) => sum + row[k], 0) / g.length) + 1e-12;
  matrix.forEach((row, k) => (row[k] += damping));
  const solved = linear(matrix, g);
  const length = solved?.reduce((sum, v, k) => sum + v * g[k], 0);
  return length > 1e-12 ? solved.map((v) => (wanted * v) / length) : null;
}

// Directions of the block that should change little: the measured ones of which values count, evenly chosen.
function others(state, cell) {
  const set = state.sets[state.set];
  const shares = (own) => state.groups.some((groups) => groups[own] === groups[cell]);
  const places = [];
  for (const own of cellsShown(state).filter(shares)) {
    const { start, end, phi_i } = set.cells[own];
    for (let row = start; row < end; row++) if (set.weight[row] > 0) places.push([own, detector(set.theta_r[row], set.phi[row], phi_i)]);
  }
  const every = Math.max(1, Math.ceil(places.length / MOST));
  return places.filter((_, k) => k % every === 0);
}
