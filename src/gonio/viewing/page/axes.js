// What the plots of curves have in common: their frame, and axes with labels that people read.

import { ofStyle } from "gonio/colours.js";
import { number } from "gonio/words.js";

export const frame = (width, height, axes) => ({
  width,
  height,
  axes,
  legend: { show: false },
  cursor: { sync: { key: "theta_r" }, drag: { x: false, y: false }, y: false, points: { show: false } },
});

const lines = () => ({ grid: { stroke: ofStyle("line"), width: 1 }, ticks: { stroke: ofStyle("line"), width: 1 } });
const text = () => ({ stroke: ofStyle("text"), font: `12px ${ofStyle("font")}`, labelFont: `12px ${ofStyle("font")}` });

export function axisX(label) {
  const splits = (plot) => (plot.width > 480 ? [-90, -60, -30, 0, 30, 60, 90] : [-90, -45, 0, 45, 90]);
  const values = (_, found) => found.map((v) => String(v).replace("-", "−"));
  return { ...text(), ...lines(), splits, values, label, labelSize: label ? 24 : 0, size: 28, labelGap: 4 };
}

// room: pixels from one label to the next at least.
export function axisY(label, logarithmic, room = 30) {
  const filter = logarithmic ? rounded : (_, found) => found;
  const values = (_, found) => found.map((v) => (v === null ? null : logarithmic ? power(v) : number(v, 3)));
  const axis = { ...text(), ...lines(), label, labelSize: 24, size: 56, space: room, filter, values, labelGap: 2 };
  return logarithmic ? { ...axis, splits: decades } : axis;
}

// Every digit of every decade that is seen: uPlot alone begins at the end of the axis, and leaves out the first of them.
function decades(plot, axis, low, high) {
  const found = [];
  for (let place = Math.floor(Math.log10(low)); place <= Math.log10(high); place++) {
    for (let digit = 1; digit < 10; digit++) found.push(Number((digit * 10 ** place).toPrecision(12)));
  }
  return found.filter((v) => v >= low && v <= high);
}

// Labels of a logarithmic axis: decades, with 2 and 5 between them where there are few, every digit within one.
function rounded(plot, found) {
  const range = Math.log10(plot.scales.y.max / plot.scales.y.min);
  const every = Math.ceil(range / 8);
  const digits = range > 3 ? [1] : range > 0.7 ? [1, 2, 5] : [1, 2, 3, 4, 5, 6, 7, 8, 9];
  return found.map((v) => {
    const place = Math.floor(Math.log10(v) + 1e-9);
    const digit = v / 10 ** place;
    const isOne = digits.some((d) => Math.abs(digit - d) < 1e-6);
    return isOne && place % every === 0 ? v : null;
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
