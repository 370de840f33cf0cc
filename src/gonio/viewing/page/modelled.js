// The model, and the table of a file, as the graphics draw them.

import { detector, light } from "gonio/angles.js";
import { valuesOf } from "gonio/compute.js";
import { forget, once, texture } from "gonio/gl.js";
import { ofAngles, ofModel, ofTable } from "gonio/shading.js";
import * as source from "gonio/source.js";

// Integrals within integrals for every pixel: a driver takes minutes, or stops. These are drawn from a table.
const TABULATED = new Set(["modified-beckmann-kirchhoff"]);
const SIZES = { coarse: [6, 10, 10], fine: [15, 20, 16] }; // over theta_i, theta_r and phi
const GRAZING = 89; // deg, of the last angles of a table: at 90 deg there is no light
const ROW = 2048; // numbers in a row of a texture

// {name, fragment, uniforms} of the model for a cell; null while its shader is on its way. Throws where there is none.
export function modelled(state, cell, coarse) {
  const { declaration, module } = state.model;
  const values = valuesOf(state, cell);
  if (TABULATED.has(declaration.name)) return fromTable(declaration, module, values, coarse);
  if (state.shader?.name !== declaration.name) return null;
  if (state.shader.why) throw new Error(state.shader.why);
  const uniforms = { brdf_values: { value: values }, brdf_pre: { value: module.pre(values) } };
  return { name: declaration.name, fragment: ofModel(state.shader.text), uniforms };
}

// Why what is drawn is not the formula itself.
export const aboutTable = (state) =>
  TABULATED.has(state.model.declaration.name) ? "Its integrals are too slow for the graphics: drawn from a table." : "";

let kept = { key: "", numbers: null };

function fromTable(declaration, module, values, coarse) {
  const size = coarse ? SIZES.coarse : SIZES.fine;
  const key = [declaration.name, size, values].join();
  if (kept.key !== key) {
    kept = { key, numbers: tabulated(module, values, size) };
    forget("model table");
  }
  const numbers = once("model table", (gl) => inRows(gl, kept.numbers));
  const uniforms = { numbers: { value: numbers }, plane: { value: 0 } };
  return { name: `${declaration.name} ${size}`, fragment: ofAngles(size, ROW), uniforms };
}

// A texture of single numbers, in rows of ROW.
function inRows(gl, numbers) {
  const height = Math.ceil(numbers.length / ROW);
  let full = numbers;
  if (numbers.length !== height * ROW) {
    full = new Float32Array(height * ROW);
    full.set(numbers);
  }
  return texture(gl, full, ROW, height, { internalFormat: gl.R32F, format: gl.RED, type: gl.FLOAT });
}

// Values over theta_i, theta_r and phi: what depends on the light alone, which is slow, is computed for few angles.
export function tabulated(module, values, [lights, views, azimuths]) {
  const pre = module.pre(values);
  const out = new Float32Array(lights * views * azimuths);
  const polar = (k, count) => Math.min((90 * k) / (count - 1), GRAZING);
  let at = 0;
  for (let a = 0; a < lights; a++) {
    const wi = light(polar(a, lights));
    const inc = module.inc(values, pre, wi);
    for (let b = 0; b < views; b++) {
      for (let c = 0; c < azimuths; c++) {
        const f = module.reflected(values, pre, inc, wi, detector(polar(b, views), (180 * c) / (azimuths - 1)));
        out[at++] = Number.isFinite(f) ? f : 0;
      }
    }
  }
  return out;
}

// Asks for the table of a scan when it is first shown.
export function fetchTables(store) {
  store.watch(["set", "sets"], async (state) => {
    const { table } = state.sets[state.set];
    if (!table || table.asked) return;
    table.asked = true;
    try {
      table.numbers = await source.table(state.set);
      store.set({ tables: (store.get().tables ?? 0) + 1 });
    } catch (error) {
      store.set({ error: error.message });
    }
  });
}

// Whether the table of the file of the set that is shown is here.
export const hasTable = (state) => Boolean(state.sets[state.set].table?.numbers);

// What is said of a table that is not: a page that is a file does not hold it.
export const withoutTable = (state) =>
  state.sets[state.set].table && !source.served ? "The table itself is not in this page: gonio view draws it." : "";

// The table of a file for one set of directions; null where it has none, or before it is here.
export function measured(state, block) {
  const set = state.sets[state.set];
  const { table } = set;
  if (!table?.numbers) return null;
  const numbers = once(`table ${state.set}`, (gl) => inRows(gl, table.numbers));
  const uniforms = { numbers: { value: numbers }, plane: { value: table.planes.indexOf(block) } };
  const fragment = ofTable(table.size, ROW, table.around);
  return { name: `table of the file ${table.size}`, fragment, uniforms };
}
