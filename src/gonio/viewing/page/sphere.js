// A sphere or a teapot of the material, lit by one light, and by a sky if that is wanted.

import { sphere, teapot } from "gonio/bodies.js";
import { dark, ofStyle } from "gonio/colours.js";
import { cellsShown, isReady, valuesOf } from "gonio/compute.js";
import { element, oneOf } from "gonio/elements.js";
import { brightness, measuredBrightness, MOST, stopsFor, stopsLabel } from "gonio/exposure.js";
import { camera, excuse, geometry, mesh, once, paced, paint, program, settling } from "gonio/gl.js";
import { uniformsOf } from "gonio/hemisphere.js";
import { aboutTable, hasTable, measured, modelled, withoutTable } from "gonio/modelled.js";
import { scaleOf, SEQUENTIAL } from "gonio/palette.js";
import { OBJECT, VERTEX } from "gonio/shading.js";
import { skyTable } from "gonio/skylight.js";
import { number, unit } from "gonio/words.js";

const DEGREE = Math.PI / 180;
const LARGEST = 400; // CSS pixels
const TILT = 0.35; // rad: how far one looks down on the teapot
const GREY = 0.18; // what the geometric mean of relative values is drawn as, of white
const BODIES = { sphere, teapot };

export function mount(root, store) {
  const canvas = element("canvas", { role: "img", className: "body" });
  const ctx = canvas.getContext("2d");
  const across = slider("light, across", -85, 85, 1, 35, "°");
  const upwards = slider("light, up", -85, 85, 1, 35, "°");
  const exposure = slider("exposure", -MOST, MOST, 0.5, 0, "");
  const dome = element("input", { type: "checkbox" });
  const note = element("p", { className: "note" });
  const wrong = element("p", { className: "warning" });
  const what = oneOf("what is lit", "body", [["sphere", "sphere"], ["teapot", "teapot"]], "sphere", (body) => store.set({ body }));
  const from = oneOf("of", "lit-from", [["model", "model"], ["table", "measured"]], "model", (litFrom) => store.set({ litFrom }));
  const skyLabel = element("label", { className: "tick-box" }, dome, element("span", {}, "and an even sky"));
  root.append(element("div", { className: "row" }, what, from, skyLabel), canvas, across.box, upwards.box, exposure.box, wrong, note);
  store.set({ body: "sphere", litFrom: null, lamp: [35, 35], exposure: null });
  let sky = { key: "", tables: new Map() };
  let suited = { key: "", stops: 0, isClipped: false };

  for (const one of [across, upwards]) {
    one.input.addEventListener("input", () => store.set({ lamp: [Number(across.input.value), Number(upwards.input.value)] }));
  }
  exposure.input.addEventListener("input", () => store.set({ exposure: Number(exposure.input.value) }));
  dome.addEventListener("input", () => redraw());

  // The light goes to where the pointer is on the sphere.
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    moved(event);
  });
  canvas.addEventListener("pointermove", (event) => event.buttons && moved(event));

  function moved(event) {
    const half = canvas.clientWidth / 2;
    let [x, y] = [event.offsetX / half - 1, 1 - event.offsetY / half];
    const far = Math.hypot(x, y);
    if (far > 0.99) [x, y] = [(0.99 * x) / far, (0.99 * y) / far];
    const z = Math.sqrt(1 - x * x - y * y);
    const round = (angle) => Math.min(Math.max(Math.round(angle / DEGREE), -85), 85);
    store.set({ lamp: [round(Math.atan2(x, z)), round(Math.asin(y))] });
  }

  function controls(state) {
    from.hidden = !hasTable(state);
    if (from.hidden && state.litFrom === "table") store.set({ litFrom: null });
    if (!from.hidden && state.litFrom === null && !state.fit) store.set({ litFrom: "table" }); // no model is near it yet
    for (const input of root.querySelectorAll("input[name=lit-from]")) input.checked = input.value === (state.litFrom ?? "model");
  }

  function draw(coarse) {
    const state = store.get();
    const width = Math.min(LARGEST, Math.floor(root.clientWidth));
    if (!width || !isReady(state)) return;
    across.show(state.lamp[0]);
    upwards.show(state.lamp[1]);
    exposure.show(exposureOf(state), stopsLabel(exposureOf(state)));
    const size = Math.round(width * (window.devicePixelRatio || 1));
    if (canvas.width !== size) {
      canvas.width = canvas.height = size;
      canvas.style.width = canvas.style.height = `${width}px`;
    }
    ctx.fillStyle = ofStyle("plane");
    ctx.fillRect(0, 0, size, size);
    const set = state.sets[state.set];
    wrong.textContent = set.unit === "1" ? "A degree of polarisation is no brightness: nothing is lit." : excuse(state.graphics);
    if (!wrong.textContent) {
      try {
        paintBody(state, { x: 0, y: 0, width: size, height: size }, coarse);
      } catch (error) {
        wrong.textContent = error.message;
      }
    }
    if (!coarse) describe(state);
  }

  function paintBody(state, box, coarse) {
    const passes = passesOf(state, coarse);
    if (!passes.length) return;
    const name = `${state.body} ${passes[0].what.name} ${passes.length}`;
    const white = Math.PI * 2 ** exposureOf(state) * norm(state);
    paced(name, box.width * box.height, coarse, (share) =>
      paint(ctx, box, share, (gl) => {
        const body = once(state.body, () => bodyOf(gl, state.body));
        for (const { what, mask, cell } of passes) {
          gl.colorMask(...mask, true);
          body.program = program(what.name, VERTEX, what.fragment, {
            ...uniformsOf(scaleOf(0, 1, false, SEQUENTIAL), what.uniforms),
            view: { value: OBJECT },
            light: { value: lampOf(state) },
            upward: { value: state.body === "teapot" ? [0, Math.cos(TILT), Math.sin(TILT)] : [0, 1, 0] },
            // White is what a perfect diffuser sends back from light that falls on it straight.
            bright: { value: [white, dome.checked ? white / Math.PI : 0] },
            sky: { value: dome.checked ? skyOf(state, cell, coarse) : Array(64).fill(0) },
          });
          body.draw({ camera: once("camera", camera) });
        }
        gl.colorMask(true, true, true, true);
      }),
    );
  }

  // The stops that the user chose; else those that suit the body as it was first shown, so that moving a slider or the
  // light changes how bright it is.
  function exposureOf(state) {
    if (state.exposure !== null) return state.exposure;
    const key = [state.set, state.block, state.model.declaration.name, state.fitName, state.litFrom].join();
    if (suited.key !== key) {
      const blocks = channels(state) ?? [state.block];
      const found = blocks.flatMap((block) =>
        state.litFrom === "table" ? measuredBrightness(state.sets[state.set], block) : brightness(state, cellOf(state, block), lampOf(state)),
      );
      const factor = norm(state);
      suited = { key, ...stopsFor(found.map((one) => one * factor)) };
    }
    return suited.stops;
  }

  // The table of the sky of a cell: while something is dragged that of before.
  function skyOf(state, cell, coarse) {
    const key = [state.model.declaration.name, valuesOf(state, cell)].join();
    const known = sky.tables.get(cell);
    if (known && (known.key === key || coarse)) return known.table;
    if (sky.tables.size > 8) sky.tables.clear();
    const table = skyTable(state.model.module, valuesOf(state, cell));
    sky.tables.set(cell, { key, table });
    return table;
  }

  function describe(state) {
    const set = state.sets[state.set];
    const { module, declaration } = state.model;
    const values = valuesOf(state, cellOf(state, state.block));
    const lamp = lampOf(state);
    const f = module.f(values, lamp, [0, 0, 1]);
    const angle = Math.acos(lamp[2]) / DEGREE;
    const of = state.litFrom === "table" ? "The table of the file" : declaration.name;
    const modelled = state.litFrom === "table" ? "" : ` and the model ${number(f, 3)} ${unit(set.unit)}`.trimEnd();
    const middle = `in the middle of the sphere θᵢ is ${number(angle, 3)}°, θᵣ 0°${modelled}`;
    const white = set.relative
      ? "Relative values: their geometric mean is drawn as mid grey (18 %)."
      : "White is a perfect diffuser that is lit straight.";
    const stops = exposureOf(state);
    const times = stops ? ` The exposure shows it ${number(2 ** Math.abs(stops), 3)} times ${stops > 0 ? "brighter" : "darker"}.` : "";
    const clipped = state.exposure === null && suited.isClipped ? " The highlight is brighter than the screen." : "";
    const colours = channels(state) ? " Three channels: red, green and blue." : "";
    const grouped = state.groups.some((own, k) => !declaration.parameters[k].weight && new Set(own).size > 1) ? " The values are those of the incidence angle that is chosen." : "";
    const lit = `light ${side(state.lamp[0], "right", "left")} and ${side(state.lamp[1], "above", "below")}`;
    canvas.ariaLabel = `${state.body}, ${of}, ${lit}: ${middle}.`;
    const sky = dome.checked ? " The sky adds its directional reflectance, from a table of 64 angles." : "";
    note.textContent = `${of}: ${middle}`.replace(/\.$/, "");
    note.textContent += `. ${white}${times}${clipped}${colours}${sky}${grouped} No shadows. ${aboutTable(state)} ${withoutTable(state)}`.trimEnd();
  }

  const redraw = settling(draw);
  store.watch(["set", "sets", "tables", "litFrom"], controls);
  store.watch(["set", "sets", "block", "cell", "values", "groups", "model", "shader", "graphics", "body", "lamp", "litFrom", "exposure", "theme", "tables"], redraw);
  new ResizeObserver(() => draw(false)).observe(root);
  dark.addEventListener("change", () => draw(false));
}

