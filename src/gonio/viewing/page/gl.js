// One WebGL 2 context for all views: each draws into a part of its canvas, and copies that into a canvas of its own.
//
// Browsers keep few contexts, and a page in a notebook shares them with others: see `release`. After a loss of the
// context everything that was made in it is made again when it is next asked for.

import { Camera, Geometry, Mesh, Program, Renderer, Texture } from "gonio/vendor/ogl.js";

import * as source from "gonio/source.js";

const ATTRIBUTES = { alpha: true, depth: true, antialias: false, premultipliedAlpha: true, preserveDrawingBuffer: false };
const KEPT = 6; // programs of models: those that were used last
const DRAGGED = 12; // ms that a view may take while something is dragged
const RESTING = 400; // ms that it may take then: a model that integrates for every direction is drawn coarser
const TRIES = 3; // drawings at rest
const PAUSE = 150; // ms after which what was dragged is drawn as it should be

const shared = {
  canvas: null,
  renderer: null,
  made: new Map(),
  programs: new Map(),
  cost: new Map(), // ms for each pixel
  lost: false,
  compiled: false, // whether a program was made since the last drawing began
  finer: false, // whether a view that was drawn at rest could have more pixels
};

// Opens the context, and tells the views by `graphics` of the store when they have to draw anew.
export function start(store) {
  const canvas = document.createElement("canvas");
  if (!canvas.getContext("webgl2", ATTRIBUTES)) {
    store.set({ graphics: 0 });
    return;
  }
  shared.canvas = canvas;
  renew();
  store.set({ graphics: 1 });
  canvas.addEventListener("webglcontextlost", (event) => {
    event.preventDefault(); // without this it is not given back
    shared.lost = true;
    store.set({ graphics: -store.get().graphics });
  });
  canvas.addEventListener("webglcontextrestored", () => {
    shared.lost = false;
    renew();
    store.set({ graphics: 1 - store.get().graphics });
  });
  window.addEventListener("pagehide", release);
  window.addEventListener("pageshow", (event) => event.persisted && extension()?.restoreContext());
  store.watch(["model"], (state) => state.model && load(store, state.model.declaration.name));
}

// What a view says where it cannot draw.
export function excuse(graphics) {
  if (graphics > 0) return "";
  if (graphics < 0) return "The graphics driver has stopped for a moment: this is drawn again as soon as it is back.";
  return "This browser has no WebGL 2, which draws this view. The curves and the table hold the same numbers.";
}

// Gives the context back to the browser.
export function release() {
  extension()?.loseContext();
}

let losing = null;

function extension() {
  losing ??= shared.renderer?.gl.getExtension("WEBGL_lose_context") ?? null;
  return losing;
}

function renew() {
  shared.made.clear();
  shared.programs.clear();
  const { width, height } = shared.canvas;
  shared.renderer = new Renderer({ canvas: shared.canvas, width, height, ...ATTRIBUTES });
  // OGL takes this for given: three colours are drawn one after the other, each as near as the one before.
  shared.renderer.gl.depthFunc(shared.renderer.gl.LEQUAL);
}

// The shader of a model: {name, text}, or {name, why} where there is none.
async function load(store, name) {
  if (store.get().shader?.name === name) return;
  let shader;
  try {
    shader = { name, text: await source.shader(name) };
  } catch (error) {
    shader = { name, why: `No shader of ${name}: ${error.message}` };
  }
  if (store.get().model.declaration.name === name) store.set({ shader });
}

// What is made once in a context: by `make(gl)`, under a name.
export function once(name, make) {
  if (!shared.made.has(name)) shared.made.set(name, make(shared.renderer.gl));
  return shared.made.get(name);
}

// What was made under a name is made anew when it is next asked for.
export function forget(name) {
  shared.made.delete(name);
}

