// Bodies that are lit: a sphere and a teapot, as triangles with normals.

import { PATCHES, VERTICES } from "gonio/vendor/teapot.js";

const ROUND = { around: 96, up: 48 };
const STEPS = 8; // of each side of a patch
const ASIDE = 1e-3; // where a patch has shrunk to a point its normal is that of a point beside it
const SIZE = 0.28; // of the teapot in the view, and where its middle is
const MIDDLE = [0.22, 0, 1.3];

// A grid of vertices as two triangles for each of its cells.
function indices(rows, columns, first = 0) {
  const found = [];
  for (let a = 0; a < rows; a++) {
    for (let b = 0; b < columns; b++) {
      const k = first + a * (columns + 1) + b;
      found.push(k, k + 1, k + columns + 2, k, k + columns + 2, k + columns + 1);
    }
  }
  return found;
}

// {position, normal, index} of a sphere of radius 0.96 whose axis is y.
export function sphere() {
  const normal = [];
  for (let a = 0; a <= ROUND.up; a++) {
    const polar = (Math.PI * a) / ROUND.up;
    for (let b = 0; b <= ROUND.around; b++) {
      const azimuth = (2 * Math.PI * b) / ROUND.around;
      normal.push(Math.sin(polar) * Math.cos(azimuth), Math.cos(polar), Math.sin(polar) * Math.sin(azimuth));
    }
  }
  return { position: normal.map((v) => 0.96 * v), normal, index: indices(ROUND.up, ROUND.around) };
}

// The same of the teapot, whose axis is z.
export function teapot() {
  const [position, normal, index] = [[], [], []];
  for (let patch = 0; patch < PATCHES.length; patch += 16) {
    const points = PATCHES.slice(patch, patch + 16).map((k) => VERTICES.slice(3 * k, 3 * k + 3));
    index.push(...indices(STEPS, STEPS, position.length / 3));
    for (let a = 0; a <= STEPS; a++) {
      for (let b = 0; b <= STEPS; b++) {
        const [x, y, z] = at(points, cubic(a / STEPS), cubic(b / STEPS));
        position.push(...[x, y, z].map((c, k) => SIZE * (c - MIDDLE[k])));
        normal.push(...normalAt(points, a / STEPS, b / STEPS));
      }
    }
  }
  return { position, normal, index };
}

const cubic = (t) => [(1 - t) ** 3, 3 * t * (1 - t) ** 2, 3 * t * t * (1 - t), t ** 3];

const slope = (t) => [-3 * (1 - t) ** 2, 3 * (1 - t) * (1 - 3 * t), 3 * t * (2 - 3 * t), 3 * t * t];

function at(points, u, v) {
  const sum = [0, 0, 0];
  points.forEach((p, k) => {
    const weight = u[Math.floor(k / 4)] * v[k % 4];
    for (let c = 0; c < 3; c++) sum[c] += weight * p[c];
  });
  return sum;
}

function normalAt(points, s, t) {
  const [a, b] = [at(points, slope(s), cubic(t)), at(points, cubic(s), slope(t))];
  const n = [b[1] * a[2] - b[2] * a[1], b[2] * a[0] - b[0] * a[2], b[0] * a[1] - b[1] * a[0]];
  const size = Math.hypot(...n);
  if (size > 1e-9) return n.map((c) => c / size);
  return normalAt(points, s + (s < 0.5 ? ASIDE : -ASIDE), t + (t < 0.5 ? ASIDE : -ASIDE));
}
