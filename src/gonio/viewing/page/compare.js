// A second scan beside the first: its values at the directions of the first, and how much they differ.

import uPlot from "gonio/vendor/uplot.js";

import { axisX, axisY, frame, segment } from "gonio/axes.js";
import { colour, ofStyle } from "gonio/colours.js";
import { colourOf, drawable, extensions, factor } from "gonio/curves.js";
import { anew, choice, element, oneOf } from "gonio/elements.js";
import { pair } from "gonio/source.js";
import { number, printable } from "gonio/words.js";

const HEIGHT = 150;
const KINDS = [["ratio", "ratio"], ["difference", "difference"]];

export function mount(panel, root, store) {
  const section = element("section", { className: "second" }, element("h2", {}, "Second scan"));
  const said = element("p", { className: "note", role: "status" });
  const wrong = element("p", { className: "error", role: "alert" });
  panel.append(section);
  const below = element("div", { className: "plot", hidden: true, role: "img" });
  root.querySelector("p.note").before(below);
  let plot = null;
  let asked = "";

  const rebuild = (state) => anew(section, () => show(state));

  function show(state) {
    const names = state.sets.map((one, k) => [String(k), printable(one.name)]).filter(([k]) => Number(k) !== state.set);
    section.replaceChildren(section.firstChild);
    section.hidden = !names.length;
    if (names.length) {
      const options = [["-1", "none"], ...names];
      section.append(choice("compare", options, String(state.second), (k) => store.set({ second: Number(k) })));
      if (state.second >= 0) section.append(oneOf("Shown as", "pair-as", KINDS, state.pairAs, (pairAs) => store.set({ pairAs })));
    }
    section.append(said, wrong);
  }

  async function fetched(state) {
    const { set, second } = state;
    if (asked === `${set} ${second}`) return undefined;
    asked = `${set} ${second}`;
    wrong.textContent = said.textContent = "";
    if (second < 0 || second === set) return store.set({ pair: null, difference: null, second: -1 });
    try {
      const found = await pair(set, second);
      const now = store.get();
      if (now.set === set && now.second === second) {
        const numbers = numbersOf(found);
        store.set({ pair: numbers, difference: numbers.value });
      }
    } catch (error) {
      store.set({ pair: null, difference: null });
      wrong.textContent = printable(error.message);
    }
    return undefined;
  }

  function draw(state) {
    plot?.destroy();
    plot = null;
    const cells = drawable(state).filter((k) => !state.hidden.has(k));
    below.hidden = !state.pair || !cells.length;
    if (!state.pair) return;
    const { name, missing, rms } = state.pair;
    const lost = missing ? ` ${missing} directions have no value of it.` : "";
    const what = state.pairAs === "ratio" ? "Its values over those of this scan are below." : "Its values less those of this scan are below.";
    const off = rms === null ? "" : ` rms difference ${number(100 * rms, 3)} % by solid angle.`;
    said.textContent = `Hollow, dashed: ${printable(name)} at the directions of this scan. ${what}${off}${lost}`;
    if (below.hidden) return;
    const data = dataOf(state, cells);
    plot = new uPlot(options(state, cells, root.clientWidth - 2), data, below);
    below.ariaLabel = `${labelOf(state)}, for each curve`;
  }

  function options(state, cells, width) {
    const series = [{}];
    for (const cell of cells) {
      const own = colour(colourOf(state, cell));
      series.push({ stroke: own, width: 1, dash: [4, 3], points: { show: true, size: 5, fill: ofStyle("paper"), stroke: own, width: 1.5 }, spanGaps: true });
    }
    const middle = state.pairAs === "ratio" ? 1 : 0;
    return {
      ...frame(width, HEIGHT, [axisX("θᵣ [deg], positive is forward"), axisY(labelOf(state), false)]),
      series,
      scales: { x: { time: false, range: [-90, 90] }, y: { range: (_, low, high) => about(middle, low, high) } },
      hooks: { draw: [(drawn) => bars(drawn, store.get(), cells, middle)] },
    };
  }

  extensions.draw.push(overlay);
  store.watch(["sets", "set", "second"], rebuild);
  store.watch(["sets", "set", "second"], fetched);
  store.watch(["pair", "pairAs"], rebuild);
  store.watch(["pair", "pairAs", "set", "block", "hidden", "theme", "width", "quantity"], draw);
}

