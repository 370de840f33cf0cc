// The values and the numbers of the page as text: JSON, TOML, a command line, CSV.

import { cellsShown, valuesOf } from "gonio/compute.js";
import { printable } from "gonio/words.js";

const named = (state) => {
  const values = valuesOf(state, state.cell);
  return state.model.declaration.parameters.map((p, k) => [p.name, values[k]]);
};

const where = (state) => {
  const set = state.sets[state.set];
  const block = Object.entries(set.blocks[state.block]).map(([name, value]) => `${name} ${value}`);
  return [printable(set.name), ...block, `theta_i ${set.cells[state.cell].theta_i} deg`].join(", ");
};

// What `gonio eval MODEL --set FILE.json` reads.
export function asJson(state) {
  const set = state.sets[state.set];
  const said = { model: state.model.declaration.name, unit: set.unit, of: where(state), values: Object.fromEntries(named(state)) };
  return `${JSON.stringify(said, null, 2)}\n`;
}

const text = (value) => JSON.stringify(printable(value));
const number = (value) => (Number.isInteger(value) && Math.abs(value) < 1e15 ? `${value}.0` : String(value));

// A table as those of `gonio models --published`: values that differ between incidence angles are tables themselves.
export function asToml(state) {
  const set = state.sets[state.set];
  const cells = cellsShown(state);
  const lines = state.model.declaration.parameters.map((p, k) => {
    const of = new Map(cells.map((cell) => [set.cells[cell].theta_i, state.values[k][state.groups[k][cell]]]));
    if (new Set(of.values()).size === 1) return `${p.name} = ${number([...of.values()][0])}`;
    return `${p.name} = { ${[...of].map(([angle, value]) => `"${angle}" = ${number(value)}`).join(", ")} }`;
  });
  const head = [`unit = ${text(set.unit)}`, "", "[[surface]]", `name = ${text(set.name)}`];
  return [...head, `where = ${text(where(state))}`, `model = ${text(state.model.declaration.name)}`, "[surface.values]", ...lines, ""].join("\n");
}

// The value of the curve that is shown at its mirror direction.
export function asCommand(state) {
  const { theta_i } = state.sets[state.set].cells[state.cell];
  const values = named(state).map(([name, value]) => `${name}=${value}`).join(",");
  return `gonio eval ${state.model.declaration.name} --set ${values} --at "${theta_i},${theta_i},180"`;
}

// The values of the block that is shown, with the model and the second scan; f, whatever the plot shows.
export function asCsv(state) {
  const set = state.sets[state.set];
  const heads = ["theta_i_deg", "theta_r_deg", "phi_deg", ...["brdf", "uncertainty", "model"].map((name) => `${name}_${set.unit}`)];
  const second = state.pair;
  if (second) heads.push(`second_${set.unit}`, `second_uncertainty_${set.unit}`);
  const rows = cellsShown(state)
    .filter((cell) => !state.hidden.has(cell))
    .flatMap((cell) => {
      const { start, end } = set.cells[cell];
      return Array.from({ length: end - start }, (_, k) => start + k).map((row) => {
        const own = [set.theta_i[row], set.theta_r[row], set.phi[row], set.value[row], set.uncertainty[row], state.result.modelled?.[row] ?? NaN];
        if (second) own.push(second.value[row], second.uncertainty[row]);
        return own.map((v) => (Number.isFinite(v) ? String(v) : "")).join(",");
      });
    });
  return [heads.join(","), ...rows, ""].join("\n");
}