// A program of GLSL; throws an Error that says in words what the driver says where it does not compile.
export function program(name, vertex, fragment, uniforms, options = {}) {
  const known = shared.programs.get(name);
  if (known?.fragment === fragment) {
    shared.programs.delete(name);
    shared.programs.set(name, known); // the last that was used
    if (known.why) throw new Error(known.why);
    Object.assign(known.program.uniforms, uniforms);
    return known.program;
  }
  const { gl } = shared.renderer;
  shared.compiled = true;
  const made = { program: new Program(gl, { vertex, fragment, uniforms, cullFace: null, ...options }), fragment, why: "" };
  if (!gl.getProgramParameter(made.program.program, gl.LINK_STATUS) && !gl.isContextLost()) {
    const said = gl.getShaderInfoLog(made.program.fragmentShader) || gl.getProgramInfoLog(made.program.program) || "";
    made.why = `The graphics driver does not compile ${name}: ${said.split("\n")[0].replaceAll("\u0000", "")}`;
  }
  shared.programs.set(name, made);
  for (const [other, old] of shared.programs) {
    if (shared.programs.size <= KEPT) break;
    old.program.remove();
    shared.programs.delete(other);
  }
  if (made.why) throw new Error(made.why);
  return made.program;
}

export function texture(gl, image, width, height, format = {}) {
  const options = { generateMipmaps: false, flipY: false, minFilter: gl.NEAREST, magFilter: gl.NEAREST };
  return new Texture(gl, { image, width, height, ...options, ...format });
}

export const geometry = (gl, attributes) => new Geometry(gl, attributes);

export const mesh = (gl, options) => new Mesh(gl, { frustumCulled: false, ...options });

// A camera that looks down from +z, without perspective.
export function camera(gl, half = 1) {
  const made = new Camera(gl, { left: -half, right: half, bottom: -half, top: half, near: -10, far: 10 });
  made.updateMatrixWorld();
  return made;
}

// Draws by `draw(gl)` into a box [device pixels] of a 2-D context, with `share` of its pixels in each direction.
export function paint(ctx, box, share, draw) {
  const { canvas, renderer } = shared;
  const { gl } = renderer;
  const [width, height] = [box.width, box.height].map((n) => Math.max(1, Math.round(n * share)));
  if (canvas.width < width || canvas.height < height) renderer.setSize(Math.max(canvas.width, width), Math.max(canvas.height, height));
  renderer.bindFramebuffer();
  renderer.state.viewport.width = null; // a canvas that has grown has another one
  renderer.setViewport(width, height);
  renderer.enable(gl.DEPTH_TEST);
  renderer.setDepthMask(true);
  gl.colorMask(true, true, true, true);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  draw(gl);
  ctx.imageSmoothingEnabled = share < 1;
  ctx.drawImage(canvas, 0, canvas.height - height, width, height, box.x, box.y, box.width, box.height);
}

// Draws by `work(share)` with that share of the pixels in each direction for which there is time. What a pixel takes is
// remembered under a name. Graphics in software have drawn when the picture is copied; a card is fast enough not to wait for.
export function paced(name, pixels, coarse, work) {
  const share = shareOf(name, pixels, coarse);
  const begun = performance.now();
  shared.compiled = false;
  work(share);
  const each = (performance.now() - begun) / Math.max(pixels * share * share, 1);
  const known = shared.cost.get(name);
  // A drawing that compiles too says little of the next, and one of few pixels less than one at rest.
  if (!shared.compiled && known) shared.cost.set(name, coarse ? 0.5 * (known + each) : each);
  else shared.cost.set(name, known ?? Math.min(each, RESTING / 250_000));
  shared.finer ||= !coarse && shareOf(name, pixels, coarse) > share;
}

function shareOf(name, pixels, coarse) {
  const each = shared.cost.get(name);
  if (!each) return coarse ? 0.5 : 0.25; // the first time: a try
  const share = Math.sqrt((coarse ? DRAGGED : RESTING) / (each * pixels));
  return share >= 1 ? 1 : Math.max(1 / Math.ceil(1 / share), 1 / 8);
}

// Calls paint(true) at once, and paint(false) when it was not asked for again for a moment; then again where that
// shows that there is time for more pixels: few of them tell little, as each drawing takes some time of its own.
export function settling(paint) {
  let timer = 0;
  const rest = () => {
    shared.finer = true;
    for (let k = 0; k < TRIES && shared.finer; k++) {
      shared.finer = false;
      paint(false);
    }
  };
  return () => {
    paint(true);
    clearTimeout(timer);
    timer = setTimeout(rest, PAUSE);
  };
}
