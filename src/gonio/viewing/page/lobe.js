// The lobe: how far a surface reaches in a direction says how much is sent there. Points are measured values.

import { cosine, detector, light } from "gonio/angles.js";
import { dark, ofStyle } from "gonio/colours.js";
import { evaluator, isReady } from "gonio/compute.js";
import { element } from "gonio/elements.js";
import { excuse, geometry, mesh, paint, program, settling } from "gonio/gl.js";
import { haloed } from "gonio/hemisphere.js";
import { colourAt, rangeOf, scaleOf, SEQUENTIAL } from "gonio/palette.js";
import { cellLabel, measuredWord, number, QUANTITIES, valueLabel } from "gonio/words.js";

const LARGEST = 400; // CSS pixels
const DEGREE = Math.PI / 180;
const DECADES = 6; // of a logarithmic radius, at most
const STEP = { coarse: 8, fine: 3 }; // deg of the surface
const NEAR = [0.2, 0.5, 1, 1.7, 2.6, 4, 6, 9, 13]; // deg from the mirror direction: a narrow lobe is not missed
const REACH = 0.72; // of half the view: radius 1
const LOW = 0.42; // how far below the middle of the view the surface of the sample is
const OPAQUE = 0.72;

const VERTEX = `#version 300 es
in vec3 position;
in vec3 shade;
uniform mat3 turned;
uniform vec3 placed; // reach, how far down, size of a point
out vec3 own;
out vec3 seen;
void main() {
    own = shade;
    seen = turned * position;
    gl_Position = vec4(seen.x * placed.x, seen.y * placed.x - placed.y, -0.5 * seen.z, 1.0);
    gl_PointSize = placed.z;
}
`;

const HEAD = `#version 300 es
precision highp float;
in vec3 own;
in vec3 seen;
out vec4 colour;
`;

const SURFACE = `${HEAD}
void main() {
    vec3 n = cross(dFdx(seen), dFdy(seen));
    float slope = dot(n, n) > 0.0 ? abs(normalize(n).z) : 1.0;
    colour = vec4(own * (0.55 + 0.45 * slope), 1.0) * ${OPAQUE};
}
`;

const DOTS = `${HEAD}
uniform vec3 rim;
void main() {
    float r = length(2.0 * gl_PointCoord - 1.0);
    if (r > 1.0) discard;
    colour = vec4(r > 0.6 ? rim : own, 1.0);
}
`;

export function mount(root, store) {
  const canvas = element("canvas", { role: "img", className: "body" });
  const ctx = canvas.getContext("2d");
  const turn = angle("turn", -180, 180);
  const tilt = angle("tilt", 0, 90);
  const note = element("p", { className: "note" });
  const wrong = element("p", { className: "warning" });
  root.append(canvas, turn.box, tilt.box, wrong, note);
  store.set({ orbit: [-25, 22] });

  for (const input of [turn.input, tilt.input]) {
    input.addEventListener("input", () => store.set({ orbit: [Number(turn.input.value), Number(tilt.input.value)] }));
  }
  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    if (!event.buttons) return;
    const [a, b] = store.get().orbit;
    const wrapped = ((((a + event.movementX + 180) % 360) + 360) % 360) - 180;
    store.set({ orbit: [Math.round(wrapped), Math.round(Math.min(Math.max(b + event.movementY / 2, 0), 90))] });
  });

  let kept = null; // the lobe in numbers, which turning it does not change

  function draw(coarse, same = false) {
    const state = store.get();
    const width = Math.min(LARGEST, Math.floor(root.clientWidth));
    if (!width || !isReady(state)) return;
    turn.show(state.orbit[0]);
    tilt.show(state.orbit[1]);
    const dpr = window.devicePixelRatio || 1;
    const [across, down] = [Math.round(width * dpr), Math.round(width * 0.8 * dpr)];
    if (canvas.width !== across || canvas.height !== down) {
      [canvas.width, canvas.height] = [across, down];
      canvas.style.width = `${width}px`;
      canvas.style.height = `${width * 0.8}px`;
    }
    ctx.clearRect(0, 0, across, down);
    if (!same || !kept) kept = lobeOf(state, coarse ? STEP.coarse : STEP.fine);
    wrong.textContent = excuse(state.graphics);
    const view = { matrix: seenFrom(state.orbit), x: across / 2, y: down / 2, half: across / 2 };
    drawAxes(ctx, view, kept, dpr);
    if (!wrong.textContent && kept.scale) {
      try {
        // The view is square as the graphics see it: what is above and below the canvas is cut off.
        paint(ctx, { x: 0, y: Math.round((down - across) / 2), width: across, height: across }, 1, (gl) => paintLobe(gl, kept, view, dpr));
      } catch (error) {
        wrong.textContent = error.message;
      }
    }
    drawLabels(ctx, view, kept, dpr);
    if (!coarse) canvas.ariaLabel = note.textContent = words(state, kept);
  }

  const redraw = settling((coarse) => draw(coarse));
  store.watch(["set", "sets", "block", "cell", "values", "groups", "model", "scale", "quantity", "theme", "graphics"], redraw);
  store.watch(["orbit"], () => draw(false, true));
  new ResizeObserver(() => draw(false)).observe(root);
  dark.addEventListener("change", () => draw(false));
}

