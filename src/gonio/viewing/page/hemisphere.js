// The hemisphere seen from above, drawn: values as colours, rings and azimuths with their labels, and marks.
// The centre is the normal, the rim theta_r 90 deg; phi 180 deg, forward, is on the right.

import { light } from "gonio/angles.js";
import { ofStyle } from "gonio/colours.js";
import { camera, geometry, mesh, once, paced, paint, program, texture } from "gonio/gl.js";
import { colourAt } from "gonio/palette.js";
import { HEMISPHERE, POINTS, POINTS_VERTEX, SKY, VERTEX } from "gonio/shading.js";

const DOT = 4; // pixels: radius of a direction of the plane of incidence
const SMALL = 130; // CSS pixels across below which one ring has a label
const LABELS = 118; // deg: where the labels of the rings are, as in gonio plot --figure hemisphere
const MOST = 2000; // directions of which each has a radius of its own
const NEIGHBOUR = 6; // the neighbour that a direction reaches towards
const REACH = 0.75; // and how far

const DEGREE = Math.PI / 180;

// Where a direction lies: x to the right, y up, 1 at the rim.
export function placeOf(theta, phi) {
  const r = theta / 90;
  return [-r * Math.cos(phi * DEGREE), -r * Math.sin(phi * DEGREE)];
}

// Square of two triangles.
export function square(gl) {
  const position = { size: 3, data: new Float32Array([-1, -1, 0, 1, -1, 0, 1, 1, 0, -1, -1, 0, 1, 1, 0, -1, 1, 0]) };
  return geometry(gl, { position, normal: { size: 3, data: new Float32Array(18) } });
}

// All uniforms of the views: what a view does not use must be there all the same.
export function uniformsOf(scale, own) {
  const colours = once(`colours ${scale.palette.length} ${scale.palette[1]}`, (gl) => texture(gl, scale.palette, 256, 1));
  return {
    view: { value: HEMISPHERE },
    light: { value: [0, 0, 1] },
    turned: { value: [1, 0] },
    scaling: { value: [scale.first, scale.range, scale.logarithmic ? 1 : 0] },
    factor: { value: [1, 0] },
    colours: { value: colours },
    upward: { value: [0, 1, 0] },
    bright: { value: [1, 0] },
    sky: { value: Array(SKY).fill(0) },
    ...own,
  };
}

// A function of directions, over all of the hemisphere. `what` is of modelled.js.
export function paintFunction(ctx, box, what, scale, { theta_i, phi_i }, factor, coarse) {
  paced(`map ${what.name}`, box.width * box.height, coarse, (share) =>
    paint(ctx, box, share, (gl) => {
      const own = {
        ...what.uniforms,
        light: { value: light(theta_i) },
        turned: { value: [Math.cos(phi_i * DEGREE), Math.sin(phi_i * DEGREE)] },
        factor: { value: factor },
      };
      // The azimuth of the light is put into both directions, as the model counts it from a mark of the surface.
      own.light.value = light(theta_i, phi_i);
      const made = program(what.name, VERTEX, what.fragment, uniformsOf(scale, own));
      mesh(gl, { geometry: once("square", square), program: made }).draw({ camera: once("camera", camera) });
    }),
  );
}

// Values at measured directions: rows of the set, and a value for each of them.
export function paintPoints(ctx, box, set, rows, values, scale) {
  const known = rows.filter((_, n) => Number.isFinite(scale.place(values[n])));
  const kept = values.filter((v) => Number.isFinite(scale.place(v)));
  const places = new Float32Array(3 * known.length);
  const shades = new Float32Array(3 * known.length);
  const radii = radiiOf(set, known, box.width / 2);
  known.forEach((row, n) => {
    places.set([...placeOf(set.theta_r[row], set.phi[row]), radii[n]], 3 * n);
    shades.set(colourAt(scale, kept[n]).map((c) => c / 255), 3 * n);
  });
  paint(ctx, box, 1, (gl) => {
    if (!known.length) return;
    const made = geometry(gl, { position: { size: 3, data: places }, shade: { size: 3, data: shades } });
    const uniforms = { across: { value: box.width } };
    const points = program("points of the map", POINTS_VERTEX, POINTS, uniforms);
    mesh(gl, { geometry: made, program: points, mode: gl.POINTS }).draw();
    made.remove();
  });
}