const side = (angle, one, other) => `${Math.abs(angle)}° ${angle < 0 ? other : one}`;

// A native slider with its name and its value.
function slider(label, min, max, step, value, of) {
  const input = element("input", { type: "range", min, max, step, value });
  const output = element("output", {});
  const show = (now, text = `${String(now).replace("-", "−")}${of}`) => {
    input.value = now;
    output.textContent = input.ariaValueText = text;
  };
  return { input, show, box: element("label", { className: "choice wide" }, element("span", {}, label), input, output) };
}

function lampOf(state) {
  const [across, up] = state.lamp.map((angle) => angle * DEGREE);
  return [Math.sin(across) * Math.cos(up), Math.sin(up), Math.cos(across) * Math.cos(up)];
}

function bodyOf(gl, name) {
  const { position, normal, index } = BODIES[name]();
  const made = geometry(gl, {
    position: { size: 3, data: Float32Array.from(position) },
    normal: { size: 3, data: Float32Array.from(normal) },
    index: { data: Uint16Array.from(index) },
  });
  const body = mesh(gl, { geometry: made, program: null });
  if (name === "teapot") body.rotation.x = TILT - Math.PI / 2;
  body.updateMatrixWorld();
  return body;
}

// The blocks that are red, green and blue, with the other labels of the block that is shown; null where there are none.
export function channels(state) {
  const set = state.sets[state.set];
  if (!set.by.includes("channel")) return null;
  const others = set.by.filter((name) => name !== "channel");
  const like = (block) => others.every((name) => set.blocks[block][name] === set.blocks[state.block][name]);
  const found = ["R", "G", "B"].map((c) => set.blocks.findIndex((b, k) => b.channel === c && like(k)));
  return found.every((block) => block >= 0) ? found : null;
}

