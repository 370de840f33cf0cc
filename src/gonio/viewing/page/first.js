// The first answer: a scan that comes without a fit is fitted once its curves are drawn, as the button "Fit" does. It
// gives way to whatever the user does meanwhile.

import { served } from "gonio/source.js";

const frame = () => new Promise((done) => (document.hidden ? setTimeout(done, 0) : requestAnimationFrame(done)));

// What a user who did nothing leaves as it is.
const WATCHED = ["set", "model", "fit", "values", "locked", "dragging"];

export function mount(store, actions) {
  const state = store.get();
  let before = null;
  const isTouched = () => WATCHED.some((key) => state[key] !== before[key]);

  // A scan that is chosen, and fitted where it has no fit.
  actions.showSet = async (k) => {
    await actions.chooseSet(k);
    await actions.begin();
  };

  actions.begin = async () => {
    const set = state.sets[state.set];
    const isAsked = state.beginsWithFits && set.fittable && !Object.keys(set.fits).length;
    if (!served || !isAsked || state.job || state.values !== state.first_values) return;
    before = Object.fromEntries(WATCHED.map((key) => [key, state[key]]));
    await frame();
    await frame();
    if (!isTouched()) await actions.fit(false, isTouched);
  };

  store.watch(WATCHED, ({ job }) => {
    if (job?.unasked && isTouched()) actions.cancelFit();
  });
}
