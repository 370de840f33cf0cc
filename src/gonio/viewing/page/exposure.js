// How bright a lit body is drawn: in whole stops, so that what it sends back at most is bright and not clipped.

import { valuesOf } from "gonio/compute.js";

export const MOST = 12; // stops
const WHITE = 0.95; // linear, of the brightest part
const SEEN = 1 / 64; // linear, of the middle of the lit part: less looks black
const STEP = 0.2; // of the radius, between the places of the body that are looked at

// What a sphere under one light sends back towards the eye, of a white diffuser that is lit straight. The eye is at
// [0, 0, 1], and the first axis of the surface runs round the sphere, as the graphics have it.
export function brightness(state, cell, lamp) {
  const { module } = state.model;
  const values = valuesOf(state, cell);
  const pre = module.pre(values);
  const found = [];
  for (const n of [...places(), halfway(lamp)]) {
    const cosine = dot(lamp, n);
    if (!(cosine > 0)) continue;
    const x = unit([n[2], 0, -n[0]]);
    const y = cross(n, x);
    const wi = [dot(lamp, x), dot(lamp, y), cosine];
    const f = module.reflected(values, pre, module.inc(values, pre, wi), wi, [x[2], y[2], n[2]]);
    if (f > 0 && Number.isFinite(f)) found.push(Math.PI * f * cosine);
  }
  return found;
}

// The same of the values of a scan at its own directions.
export function measuredBrightness(set, block) {
  const found = [];
  for (const cell of set.cells) {
    if (cell.block !== block) continue;
    const cosine = Math.cos((cell.theta_i * Math.PI) / 180);
    for (let k = cell.start; k < cell.end; k++) if (set.value[k] > 0) found.push(Math.PI * set.value[k] * cosine);
  }
  return found;
}

// Whole stops for these brightnesses, and whether a highlight is clipped: where all else would be black.
export function stopsFor(found) {
  if (!found.length) return { stops: 0, isClipped: false };
  const sorted = found.slice().sort((a, b) => a - b);
  const [most, middle] = [sorted.at(-1), sorted[sorted.length >> 1]];
  const unclipped = Math.floor(Math.log2(WHITE / most));
  const seen = Math.ceil(Math.log2(SEEN / middle));
  const stops = Math.min(Math.max(unclipped, seen, -MOST), MOST);
  return { stops, isClipped: stops > unclipped };
}

export const stopsLabel = (stops) => `${stops > 0 ? "+" : ""}${stops}`.replace("-", "−") + (Math.abs(stops) === 1 ? " stop" : " stops");

// Places of the half of a sphere that the eye sees, as normals.
function places() {
  const found = [];
  for (let x = STEP / 2 - 1; x < 1; x += STEP) {
    for (let y = STEP / 2 - 1; y < 1; y += STEP) if (x * x + y * y < 1) found.push([x, y, Math.sqrt(1 - x * x - y * y)]);
  }
  return found;
}

const halfway = ([x, y, z]) => unit([x, y, z + 1]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];

function unit(a) {
  const length = Math.hypot(...a);
  return length > 0 ? a.map((c) => c / length) : [1, 0, 0];
}
