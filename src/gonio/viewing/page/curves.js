// Curves in the plane of incidence: measured values with bars, the model with its band, residuals below.

import uPlot from "gonio/vendor/uplot.js";

import { cosine } from "gonio/angles.js";
import { axisX, axisY, frame, segment } from "gonio/axes.js";
import { colour, dark, dashes, ofStyle } from "gonio/colours.js";
import { cellsShown } from "gonio/compute.js";
import { anew, element } from "gonio/elements.js";
import { cellLabel, number, QUANTITIES, shownOf, valueLabel } from "gonio/words.js";

const MOST = 6; // curves that are drawn at first
const FARTHEST = 400; // %, of residuals that are drawn
const HEIGHT = { above: 300, below: 150 };

// Cells that have more than one value in the plane of incidence.
export const drawable = (state) => cellsShown(state).filter((k) => state.sets[state.set].cells[k].in_plane > 1);

// Those that are drawn at first: MOST of them, evenly chosen.
function shownAtFirst(cells) {
  if (cells.length <= MOST) return cells;
  return Array.from({ length: MOST }, (_, k) => cells[Math.round((k * (cells.length - 1)) / (MOST - 1))]);
}

export function hiddenAtFirst(state) {
  const cells = drawable(state);
  const kept = shownAtFirst(cells);
  return new Set(cells.filter((cell) => !kept.includes(cell)));
}

// What other modules draw on the curves, and how they listen to them: draw(plot, state, cells), ready(plot, cells).
export const extensions = { draw: [], ready: [] };

// The place of a cell among the colours: those that are drawn at first have the first.
export function colourOf(state, cell) {
  const cells = drawable(state);
  return [...new Set([...shownAtFirst(cells), ...cells])].indexOf(cell);
}