// How far each direction colours its surroundings: dots in a plane, and areas that meet over a hemisphere.
function radiiOf(set, rows, half) {
  const dot = (DOT * (window.devicePixelRatio || 1)) / half;
  if (rows.every((row) => Number.isFinite(set.signed[row]))) return rows.map(() => dot);
  if (rows.length > MOST) return rows.map(() => Math.max(dot, 1.8 / Math.sqrt(rows.length)));
  const places = rows.map((row) => placeOf(set.theta_r[row], set.phi[row]));
  return places.map(([x, y]) => {
    const far = places.map(([a, b]) => Math.hypot(a - x, b - y)).sort((a, b) => a - b);
    return Math.max(dot, REACH * far[Math.min(NEIGHBOUR, far.length - 1)]);
  });
}

// What is seen where nothing was measured: grey, as the middle of a scale of ratios is white.
export function ground(ctx, box) {
  ctx.fillStyle = ofStyle("line");
  ctx.beginPath();
  ctx.arc(box.x + box.width / 2, box.y + box.height / 2, box.width / 2, 0, 2 * Math.PI);
  ctx.fill();
}

// Rings, azimuths, the mirror direction, the direction of the light, and the direction that is read.
export function decorate(ctx, box, theta_i, title, cursor) {
  const dpr = window.devicePixelRatio || 1;
  const [x, y, r] = [box.x + box.width / 2, box.y + box.height / 2, box.width / 2];
  const at = (theta, phi) => {
    const [u, v] = placeOf(theta, phi);
    return [x + u * r, y - v * r];
  };
  ctx.save();
  ctx.lineWidth = dpr;
  ctx.font = `${12 * dpr}px ${ofStyle("font")}`;
  for (const theta of [30, 60, 90]) {
    twice(ctx, dpr, (width) => {
      ctx.lineWidth = width;
      ctx.beginPath();
      ctx.arc(x, y, (theta / 90) * r, 0, 2 * Math.PI);
      ctx.stroke();
    }, theta === 90 ? 0.9 : 0.4);
  }
  ctx.textAlign = "center";
  ctx.textBaseline = "middle";
  for (const theta of box.width > SMALL * dpr ? [30, 60] : [60]) {
    const [u, v] = at(theta, LABELS + 180);
    haloed(ctx, `${theta}°`, u, v, dpr);
  }
  ctx.fillStyle = ofStyle("text");
  const rim = r + 4 * dpr;
  for (const [text, phi, align, line] of [["180°", 180, "left", "middle"], ["270°", 270, "center", "bottom"], ["0°", 0, "right", "middle"], ["90°", 90, "center", "top"]]) {
    ctx.textAlign = align;
    ctx.textBaseline = line;
    const [u, v] = placeOf(90, phi);
    ctx.fillText(text, x + u * rim, y - v * rim);
  }
  ctx.textAlign = "left";
  ctx.textBaseline = "top";
  ctx.font = `600 ${12 * dpr}px ${ofStyle("font")}`;
  ctx.fillText(title, box.x - 26 * dpr, box.y - 20 * dpr);
  twice(ctx, dpr, (width) => plus(ctx, ...at(theta_i, 180), 5 * dpr, width), 1);
  twice(ctx, dpr, (width) => ring(ctx, ...at(theta_i, 0), 3.5 * dpr, width), 1);
  if (cursor) twice(ctx, dpr, (width) => ring(ctx, ...at(...cursor), 7 * dpr, width + dpr), 1);
  ctx.restore();
}

// In the colour of text with a halo of the paper, so that a line is seen on every colour.
function twice(ctx, dpr, stroke, alpha) {
  ctx.globalAlpha = alpha;
  ctx.strokeStyle = ofStyle("paper");
  stroke(3 * dpr);
  ctx.strokeStyle = ofStyle("text");
  stroke(dpr);
  ctx.globalAlpha = 1;
}

// Text that is seen on every colour.
export function haloed(ctx, text, x, y, dpr) {
  ctx.strokeStyle = ofStyle("paper");
  ctx.lineWidth = 3 * dpr;
  ctx.lineJoin = "round";
  ctx.strokeText(text, x, y);
  ctx.fillStyle = ofStyle("text");
  ctx.fillText(text, x, y);
}

function plus(ctx, x, y, size, width) {
  ctx.lineWidth = width;
  ctx.beginPath();
  ctx.moveTo(x - size, y);
  ctx.lineTo(x + size, y);
  ctx.moveTo(x, y - size);
  ctx.lineTo(x, y + size);
  ctx.stroke();
}

function ring(ctx, x, y, radius, width) {
  ctx.lineWidth = width;
  ctx.beginPath();
  ctx.arc(x, y, radius, 0, 2 * Math.PI);
  ctx.stroke();
}
