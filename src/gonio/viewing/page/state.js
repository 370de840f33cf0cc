// What the page shows: one plain object, and who is to be told when a part of it changes.
//
// sets        the scans: header and columns of each, with its fits
// set, block  which scan, and which of its sets of directions (wavelength, channel ..)
// hidden      a Set of cells (curves) that are not drawn
// cell        the cell that map and lobe show
// model       {declaration, module, shader} of the model; null before it is loaded
// values      for each parameter of the model an array of its values, one for each group
// groups      for each parameter an array with the group of each cell of the set
// locked      a Set of places of parameters that stay where they are
// fit         the record of the fit that the values began with, or null
// follow      whether the weights follow the shape
// quantity    f, fcos or pif        scale   log or linear
// result      curves, residuals and agreement of the values; see compute.js
// cursor      {cell, row}, the measured value that is read, or null
// job         the fit that is running: {number, set, fraction, name, unasked}, or null; unasked: the page began it
// second      the place of the scan that is compared, -1 for none
// pair        its values at the directions of the first, difference the same as numbers alone; null without one
// pairAs      ratio or difference           dragging  whether the curve is dragged
// graphics    above 0: WebGL draws, 0: there is none, below 0: it was lost; another number means that all is drawn anew
// shader      {name, text} of the model, or {name, why} where there is none
// mapView     both, data, model, ratio or difference: what the hemisphere shows
// difference  values of a second scan at the rows of the set, or null
// body, lamp  what is lit, and from where: degrees to the right and upwards, as the eye sees it
// exposure    in stops, null for what suits the body
// litFrom     model, or table: the values of the file; null before one was chosen     tables: how many tables of files have come
// orbit       from where the lobe is seen: how far it is turned and tilted [deg]
// findings    of the scan whose findings came last: what `gonio check` warns of
// tableOpen   whether the curves are shown as a table, too
// error       what went wrong, to be shown

// The next frame; a hidden page is given none.
export const frame = () => new Promise((done) => (document.hidden ? setTimeout(done, 0) : requestAnimationFrame(done)));

export function createStore(state) {
  const watchers = [];
  let changed = new Set();
  let queued = false;

  function flush() {
    queued = false;
    // A watcher may set something that another watcher waits for: those after it in the list are told in this round.
    for (const watcher of watchers) {
      if (watcher.of.some((key) => changed.has(key))) watcher.call(state);
    }
    changed = new Set();
  }

  return {
    get: () => state,
    set(patch) {
      for (const [key, value] of Object.entries(patch)) {
        if (state[key] !== value) {
          state[key] = value;
          changed.add(key);
        }
      }
      if (changed.size && !queued) {
        queued = true;
        if (document.hidden) setTimeout(flush, 0); // a hidden page is given no frames
        else requestAnimationFrame(flush);
      }
    },
    // `call` is called once a frame after one of the keys has changed; what is watched first is called first.
    watch(of, call) {
      watchers.push({ of, call });
    },
    // At once, and not in the next frame: for tests, and for what is exported.
    flush,
  };
}
