// Below: how well the model agrees, and the measured value that is read.

import { atFit } from "gonio/band.js";
import { weighing } from "gonio/compute.js";
import { element } from "gonio/elements.js";
import { blockLabel, number, printable, unit } from "gonio/words.js";

export function mount(root, store) {
  const agreement = element("p", { className: "agreement" });
  const reading = element("p", { className: "reading" });
  reading.ariaLive = "polite";
  const wrong = element("p", { className: "error", role: "alert" });
  root.append(agreement, reading, wrong);

  function show(state) {
    const { result } = state;
    const set = state.sets[state.set];
    wrong.textContent = state.error ? printable(state.error) : "";
    if (result) {
      const { isAll, isBlock } = result.part;
      const of = isAll ? "values" : isBlock ? `values at ${blockLabel(set, state.block)}` : "values of the curves that are drawn";
      const means = `E ${number(result.cost, 3)} (${weighing(state).weighting} weighting), lg RMSE ${number(result.lgRmse, 3)}`;
      const about = result.count ? `${means} of ${result.count} ${of}` : "there is no value to compare it with";
      const fit = !state.fit ? "" : atFit(state) ? "; the fitted values" : `; the fit has E ${number(state.fit.cost, 3)}`;
      agreement.textContent = `${state.model.declaration.name}: ${about}${fit}.`;
    }
    reading.textContent = state.cursor ? read(state) : "";
  }

  store.watch(["result", "cursor", "set", "error"], show);
}

function read(state) {
  const set = state.sets[state.set];
  const { row } = state.cursor;
  const [value, u, modelled] = [set.value[row], set.uncertainty[row], state.result.modelled?.[row] ?? NaN];
  const of = unit(set.unit);
  const stated = u > 0 ? ` ± ${number(u, 2)}` : "";
  const plane = Number.isFinite(set.signed[row]);
  const to = plane ? `θᵣ ${number(set.signed[row])}°` : `θᵣ ${number(set.theta_r[row])}°, φ ${number(set.phi[row])}°`;
  const where = `θᵢ ${number(set.theta_i[row])}°, ${to}`;
  const model = Number.isFinite(modelled) ? `, model ${number(modelled)}, ratio ${number(modelled / value, 3)}` : "";
  return `${where}: ${number(value)}${stated} ${of}${model}.`;
}