// A cell of a block: the one that is chosen, or that of the same incidence.
function cellOf(state, block) {
  const { cells } = state.sets[state.set];
  const chosen = cells[state.cell];
  if (chosen?.block === block) return state.cell;
  const own = cells.map((_, k) => k).filter((k) => cells[k].block === block);
  return own.find((k) => chosen && cells[k].theta_i === chosen.theta_i) ?? own[0] ?? cellsShown(state)[0];
}

// What is drawn into which colours: once, or for each of three channels.
function passesOf(state, coarse) {
  const blocks = channels(state);
  const one = (block, mask) => {
    const cell = cellOf(state, block);
    const what = state.litFrom === "table" ? measured(state, block) : modelled(state, cell, coarse);
    return { what, mask, cell };
  };
  const passes = blocks ? blocks.map((block, k) => one(block, [k === 0, k === 1, k === 2])) : [one(state.block, [true, true, true])];
  return passes.every(({ what }) => what) ? passes : [];
}

// What relative values are multiplied by: of absolute values 1.
function norm(state) {
  const set = state.sets[state.set];
  if (!set.relative) return 1;
  const { cells, value } = set;
  let [sum, count] = [0, 0];
  for (const { block, start, end } of cells) {
    if (block !== state.block) continue;
    for (let k = start; k < end; k++) {
      if (value[k] > 0) {
        sum += Math.log(value[k]);
        count += 1;
      }
    }
  }
  return count ? GREY / (Math.PI * Math.exp(sum / count)) : 1;
}