const NONE = new Float64Array(0);

function numbersOf(found) {
  const column = (list) => (list ? Float64Array.from(list, (v) => v ?? NaN) : NONE);
  return { ...found, value: column(found.value), uncertainty: column(found.uncertainty) };
}

function labelOf(state) {
  const set = state.sets[state.set];
  const unit = set.relative ? "a.u." : set.unit_label;
  return state.pairAs === "ratio" ? "ratio" : `difference [${unit}]`;
}

// The ratio or the difference of one row, and its standard uncertainty: of both scans, as if they were independent.
export function compared(state, row) {
  const set = state.sets[state.set];
  const [a, b, ua, ub] = [set.value[row], state.pair.value[row], set.uncertainty[row], state.pair.uncertainty[row]];
  const stated = [ua, ub].filter((u) => u > 0);
  if (state.pairAs === "difference") return [b - a, stated.length ? Math.hypot(...stated) : NaN];
  if (!(a > 0)) return [NaN, NaN];
  const parts = [ua / a, ub / b].filter((u) => u > 0 && Number.isFinite(u));
  return [b / a, parts.length ? Math.abs(b / a) * Math.hypot(...parts) : NaN];
}

const rowsOf = (set, cell) => Array.from({ length: set.cells[cell].in_plane }, (_, k) => set.cells[cell].start + k);

function dataOf(state, cells) {
  const set = state.sets[state.set];
  const x = Float64Array.from(new Set(cells.flatMap((cell) => rowsOf(set, cell).map((row) => set.signed[row])))).sort();
  const place = new Map(Array.from(x, (t, k) => [t, k]));
  const columns = cells.map((cell) => {
    const column = Array(x.length).fill(null);
    for (const row of rowsOf(set, cell)) {
      const [value] = compared(state, row);
      if (Number.isFinite(value)) column[place.get(set.signed[row])] = value;
    }
    return column;
  });
  return [x, ...columns];
}

// What is drawn, with the line of no difference and some room.
function about(middle, low, high) {
  const [least, most] = [Math.min(middle, low ?? middle), Math.max(middle, high ?? middle)];
  const room = 0.1 * (most - least) || 0.1;
  return [least - room, most + room];
}

// Bars of the uncertainty of both, and the line of no difference.
function bars(plot, state, cells, middle) {
  const set = state.sets[state.set];
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.strokeStyle = ofStyle("text");
  const y = plot.valToPos(middle, "y", true);
  segment(ctx, bbox.left, y, bbox.left + bbox.width, y);
  for (const cell of cells) {
    ctx.strokeStyle = colour(colourOf(state, cell));
    for (const row of rowsOf(set, cell)) {
      const [value, u] = compared(state, row);
      if (!(u > 0) || !Number.isFinite(value)) continue;
      const across = plot.valToPos(set.signed[row], "x", true);
      segment(ctx, across, plot.valToPos(value - u, "y", true), across, plot.valToPos(value + u, "y", true));
    }
  }
  ctx.restore();
}

// The second scan on the curves: hollow points, joined by dashed lines.
function overlay(plot, state, cells) {
  if (!state.pair) return;
  const set = state.sets[state.set];
  const { ctx, bbox } = plot;
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.lineWidth = 1.2 * devicePixelRatio;
  for (const cell of cells) {
    ctx.strokeStyle = colour(colourOf(state, cell));
    const places = rowsOf(set, cell)
      .map((row) => [set.signed[row], state.pair.value[row] * factor(state, set.signed[row])])
      .filter(([, value]) => Number.isFinite(value) && (state.scale !== "log" || value > 0))
      .map(([t, value]) => [plot.valToPos(t, "x", true), plot.valToPos(value, "y", true)]);
    ctx.setLineDash([4 * devicePixelRatio, 3 * devicePixelRatio]);
    ctx.beginPath();
    places.forEach(([x, y], k) => (k ? ctx.lineTo(x, y) : ctx.moveTo(x, y)));
    ctx.stroke();
    ctx.setLineDash([]);
    ctx.fillStyle = ofStyle("paper");
    for (const [x, y] of places) {
      ctx.beginPath();
      ctx.arc(x, y, 3 * devicePixelRatio, 0, 2 * Math.PI);
      ctx.fill();
      ctx.stroke();
    }
  }
  ctx.restore();
}