export function mount(root, store) {
  const chips = element("div", { className: "chips", role: "group", ariaLabel: "Incidence angles" });
  const above = element("div", { className: "plot", tabIndex: 0, role: "img" });
  const below = element("div", { className: "plot" });
  const note = element("p", { className: "note" });
  const table = element("details", { className: "table" }, element("summary", {}, "As a table"));
  root.append(chips, above, below, note, table);
  let plots = [];
  let drawn = []; // the cells that the plots have curves for

  function rebuild(state) {
    for (const plot of plots) plot.destroy();
    plots = [];
    const cells = drawable(state).filter((k) => !state.hidden.has(k));
    drawn = cells;
    showChips(state);
    if (!cells.length || !state.result) {
      above.ariaLabel = "No curve in the plane of incidence is shown";
      note.textContent = drawable(state).length ? "" : "No curve lies in the plane of incidence: see the hemisphere.";
      return;
    }
    const width = root.clientWidth - 2;
    const data = columnsOf(state, cells);
    plots.push(new uPlot(valuesPlot(state, cells, width, data), data.values, above));
    plots.push(new uPlot(residualsPlot(state, cells, width), data.residuals, below));
    above.ariaLabel = described(state, cells);
    note.textContent = said(state, cells, data);
    if (table.open) showTable(state, cells);
  }

  function redraw(state) {
    const cells = drawable(state).filter((k) => !state.hidden.has(k));
    if (!plots.length || cells.join() !== drawn.join()) return rebuild(state);
    const data = columnsOf(state, cells);
    plots[0].setData(data.values, false);
    plots[0].redraw();
    plots[1].setData(data.residuals);
    note.textContent = said(state, cells, data);
    if (table.open) showTable(state, cells);
  }

  function showChips(state) {
    const set = state.sets[state.set];
    const made = drawable(state).map((cell) => {
      const chip = element("button", { type: "button", className: "chip" }, cellLabel(set, cell));
      chip.ariaPressed = String(!state.hidden.has(cell));
      chip.style.setProperty("--own", colour(colourOf(state, cell)));
      chip.addEventListener("click", () => toggle(cell));
      return chip;
    });
    anew(chips, () => chips.replaceChildren(element("span", {}, "θᵢ"), ...made));
  }

  function toggle(cell) {
    const hidden = new Set(store.get().hidden);
    if (!hidden.delete(cell)) hidden.add(cell);
    store.set({ hidden, cell: hidden.has(cell) ? store.get().cell : cell });
  }

  function showTable(state, cells) {
    table.replaceChildren(table.firstChild, tableOf(state, cells));
  }

  // The measured value that is read: the next one, or that of the next curve.
  above.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    const state = store.get();
    const cells = drawable(state).filter((k) => !state.hidden.has(k));
    if (!cells.length || (!step && !["ArrowUp", "ArrowDown"].includes(event.key))) return;
    event.preventDefault();
    const set = state.sets[state.set];
    let { cell, row } = state.cursor ?? { cell: cells[0], row: set.cells[cells[0]].start - 1 };
    if (step) row = Math.min(Math.max(row + step, set.cells[cell].start), set.cells[cell].start + set.cells[cell].in_plane - 1);
    else {
      const next = cells[(cells.indexOf(cell) + (event.key === "ArrowUp" ? 1 : cells.length - 1)) % cells.length];
      row = nearest(set, next, set.signed[Math.max(row, set.cells[cell].start)]);
      cell = next;
    }
    store.set({ cursor: { cell, row }, cell });
  });

  store.watch(["set", "block", "hidden", "scale", "quantity", "theme", "width", "pair"], rebuild);
  store.watch(["result", "cursor", "tableOpen"], redraw);
  // In the next frame: until then the curves may be those of what was shown before.
  table.addEventListener("toggle", () => store.set({ tableOpen: table.open }));
  new ResizeObserver(() => store.set({ width: root.clientWidth })).observe(root);
  dark.addEventListener("change", () => store.set({ theme: dark.matches }));

  function valuesPlot(state, cells, width, data) {
    const series = [{}];
    const bands = [];
    cells.forEach((cell) => {
      const own = colour(colourOf(state, cell));
      const line = { stroke: own, width: 1.8, dash: dashes(colourOf(state, cell)), points: { show: false } };
      series.push({ stroke: own, width: 0, paths: () => null, points: { show: true, size: 5, fill: own, width: 0 } });
      series.push({ ...line, spanGaps: true });
      series.push({ ...line, width: 0, spanGaps: true }, { ...line, width: 0, spanGaps: true });
      const last = series.length - 1;
      bands.push({ series: [last, last - 1], fill: `${own}33` });
    });
    return {
      ...frame(width, HEIGHT.above, [axisX(), axisY(valueLabel(state), state.scale === "log")]),
      series,
      bands,
      scales: { x: { time: false, range: [-90, 90] }, y: { distr: state.scale === "log" ? 3 : 1, range: data.range } },
      hooks: {
        draw: [decorate, ...extensions.draw].map((call) => (plot) => call(plot, store.get(), cells)),
        ready: [pick, ...extensions.ready].map((call) => (plot) => call(plot, cells)),
      },
    };
  }

  function residualsPlot(state, cells, width) {
    const series = [{}];
    for (const cell of cells) {
      const own = colour(colourOf(state, cell));
      series.push({ stroke: own, width: 1, points: { show: true, size: 4, fill: own, width: 0 }, spanGaps: true });
    }
    return {
      ...frame(width, HEIGHT.below, [axisX("θᵣ [deg], positive is forward"), axisY("residual [%]", false, 18)]),
      series,
      scales: { x: { time: false, range: [-90, 90] }, y: { range: (_, low, high) => around(low, high) } },
      hooks: { draw: [zero] },
    };
  }

  // A click reads the nearest value.
  function pick(plot, cells) {
    plot.over.addEventListener("click", (event) => {
      const state = store.get();
      const set = state.sets[state.set];
      const box = plot.over.getBoundingClientRect();
      const [left, top] = [event.clientX - box.left, event.clientY - box.top];
      let best = null;
      for (const cell of cells) {
        const { start, in_plane } = set.cells[cell];
        for (let row = start; row < start + in_plane; row++) {
          const y = transformed(state, row, set.value[row]);
          const far = Math.hypot(plot.valToPos(set.signed[row], "x") - left, plot.valToPos(y, "y") - top);
          if (far < (best?.far ?? 30)) best = { far, cell, row };
        }
      }
      if (best) store.set({ cursor: { cell: best.cell, row: best.row }, cell: best.cell });
    });
  }
}

export const factor = (state, signed) => QUANTITIES[state.quantity].factor(cosine(signed));

