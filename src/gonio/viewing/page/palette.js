// Colours of values, and the bar that says which colour is which value.
//
// Both maps are even to the eye and tell their colours apart to colour-blind readers; between those listed it is linear.
// CIVIDIS: Nunez, Anderton and Renslow 2018, doi:10.1371/journal.pone.0199239, as Matplotlib has it (licence: PSF-like),
// and as gonio plot --figure hemisphere draws. VIK: Crameri, doi:10.5281/zenodo.1243862 (licence: MIT, (c) 2020 Fabio
// Crameri); its middle is white.

import { ofStyle } from "gonio/colours.js";
import { element } from "gonio/elements.js";
import { number } from "gonio/words.js";

const CIVIDIS =
  "00224e00255400285b002b62002e6a0030700433711135701a386f213b6e273e6e2d416d32436d36466c3b496c3f4c6c" +
  "434e6c47516c4b546c4f576c52596d565c6d5a5f6e5d626e61656f646770686a716b6d726f7073727374757676797877" +
  "7c7b78807e788481798784788b87788f8a78938d789790779b93769f9676a39a75a79d74aba072afa371b3a670b7aa6e" +
  "bbad6cbfb06bc3b469c8b766ccba64d0be61d4c15fd9c55cddc958e1cc55e6d051ead44cefd748f4db42f8df3cfde334" +
  "fee838";
const VIK =
  "001261021f69022b710237790344810450890c5e921b6d9b2f7ca6478db1609dbc" +
  "79adc792bdd2acccdcc5dbe5dce5e9ece5e1eedacfe9cbb9e2bba4dcab8fd59c7b" +
  "cf8e68c97f55c37243bc6331b3531fa5400e932e06832106741506660a07590008";

const COUNT = 256;

export const SEQUENTIAL = ofHex(CIVIDIS);
export const DIVERGING = ofHex(VIK);

// 256 colours as bytes RGBA.
function ofHex(text) {
  const known = text.match(/../g).map((pair) => parseInt(pair, 16));
  const steps = known.length / 3 - 1;
  const bytes = new Uint8Array(4 * COUNT);
  for (let k = 0; k < COUNT; k++) {
    const place = (k / (COUNT - 1)) * steps;
    const lower = Math.min(Math.floor(place), steps - 1);
    for (let c = 0; c < 3; c++) {
      const [a, b] = [known[3 * lower + c], known[3 * lower + 3 + c]];
      bytes[4 * k + c] = Math.round(a + (b - a) * (place - lower));
    }
    bytes[4 * k + 3] = 255;
  }
  return bytes;
}

// A scale of colours: `place` is where a value lies, 0 to 1 and beyond, NaN where it has no place.
export function scaleOf(low, high, logarithmic, palette, beyond = {}) {
  const [first, last] = logarithmic ? [Math.log10(low), Math.log10(high)] : [low, high];
  const range = last - first || 1;
  const place = (value) => {
    if (logarithmic && !(value > 0)) return value <= 0 ? -1 : NaN;
    return ((logarithmic ? Math.log10(value) : value) - first) / range;
  };
  return { low, high, logarithmic, palette, place, first, range, ...beyond };
}

// The colour of a value as three numbers 0 to 255.
export function colourAt(scale, value) {
  const place = Math.min(Math.max(scale.place(value), 0), 1);
  const k = 4 * Math.round(place * (COUNT - 1));
  return [scale.palette[k], scale.palette[k + 1], scale.palette[k + 2]];
}

// A range of measured values; null where none is finite, or a logarithmic scale has no place for any.
export function rangeOf(values, logarithmic) {
  let [low, high] = [Infinity, -Infinity];
  for (const v of values) {
    if (!Number.isFinite(v) || (logarithmic && v <= 0)) continue;
    if (v < low) low = v;
    if (v > high) high = v;
  }
  if (low > high) return null;
  if (logarithmic) low = Math.max(low, high / 1e6);
  if (low === high) return logarithmic ? [low / 2, high * 2] : [Math.min(0, low), Math.max(0, high) || 1];
  return logarithmic ? [low, high] : [Math.min(0, low), high];
}

const BAR = { height: 44, thick: 12, edge: 12 };

export function bar() {
  const canvas = element("canvas", { className: "bar", role: "img" });
  return canvas;
}

// Draws the scale with its numbers and its label into the canvas of a bar, `width` CSS pixels wide.
export function drawBar(canvas, scale, label, width) {
  const dpr = window.devicePixelRatio || 1;
  canvas.width = Math.round(width * dpr);
  canvas.height = Math.round(BAR.height * dpr);
  canvas.style.width = `${width}px`;
  canvas.style.height = `${BAR.height}px`;
  const ctx = canvas.getContext("2d");
  ctx.scale(dpr, dpr);
  const length = width - 2 * BAR.edge;
  for (let x = 0; x < length; x++) {
    const k = 4 * Math.round((x / (length - 1)) * (COUNT - 1));
    ctx.fillStyle = `rgb(${scale.palette.slice(k, k + 3).join()})`;
    ctx.fillRect(BAR.edge + x, 0, 1.5, BAR.thick);
  }
  ends(ctx, scale, length);
  ctx.font = `12px ${ofStyle("font")}`;
  ctx.fillStyle = ofStyle("text");
  ctx.textBaseline = "top";
  ctx.textAlign = "center";
  let free = -Infinity;
  for (const [value, text] of ticks(scale)) {
    const x = BAR.edge + scale.place(value) * length;
    const half = ctx.measureText(text).width / 2;
    const middle = Math.min(Math.max(x, half), width - half);
    if (middle - half < free) continue;
    free = middle + half + 8;
    ctx.fillRect(x - 0.5, BAR.thick, 1, 4);
    ctx.fillText(text, middle, BAR.thick + 5);
  }
  ctx.fillText(label, width / 2, BAR.thick + 19, width);
  canvas.ariaLabel = `Colours: ${label} from ${number(scale.low, 3)} to ${number(scale.high, 3)}, ${scale.logarithmic ? "logarithmic" : "linear"}`;
}

// Triangles where values lie beyond an end: they have the colour of the end.
function ends(ctx, scale, length) {
  const colours = [scale.palette.slice(0, 3), scale.palette.slice(-4, -1)];
  const marks = [
    [scale.below, BAR.edge, 0],
    [scale.above, BAR.edge + length, BAR.edge * 2 + length],
  ];
  marks.forEach(([any, from, to], k) => {
    if (!any) return;
    ctx.fillStyle = `rgb(${colours[k].join()})`;
    ctx.beginPath();
    ctx.moveTo(from, 0);
    ctx.lineTo(to, BAR.thick / 2);
    ctx.lineTo(from, BAR.thick);
    ctx.fill();
  });
}

// Values that are written under the bar: decades, or round numbers.
export function ticks(scale) {
  if (scale.ticks) return scale.ticks;
  const { low, high, logarithmic } = scale;
  if (logarithmic && high / low >= 20) {
    const [from, to] = [Math.ceil(Math.log10(low) - 1e-9), Math.floor(Math.log10(high) + 1e-9)];
    const every = Math.ceil((to - from + 1) / 5);
    const found = [];
    for (let k = from; k <= to; k += every) found.push(10 ** k);
    return found.map((v) => [v, number(v, 2)]);
  }
  const round = roundNumbers(low, high);
  return round.map((v) => [v, number(v, 3)]);
}

function roundNumbers(low, high) {
  const raw = (high - low) / 4;
  const unit = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((m) => m * unit).find((s) => s >= raw);
  const found = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + step * 1e-9; k++) found.push(Number((k * step).toPrecision(12)));
  return found;
}