function angle(label, min, max) {
  const input = element("input", { type: "range", min, max, step: 1 });
  const output = element("output", {});
  const show = (value) => {
    input.value = value;
    output.textContent = `${String(value).replace("-", "−")}°`;
  };
  return { input, show, box: element("label", { className: "choice wide" }, element("span", {}, label), input, output) };
}

// Unit vector of a direction in the view: x forward, z the normal.
function direction(theta, phi) {
  const s = Math.sin(theta * DEGREE);
  return [-s * Math.cos(phi * DEGREE), -s * Math.sin(phi * DEGREE), Math.cos(theta * DEGREE)];
}

// Rows: to the right, up, and to the eye.
function seenFrom([turn, tilt]) {
  const [ca, sa, ce, se] = [Math.cos(turn * DEGREE), Math.sin(turn * DEGREE), Math.cos(tilt * DEGREE), Math.sin(tilt * DEGREE)];
  return [
    [ca, -sa, 0],
    [sa * se, ca * se, ce],
    [-sa * ce, -ca * ce, se],
  ];
}

// Steps over a range, denser about a place.
function nodes(from, to, step, about) {
  const found = [to, about];
  for (let v = from; v < to; v += step) found.push(v);
  for (const d of NEAR) found.push(about - d, about + d);
  return Float64Array.from(new Set(found.filter((v) => v >= from && v <= to))).sort();
}

// Measured values and the surface of the model, their scale, and how a value becomes a radius.
function lobeOf(state, step) {
  const set = state.sets[state.set];
  const { theta_i, phi_i, start, end } = set.cells[state.cell];
  const { factor } = QUANTITIES[state.quantity];
  const rows = Array.from({ length: end - start }, (_, k) => start + k);
  const measured = rows.map((k) => set.value[k] * factor(cosine(set.theta_r[k])));
  const [thetas, phis] = [nodes(0, 89.9, step, theta_i), nodes(0, 360, 2 * step, 180)];
  const at = evaluator(state, state.cell)(light(theta_i, phi_i));
  const modelled = [];
  for (const theta of thetas) for (const phi of phis) modelled.push(at(detector(theta, phi, phi_i)) * factor(cosine(theta)));
  const logarithmic = state.scale === "log";
  const colours = rangeOf(measured, logarithmic);
  const all = rangeOf([...measured, ...modelled], logarithmic);
  if (!colours) return { scale: null, logarithmic, theta_i };
  const most = all[1];
  const floor = logarithmic ? Math.max(Math.min(colours[0], most) / 2, most / 10 ** DECADES) : 0;
  const radius = (value) => {
    if (!(value > floor)) return 0;
    return logarithmic ? Math.log(value / floor) / Math.log(most / floor) : value / most;
  };
  const scale = scaleOf(...colours, logarithmic, SEQUENTIAL);
  const under = measured.filter((v) => v <= floor).length;
  return { scale, logarithmic, theta_i, most, floor, radius, under, rows, set, measured, thetas, phis, modelled };
}

function paintLobe(gl, lobe, view, dpr) {
  const surface = surfaceOf(gl, lobe);
  const dots = dotsOf(gl, lobe);
  const uniforms = (size) => ({
    turned: { value: [0, 1, 2].flatMap((c) => view.matrix.map((row) => row[c])) },
    placed: { value: [REACH, LOW, size * dpr] },
  });
  const paper = { rim: { value: triple(ofStyle("text")) } };
  const blended = { transparent: true, depthWrite: false };
  const skin = program("lobe", VERTEX, SURFACE, uniforms(1), blended);
  mesh(gl, { geometry: surface, program: skin }).draw();
  const marks = program("points of the lobe", VERTEX, DOTS, { ...uniforms(lobe.rows.length > CROWD ? 3.5 : 6), ...paper }, { depthTest: false });
  mesh(gl, { geometry: dots, program: marks, mode: gl.POINTS }).draw();
  surface.remove();
  dots.remove();
}

function surfaceOf(gl, { thetas, phis, modelled, radius, scale }) {
  const position = new Float32Array(3 * modelled.length);
  const shade = new Float32Array(3 * modelled.length);
  modelled.forEach((value, k) => {
    const r = radius(value);
    const d = direction(thetas[Math.floor(k / phis.length)], phis[k % phis.length]);
    position.set(d.map((c) => c * r), 3 * k);
    shade.set(colourAt(scale, value).map((c) => c / 255), 3 * k);
  });
  const index = [];
  for (let a = 0; a + 1 < thetas.length; a++) {
    for (let b = 0; b + 1 < phis.length; b++) {
      const k = a * phis.length + b;
      index.push(k, k + 1, k + phis.length + 1, k, k + phis.length + 1, k + phis.length);
    }
  }
  return geometry(gl, { position: { size: 3, data: position }, shade: { size: 3, data: shade }, index: { data: Uint16Array.from(index) } });
}

