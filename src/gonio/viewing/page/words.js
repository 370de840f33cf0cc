// Numbers, symbols and units as people read them.

const GREEK = { alpha: "α", beta: "β", gamma: "γ", kappa: "κ", rho: "ρ", sigma: "σ", theta: "θ", tau: "τ" };

// The name of a parameter, with a Greek letter and an index.
export function symbol(name) {
  const [head, ...rest] = name.split("_");
  const own = document.createElement("span");
  own.append(GREEK[head] ?? head);
  if (rest.length) {
    const index = document.createElement("sub");
    index.textContent = rest.join("_");
    own.append(index);
  }
  return own;
}

export function number(value, digits = 4) {
  if (value === null || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  if (value === 0) return "0";
  const size = Math.abs(value);
  const text = size >= 1e-3 && size < 1e5 ? String(Number(value.toPrecision(digits))) : scientific(value, digits);
  return text.replace("-", "−");
}

function scientific(value, digits) {
  const [mantissa, power] = value.toExponential(digits - 1).split("e");
  return `${Number(mantissa)}e${Number(power)}`;
}

// Whether a name or a text of a file is safe needs no thought: it is only ever set as text, with its controls shown.
export function printable(text) {
  return String(text).replace(/[\u0000-\u001f\u007f-\u009f\u200e\u200f\u202a-\u202e\u2066-\u2069]/g, "\ufffd");
}

const UNITS = { 1: "", "sr-1": "sr⁻¹", degree: "deg", "deg sr-1": "deg sr⁻¹", um: "µm" };

export const unit = (name) => UNITS[name] ?? name;

// A weight has the unit of the data over that of its term.
export function unitOf(parameter, set) {
  if (!parameter.weight) return unit(parameter.unit);
  if (set.unit !== "sr-1") return "a.u.";
  return unit({ "sr-1": "1", 1: "sr-1", "deg-1": "deg sr-1" }[parameter.unit]);
}

export const QUANTITIES = {
  f: { label: "f", title: "The BRDF itself", factor: () => 1 },
  fcos: { label: "f cos θᵣ", title: "BRDF times the cosine of θᵣ: the scattered power", factor: (cosine) => cosine },
  pif: { label: "π f", title: "The reflectance factor: 1 for a perfect diffuser", factor: () => Math.PI },
};

// The label of the axis of values, with its unit.
export function valueLabel(state) {
  const set = state.sets[state.set];
  const what = { f: set.quantity, fcos: `${set.quantity} cos θᵣ`, pif: "π f, reflectance factor" }[state.quantity];
  const of = set.relative ? "a.u." : state.quantity === "pif" ? "" : set.unit_label === "1" ? "" : set.unit_label;
  return of ? `${what} [${of}]` : what;
}

export function blockLabel(set, k) {
  const said = Object.entries(set.blocks[k]).map(([name, value]) =>
    name === "wavelength" ? `${number(value, 6)} nm` : `${name} ${printable(value)}`,
  );
  return said.join(", ") || "all";
}

export function cellLabel(set, cell) {
  const { theta_i, phi_i } = set.cells[cell];
  const turned = set.cells.some((c) => c.phi_i !== 0);
  return `${number(theta_i)}°${turned ? `, φᵢ ${number(phi_i)}°` : ""}`;
}

export const measuredWord = (set) => (set.interpolated ? "interpolated" : set.origin);

// How many of its values are shown; nothing where all are.
export function shownOf(set) {
  if (set.interpolated) return `Interpolated at ${set.shown} directions from the ${set.total} values of the table.`;
  return set.shown < set.total ? `${set.shown} of ${set.total} values are shown.` : "";
}