export const transformed = (state, row, f) => f * factor(state, state.sets[state.set].signed[row]);

// What uPlot draws: theta_r, and for each cell measured values, the curve and the ends of its band.
function columnsOf(state, cells) {
  const set = state.sets[state.set];
  const curves = cells.map((cell) => state.result.curves.get(cell));
  const x = Float64Array.from(new Set(curves.flatMap((c) => [...c.x]))).sort();
  const place = new Map(Array.from(x, (t, k) => [t, k]));
  const [values, residuals, seen] = [[x], [x], []];
  const shown = (v) => (Number.isFinite(v) && (state.scale !== "log" || v > 0) ? v : null);
  cells.forEach((cell, n) => {
    const measured = Array(x.length).fill(null);
    const ratio = Array(x.length).fill(null);
    const line = Array(x.length).fill(null);
    const [low, high] = [line.slice(), line.slice()];
    const { start, in_plane } = set.cells[cell];
    for (let row = start; row < start + in_plane; row++) {
      const k = place.get(set.signed[row]);
      measured[k] = shown(transformed(state, row, set.value[row]));
      const second = shown(transformed(state, row, state.pair?.value[row] ?? NaN));
      const top = state.scale === "log" ? NaN : transformed(state, row, set.value[row] + set.uncertainty[row]);
      seen.push(...[measured[k], second, top].filter((v) => v !== null && Number.isFinite(v)));
      const modelled = state.result.modelled?.[row];
      if (set.value[row] > 0 && Number.isFinite(modelled)) ratio[k] = 100 * (modelled / set.value[row] - 1);
    }
    const { f, half: widths } = curves[n];
    curves[n].x.forEach((t, j) => {
      const k = place.get(t);
      const q = factor(state, t);
      line[k] = shown(f[j] * q);
      const half = widths ? widths[j] : NaN;
      high[k] = shown((f[j] + half) * q); // nothing where it is infinite
      low[k] = Number.isFinite(half) ? shown(Math.max((f[j] - half) * q, state.scale === "log" ? f[j] * q * 1e-3 : -Infinity)) : null;
    });
    values.push(measured, line, low, high);
    residuals.push(ratio);
  });
  return { values, residuals, range: rangeOf(state, seen) };
}

// Of the measured values, with some room: it stays while a slider moves the curve.
function rangeOf(state, seen) {
  const low = seen.reduce((a, b) => Math.min(a, b), Infinity);
  const high = seen.reduce((a, b) => Math.max(a, b), -Infinity);
  if (!seen.length) return state.scale === "log" ? [1e-3, 1] : [0, 1];
  if (state.scale === "log") return [low / 2, high * 2];
  return [Math.min(0, low), high + 0.08 * (high - Math.min(0, low))];
}

function around(low, high) {
  const far = Math.min(Math.max(Math.abs(low ?? 0), Math.abs(high ?? 0), 1) * 1.1, FARTHEST);
  return [-far, far];
}

// Bars of standard uncertainty, the mirror directions, and the value that is read.
function decorate(plot, state, cells) {
  const set = state.sets[state.set];
  const { ctx } = plot;
  const { left, top, width, height } = plot.bbox;
  ctx.save();
  ctx.beginPath();
  ctx.rect(left, top, width, height);
  ctx.clip();
  for (const cell of cells) {
    ctx.strokeStyle = colour(colourOf(state, cell));
    const x = plot.valToPos(set.cells[cell].theta_i, "x", true);
    ctx.globalAlpha = 0.5;
    ctx.setLineDash([2, 4]);
    segment(ctx, x, top, x, top + height);
    ctx.setLineDash([]);
    ctx.globalAlpha = 0.8;
    const { start, in_plane } = set.cells[cell];
    for (let row = start; row < start + in_plane; row++) {
      const [value, u] = [set.value[row], set.uncertainty[row]];
      if (!(u > 0) || (state.scale === "log" && !(value > 0))) continue;
      const ends = [value - u, value + u].map((v) => transformed(state, row, v));
      const low = state.scale === "log" && ends[0] <= 0 ? plot.scales.y.min : ends[0];
      const across = plot.valToPos(set.signed[row], "x", true);
      segment(ctx, across, plot.valToPos(low, "y", true), across, plot.valToPos(ends[1], "y", true));
    }
  }
  if (state.cursor && cells.includes(state.cursor.cell)) {
    const { row } = state.cursor;
    ctx.globalAlpha = 1;
    ctx.strokeStyle = ofStyle("text");
    ctx.lineWidth = 2;
    ctx.beginPath();
    const y = plot.valToPos(transformed(state, row, set.value[row]), "y", true);
    ctx.arc(plot.valToPos(set.signed[row], "x", true), y, 6 * devicePixelRatio, 0, 2 * Math.PI);
    ctx.stroke();
  }
  ctx.restore();
}

