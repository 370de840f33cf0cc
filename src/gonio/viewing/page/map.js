// The hemisphere from above: measured values, the model, and their ratio, or that of two scans that are compared.

import { cosine, detector, light } from "gonio/angles.js";
import { dark } from "gonio/colours.js";
import { cellsShown, evaluator, isReady } from "gonio/compute.js";
import { element, oneOf } from "gonio/elements.js";
import { excuse, settling } from "gonio/gl.js";
import { decorate, ground, paintFunction, paintPoints, placeOf } from "gonio/hemisphere.js";
import { aboutTable, hasTable, measured, modelled } from "gonio/modelled.js";
import { bar, DIVERGING, drawBar, rangeOf, scaleOf, SEQUENTIAL } from "gonio/palette.js";
import { cellLabel, measuredWord, number, QUANTITIES, shownOf, valueLabel } from "gonio/words.js";

const MARGIN = { side: 32, top: 22, bottom: 20 };
const LARGEST = 400; // CSS pixels of a hemisphere
const RATIOS = [1.02, 1.05, 1.1, 1.2, 1.5, 2, 3, 5, 10, 30, 100]; // ends of the scale of ratios
const STEPS = { theta: 15, phi: 24 }; // of the hemisphere where the range of the model is looked for
const MOST = 2e5; // values of which the ratio is drawn

const VIEWS = [["both", "both"], ["data", "data"], ["model", "model"], ["ratio", "ratio"]];

export function mount(root, store) {
  const canvas = element("canvas", { role: "img", className: "hemisphere" });
  const ctx = canvas.getContext("2d");
  const cells = element("select", {});
  const row = element("input", { type: "range", step: 1 });
  const colours = bar();
  const note = element("p", { className: "note" });
  const wrong = element("p", { className: "warning" });
  const views = oneOf("what the hemisphere shows", "map-view", VIEWS, "both", (view) => store.set({ mapView: view }));
  const compared = oneOf("compared", "map-view", [["difference", "second to first"]], "", (view) => store.set({ mapView: view }));
  root.append(
    element("div", { className: "row" }, views, compared),
    element("label", { className: "choice" }, element("span", {}, "incidence"), cells),
    canvas,
    colours,
    element("label", { className: "choice" }, element("span", {}, "direction"), row),
    wrong,
    note,
  );
  store.set({ mapView: "both" });
  let boxes = [];

  cells.addEventListener("change", () => {
    const cell = Number(cells.value);
    const hidden = new Set(store.get().hidden);
    hidden.delete(cell);
    store.set({ cell, hidden, cursor: null });
  });
  row.addEventListener("input", () => read(Number(row.value)));

  function read(place) {
    const { cell } = store.get();
    store.set({ cursor: { cell, row: place } });
  }

  // A click reads the nearest direction that was measured.
  canvas.addEventListener("click", (event) => {
    const state = store.get();
    const set = state.sets[state.set];
    const dpr = canvas.width / canvas.clientWidth;
    const [x, y] = [event.offsetX * dpr, event.offsetY * dpr];
    const box = boxes.find((b) => x >= b.x - 9 && x <= b.x + b.width + 9);
    if (!box) return;
    const [u, v] = [(2 * (x - box.x)) / box.width - 1, 1 - (2 * (y - box.y)) / box.height];
    let best = { far: Infinity, place: -1 };
    for (const place of rowsOf(set, state.cell)) {
      const [a, b] = placeOf(set.theta_r[place], set.phi[place]);
      const far = Math.hypot(a - u, b - v);
      if (far < best.far) best = { far, place };
    }
    if (best.place >= 0) read(best.place);
  });

  function controls(state) {
    const set = state.sets[state.set];
    if (!set.cells) return;
    const shown = cellsShown(state);
    cells.replaceChildren(...shown.map((k) => element("option", { value: String(k) }, `θᵢ ${cellLabel(set, k)}`)));
    compared.hidden = !state.difference;
    if (state.mapView === "difference" && !state.difference) store.set({ mapView: "both" });
    for (const input of root.querySelectorAll("input[name=map-view]")) input.checked = input.value === state.mapView;
  }

  function draw(coarse) {
    const state = store.get();
    const width = Math.floor(root.clientWidth);
    if (!width || !isReady(state)) return;
    const set = state.sets[state.set];
    const shown = drawnOf(state);
    cells.value = String(state.cell);
    row.min = set.cells[state.cell].start;
    row.max = set.cells[state.cell].end - 1;
    row.value = state.cursor?.cell === state.cell ? state.cursor.row : row.min;
    row.ariaValueText = directionLabel(set, Number(row.value));
    boxes = laidOut(canvas, width, shown.views.length);
    wrong.textContent = excuse(state.graphics);
    const cursor = state.cursor?.cell === state.cell ? [set.theta_r[state.cursor.row], set.phi[state.cursor.row]] : null;
    shown.views.forEach((view, n) => {
      ground(ctx, boxes[n]);
      try {
        if (state.graphics > 0 && shown.scale) paintView(ctx, boxes[n], state, view, shown, coarse);
      } catch (error) {
        wrong.textContent = error.message;
      }
      decorate(ctx, boxes[n], set.cells[state.cell].theta_i, TITLES[view], cursor);
    });
    if (!coarse) describe(state, shown, width);
  }

  function describe(state, shown, width) {
    const said = words(state, shown);
    canvas.ariaLabel = said;
    const drawn = shown.views.includes("data") && hasTable(state) ? "Data: the cell of the table in each direction." : "";
    note.textContent = [said, shownOf(state.sets[state.set]), drawn, aboutTable(state)].filter(Boolean).join(" ");
    colours.hidden = !shown.scale;
    if (!shown.scale) return;
    Object.assign(shown.scale, beyond(state, shown));
    drawBar(colours, shown.scale, shown.label, Math.min(width, LARGEST));
  }

  const redraw = settling(draw);
  store.watch(["set", "block", "sets", "difference", "mapView"], controls);
  store.watch(
    ["set", "sets", "block", "cell", "values", "groups", "model", "shader", "scale", "quantity", "theme", "graphics", "mapView", "difference", "tables"],
    redraw,
  );
  store.watch(["cursor"], () => draw(false));
  new ResizeObserver(() => draw(false)).observe(root);
  dark.addEventListener("change", () => draw(false));
}

