// Axes of the plots, alike in all of them.

import { ofStyle } from "gonio/colours.js";
import { number } from "gonio/words.js";

export const frame = (width, height, axes) => ({
  width,
  height,
  axes,
  legend: { show: false },
  cursor: { sync: { key: "theta_r" }, drag: { x: false, y: false }, y: false, points: { show: false } },
});

const text = () => ({ stroke: ofStyle("text"), font: `12px ${ofStyle("font")}`, labelFont: `12px ${ofStyle("font")}` });

export function axisX(label) {
  const lines = { grid: { stroke: ofStyle("line"), width: 1 }, ticks: { stroke: ofStyle("line"), width: 1 } };
  const splits = (plot) => (plot.width > 480 ? [-90, -60, -30, 0, 30, 60, 90] : [-90, -45, 0, 45, 90]);
  const values = (_, found) => found.map((v) => String(v).replace("-", "−"));
  return { ...text(), ...lines, splits, values, label, labelSize: label ? 22 : 0, size: 32, labelGap: 0 };
}

export function axisY(label, logarithmic) {
  const lines = { grid: { stroke: ofStyle("line"), width: 1 }, ticks: { stroke: ofStyle("line"), width: 1 } };
  const filter = logarithmic ? decades : (_, found) => found;
  const values = (_, found) => found.map((v) => (v === null ? null : logarithmic ? power(v) : number(v, 3)));
  return { ...text(), ...lines, label, labelSize: 24, size: 56, space: 22, filter, values, labelGap: 2 };
}

// Labels of a logarithmic axis: decades, or every digit where there are few.
function decades(plot, found) {
  const range = Math.log10(plot.scales.y.max / plot.scales.y.min);
  const every = Math.ceil(range / 8);
  return found.map((v) => {
    const place = Math.log10(v);
    const isDecade = Math.abs(place - Math.round(place)) < 1e-6;
    if (range < 1.2) return v;
    return isDecade && Math.round(place) % every === 0 ? v : null;
  });
}

const SUPER = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };

function power(v) {
  const place = Math.log10(v);
  if (Math.abs(place - Math.round(place)) > 1e-6 || Math.abs(place) < 2.5) return number(v, 2);
  return `10${[...String(Math.round(place))].map((c) => SUPER[c]).join("")}`;
}

export function segment(ctx, x0, y0, x1, y1) {
  ctx.beginPath();
  ctx.moveTo(x0, y0);
  ctx.lineTo(x1, y1);
  ctx.stroke();
}