function zero(plot) {
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.strokeStyle = ofStyle("text");
  const y = plot.valToPos(0, "y", true);
  segment(ctx, bbox.left, y, bbox.left + bbox.width, y);
  ctx.restore();
}

// The row of a cell whose theta_r is nearest.
function nearest(set, cell, signed) {
  const { start, in_plane } = set.cells[cell];
  let best = start;
  for (let row = start; row < start + in_plane; row++) {
    if (Math.abs(set.signed[row] - signed) < Math.abs(set.signed[best] - signed)) best = row;
  }
  return best;
}

function said(state, cells, data) {
  const set = state.sets[state.set];
  const parts = [];
  const rows = cells.flatMap((c) => Array.from({ length: set.cells[c].in_plane }, (_, k) => set.cells[c].start + k));
  if (rows.some((row) => set.uncertainty[row] > 0)) parts.push("Bars: standard uncertainty of the measured value.");
  const isOf = (mode) => cells.some((cell) => set.cells[cell].reflected === (mode === "reflection"));
  if (isOf("transmission")) parts.push("Models describe reflection: of light that went through the values alone are drawn.");
  if (isOf("reflection")) parts.push("Below: model over measured value, less 1.");
  const beyond = data.residuals.slice(1).flat().filter((v) => v !== null && Math.abs(v) > FARTHEST).length;
  if (beyond) parts.push(`${beyond} residuals lie beyond ${FARTHEST} %.`);
  const widths = cells.map((cell) => state.result.curves.get(cell).half).filter(Boolean);
  if (widths.some((half) => half.some(Number.isFinite))) parts.push("Band: 95 % of the fitted curve.");
  if (widths.some((half) => half.includes(Infinity))) parts.push("No band where a value takes part that the data do not determine.");
  const lost = state.scale === "log" ? rows.filter((row) => !(set.value[row] > 0)).length : 0;
  if (lost) parts.push(`${lost} of ${rows.length} values are zero or negative: a logarithmic scale has no place for them.`);
  if (shownOf(set)) parts.push(shownOf(set));
  if (state.fit?.cones) parts.push("The fit averages over the cones of the instrument; the curve does not.");
  return parts.join(" ");
}

function described(state, cells) {
  const set = state.sets[state.set];
  const angles = cells.map((cell) => cellLabel(set, cell)).join(", ");
  return `${valueLabel(state)} over theta_r for theta_i ${angles}. The arrow keys read it value by value.`;
}

function tableOf(state, cells) {
  const set = state.sets[state.set];
  const heads = ["θᵢ [deg]", "θᵣ [deg]", valueLabel(state), "standard uncertainty", "model"];
  const rows = cells.flatMap((cell) => {
    const { start, in_plane, theta_i } = set.cells[cell];
    return Array.from({ length: in_plane }, (_, k) => start + k).map((row) => {
      const q = factor(state, set.signed[row]);
      const modelled = state.result.modelled ? state.result.modelled[row] * q : NaN;
      return [theta_i, set.signed[row], set.value[row] * q, set.uncertainty[row] * q, modelled];
    });
  });
  const cellsOf = (row) => row.map((v) => element("td", {}, number(v, 5)));
  return element(
    "div",
    { className: "scroll", tabIndex: 0, role: "region", ariaLabel: "Plotted numbers" },
    element(
      "table",
      {},
      element("thead", {}, element("tr", {}, ...heads.map((h) => element("th", { scope: "col" }, h)))),
      element("tbody", {}, ...rows.map((row) => element("tr", {}, ...cellsOf(row)))),
    ),
  );
}