const TITLES = { data: "data", model: "model", ratio: "model over data", difference: "second over first scan" };

const rowsOf = (set, cell) => Array.from({ length: set.cells[cell].end - set.cells[cell].start }, (_, k) => set.cells[cell].start + k);

const directionLabel = (set, row) => `θᵣ ${number(set.theta_r[row])}°, φ ${number(set.phi[row])}°`;

// The canvas as wide as its section, and the boxes [device pixels] of one view or two.
function laidOut(canvas, width, count) {
  const dpr = window.devicePixelRatio || 1;
  const across = Math.max(60, Math.min(LARGEST, Math.floor(width / count) - 2 * MARGIN.side));
  const height = across + MARGIN.top + MARGIN.bottom;
  canvas.width = Math.round(width * dpr);
  canvas.height = Math.round(height * dpr);
  canvas.style.width = `${width}px`;
  canvas.style.height = `${height}px`;
  const size = Math.round(across * dpr);
  return Array.from({ length: count }, (_, n) => {
    const x = Math.round((MARGIN.side + n * (across + 2 * MARGIN.side)) * dpr);
    return { x, y: Math.round(MARGIN.top * dpr), width: size, height: size };
  });
}

// What is drawn: which views, the rows and their values, and the scale of colours.
function drawnOf(state) {
  const set = state.sets[state.set];
  const rows = rowsOf(set, state.cell);
  if (state.mapView === "ratio") return { views: ["ratio"], rows, ...ratios(rows.map((k) => modelAt(state, k) / set.value[k]), "model over measured value") };
  if (state.mapView === "difference") return { views: ["difference"], rows, ...ratios(rows.map((k) => state.difference[k] / set.value[k]), "second over first scan") };
  const { factor } = QUANTITIES[state.quantity];
  const values = rows.map((k) => set.value[k] * factor(cosine(set.theta_r[k])));
  const range = rangeOf(values, state.scale === "log");
  const scale = range && scaleOf(...range, state.scale === "log", SEQUENTIAL);
  const views = state.mapView === "both" ? ["data", "model"] : [state.mapView];
  return { views, rows, values, scale, label: valueLabel(state) };
}

