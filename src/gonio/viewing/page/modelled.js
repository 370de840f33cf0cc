// The model, and the table of a file, as the graphics draw them.

import { valuesOf } from "gonio/compute.js";
import { forget, once, texture } from "gonio/gl.js";
import { ofModel, ofTable } from "gonio/shading.js";
import * as source from "gonio/source.js";

// Integrals within integrals for every pixel: a driver takes minutes, or stops. These are drawn from a table.
const TABULATED = new Set(["modified-beckmann-kirchhoff"]);
const SIZES = { coarse: [12, 10, 12], fine: [40, 20, 24] };
const GRAZING = 0.02; // cosine of a direction below the horizon, which its cell is given instead
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
  const around = declaration.violates.includes("reciprocity") ? 2 * Math.PI : Math.PI;
  const key = [declaration.name, size, values].join();
  if (kept.key !== key) {
    kept = { key, numbers: tabulated(module, values, size, around) };
    forget("model table");
  }
  const numbers = once("model table", (gl) => inRows(gl, kept.numbers));
  const name = `${declaration.name} ${size}`;
  return { name, fragment: ofTable(size, ROW, around, true), uniforms: { numbers: { value: numbers }, plane: { value: 0 } } };
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

// Values at the middles of cells over theta_h (by the root), theta_d and phi_d.
export function tabulated(module, values, [hs, ds, ps], around) {
  const pre = module.pre(values);
  const out = new Float32Array(hs * ds * ps);
  let at = 0;
  for (let h = 0; h < hs; h++) {
    const theta_h = (Math.PI / 2) * ((h + 0.5) / hs) ** 2;
    for (let d = 0; d < ds; d++) {
      const theta_d = ((Math.PI / 2) * (d + 0.5)) / ds;
      for (let p = 0; p < ps; p++) {
        const [wi, wr] = pair(theta_h, theta_d, (around * (p + 0.5)) / ps);
        const f = module.reflected(values, pre, module.inc(values, pre, wi), wi, wr);
        out[at++] = Number.isFinite(f) ? f : 0;
      }
    }
  }
  return out;
}

function pair(theta_h, theta_d, phi_d) {
  const [c, s] = [Math.cos(theta_h), Math.sin(theta_h)];
  const [x, y, z] = [Math.sin(theta_d) * Math.cos(phi_d), Math.sin(theta_d) * Math.sin(phi_d), Math.cos(theta_d)];
  return [raised([c * x + s * z, y, c * z - s * x]), raised([s * z - c * x, -y, c * z + s * x])];
}

function raised([x, y, z]) {
  if (z >= GRAZING) return [x, y, z];
  const share = Math.sqrt(1 - GRAZING ** 2) / Math.hypot(x, y);
  return [x * share, y * share, GRAZING];
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

// The table of a file for one set of directions; null where it has none, or before it is here.
export function measured(state, block) {
  const set = state.sets[state.set];
  const { table } = set;
  if (!table?.numbers) return null;
  const numbers = once(`table ${state.set}`, (gl) => inRows(gl, table.numbers));
  const uniforms = { numbers: { value: numbers }, plane: { value: table.planes.indexOf(block) } };
  const fragment = ofTable(table.size, ROW, table.around, false);
  return { name: `table of the file ${table.size}`, fragment, uniforms };
}