function dotsOf(gl, { set, rows, measured, radius, scale }) {
  const known = rows.map((_, n) => n).filter((n) => radius(measured[n]) > 0);
  const position = new Float32Array(3 * Math.max(known.length, 1));
  const shade = new Float32Array(position.length);
  known.forEach((n, k) => {
    const r = radius(measured[n]);
    position.set(direction(set.theta_r[rows[n]], set.phi[rows[n]]).map((c) => c * r), 3 * k);
    shade.set(colourAt(scale, measured[n]).map((c) => c / 255), 3 * k);
  });
  return geometry(gl, { position: { size: 3, data: position }, shade: { size: 3, data: shade } });
}

// A colour of the style sheet, #rrggbb, as three numbers 0 to 1.
const triple = (hex) => [1, 3, 5].map((k) => parseInt(hex.slice(k, k + 2), 16) / 255);

const AZIMUTHS = [[0, "φ 0°"], [90, "90°"], [180, "180° forward"], [270, "270°"]];
const CROWD = 200; // points above which they are drawn small
const STEEP = 20; // deg: the light and the mirror direction of a smaller angle have no room for labels beside the normal's

const placed = (view, [x, y, z]) => {
  const [u, v] = view.matrix.map((row) => row[0] * x + row[1] * y + row[2] * z);
  return [view.x + REACH * u * view.half, view.y - (REACH * v - LOW) * view.half];
};

const far = (theta, phi, r) => direction(theta, phi).map((c) => c * r);

// The plane of the sample, the azimuths, the normal, the light and the mirror direction.
function drawAxes(ctx, view, { theta_i }, dpr) {
  const line = (...points) => {
    ctx.beginPath();
    points.forEach((p, k) => (k ? ctx.lineTo(...placed(view, p)) : ctx.moveTo(...placed(view, p))));
    ctx.stroke();
  };
  ctx.save();
  ctx.lineWidth = dpr;
  ctx.strokeStyle = ofStyle("soft");
  for (const r of [0.5, 1]) line(...Array.from({ length: 73 }, (_, k) => far(90, 5 * k, r)));
  line(...Array.from({ length: 37 }, (_, k) => direction(Math.abs(5 * k - 90), k < 18 ? 0 : 180)));
  for (const [phi] of AZIMUTHS) line([0, 0, 0], direction(90, phi));
  line([0, 0, 0], [0, 0, 1.05]);
  ctx.strokeStyle = ofStyle("text");
  ctx.lineWidth = 1.6 * dpr;
  line([0, 0, 0], far(theta_i, 0, 1.05));
  ctx.setLineDash([4 * dpr, 4 * dpr]);
  line([0, 0, 0], far(theta_i, 180, 1.05));
  ctx.restore();
}

// Over the lobe, with a halo.
function drawLabels(ctx, view, { theta_i }, dpr) {
  ctx.save();
  ctx.font = `${12 * dpr}px ${ofStyle("font")}`;
  ctx.textAlign = "center";
  ctx.textBaseline = "middle";
  const write = (text, place) => {
    const [x, y] = placed(view, place);
    const half = ctx.measureText(text).width / 2;
    haloed(ctx, text, Math.min(Math.max(x, half + 1), 2 * view.x - half - 1), y, dpr);
  };
  for (const [phi, text] of AZIMUTHS) write(text, far(90, phi, 1.15));
  write("normal", [0, 0, 1.13]);
  if (theta_i > STEEP) write("light", far(theta_i, 0, 1.13));
  if (theta_i > STEEP) write("mirror", far(theta_i, 180, 1.13));
  ctx.restore();
}

// Which values the radii are, and what is seen.
function words(state, lobe) {
  const set = state.sets[state.set];
  const where = `θᵢ ${cellLabel(set, state.cell)}`;
  if (!lobe.scale) return `${where}: no value to draw.`;
  const label = valueLabel(state);
  let best = 0;
  lobe.modelled.forEach((v, k) => (best = v > lobe.modelled[best] ? k : best));
  const [theta, phi] = [lobe.thetas[Math.floor(best / lobe.phis.length)], lobe.phis[best % lobe.phis.length]];
  const radii = lobe.logarithmic
    ? `The radius is logarithmic, from ${number(lobe.floor, 3)} in the middle to ${number(lobe.most, 3)} at the ring`
    : `The radius is linear, from 0 in the middle to ${number(lobe.most, 3)} at the ring`;
  const under = lobe.under ? `; values that are lower are not drawn, of which there are ${lobe.under}` : "";
  return `${where}, ${label}. Surface: model, largest ${number(lobe.modelled[best], 3)} at θᵣ ${number(theta, 3)}°, φ ${number(phi, 3)}°. Points: ${lobe.measured.length} ${measuredWord(set)} values. ${radii}${under}.`;
}