// Ratios about 1, on a scale that is symmetric in their logarithms.
function ratios(found, label) {
  const values = found.map((v) => (v > 0 && Number.isFinite(v) ? v : NaN));
  const far = values.filter(Number.isFinite).map((v) => Math.exp(Math.abs(Math.log(v)))).sort((a, b) => a - b);
  if (!far.length) return { values, scale: null, label };
  const end = RATIOS.find((r) => r >= far[Math.floor(0.98 * (far.length - 1))]) ?? RATIOS.at(-1);
  const near = Math.sqrt(end);
  const ticks = [1 / end, 1 / near, 1, near, end].map((v) => [v, number(v, 3)]);
  return { values, scale: scaleOf(1 / end, end, true, DIVERGING, { ticks }), label };
}

function modelAt(state, row) {
  const known = state.result?.modelled?.[row];
  if (known !== undefined && !Number.isNaN(known)) return known;
  const set = state.sets[state.set];
  if (set.value.length > MOST) return NaN;
  const { theta_i, phi_i } = set.cells[state.cell];
  return evaluator(state, state.cell)(light(theta_i, phi_i))(detector(set.theta_r[row], set.phi[row], phi_i));
}

function paintView(ctx, box, state, view, { rows, values, scale }, coarse) {
  const set = state.sets[state.set];
  const cell = set.cells[state.cell];
  const factor = [state.quantity === "pif" ? Math.PI : 1, state.quantity === "fcos" ? 1 : 0];
  const table = view === "data" ? measured(state, cell.block) : null;
  const what = view === "model" ? modelled(state, state.cell, coarse) : table;
  if (what) paintFunction(ctx, box, what, scale, cell, factor, coarse);
  else if (view !== "model") paintPoints(ctx, box, set, rows, values, scale);
}

// The range of the model over the hemisphere, and where it is largest.
function modelRange(state) {
  const { theta_i, phi_i } = state.sets[state.set].cells[state.cell];
  const at = evaluator(state, state.cell)(light(theta_i, phi_i));
  const { factor } = QUANTITIES[state.quantity];
  const found = { low: Infinity, high: -Infinity, theta: 0, phi: 0 };
  const thetas = [...Array.from({ length: STEPS.theta }, (_, k) => (88 * k) / (STEPS.theta - 1)), theta_i];
  for (const theta of thetas) {
    for (let phi = 0; phi < 360; phi += 360 / STEPS.phi) {
      const f = at(detector(theta, phi, phi_i)) * factor(cosine(theta));
      if (f < found.low) found.low = f;
      if (f > found.high) Object.assign(found, { high: f, theta, phi });
    }
  }
  return found;
}

// Whether anything that is shown lies beyond the ends of the scale.
function beyond(state, { views, values, scale }) {
  const shown = values.slice();
  if (views.includes("model")) {
    const { low, high } = modelRange(state);
    shown.push(low, high);
  }
  const places = shown.map(scale.place);
  return { below: places.some((p) => p < -1e-9), above: places.some((p) => p > 1 + 1e-9) };
}

// What is seen, in numbers.
function words(state, { views, rows, values, label }) {
  const set = state.sets[state.set];
  const where = `θᵢ ${cellLabel(set, state.cell)}`;
  let best = -1;
  values.forEach((v, n) => {
    if (Number.isFinite(v) && (best < 0 || v > values[best])) best = n;
  });
  if (best < 0) return `${where}: no value to draw.`;
  const low = values.reduce((a, v) => (v < a ? v : a), Infinity);
  const at = `largest at ${directionLabel(set, rows[best])}`;
  if (views[0] === "ratio" || views[0] === "difference") {
    return `${where}: ${label} from ${number(low, 3)} to ${number(values[best], 3)} at ${rows.length} directions, ${at}.`;
  }
  const parts = [];
  if (views.includes("data")) parts.push(`${measuredWord(set)} ${number(low, 3)} to ${number(values[best], 3)} at ${rows.length} directions, ${at}`);
  if (views.includes("model")) {
    const { low: least, high, theta, phi } = modelRange(state);
    parts.push(`model ${number(least, 3)} to ${number(high, 3)}, largest near θᵣ ${number(theta, 3)}°, φ ${number(phi, 3)}°`);
  }
  const lost = state.scale === "log" ? values.filter((v) => v <= 0).length : 0;
  const said = lost ? ` Zero or negative values, of which there are ${lost}, have the lowest colour.` : "";
  return `${where}, ${label}: ${parts.join("; ")}.${said} The cross is the mirror direction, the small ring the light.`;
}
