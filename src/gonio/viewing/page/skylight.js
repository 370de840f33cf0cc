// The reflectance under a sky that is equally bright everywhere, for the view from each direction.

import { SKY } from "gonio/shading.js";

const NODES = { about: 24, around: 16 }; // of directions to the sky, about the mirror direction of the eye
const SLOW = 1; // ms for one entry: of a slower model fewer entries are computed
const FEW = 9;

// rho(theta_r) = integral of f(w_i, w_r) cos(theta_i) over the hemisphere of w_i, at even steps of cos(theta_r).
export function skyTable(module, values) {
  const pre = module.pre(values);
  const begun = performance.now();
  const first = reflectance(module, values, pre, 1);
  const count = performance.now() - begun > SLOW ? FEW : SKY;
  const known = Array.from({ length: count }, (_, k) => (k === count - 1 ? first : reflectance(module, values, pre, Math.max(k / (count - 1), 0.01))));
  return Array.from({ length: SKY }, (_, k) => {
    const place = (k / (SKY - 1)) * (count - 1);
    const low = Math.min(Math.floor(place), count - 2);
    return known[low] + (known[low + 1] - known[low]) * (place - low);
  });
}

// Nodes are dense about the mirror direction, where the light comes from that a narrow lobe sends to the eye.
export function reflectance(module, values, pre, cosine) {
  const sine = Math.sqrt(1 - cosine * cosine);
  const wr = [sine, 0, cosine];
  let sum = 0;
  for (let a = 0; a < NODES.about; a++) {
    const x = (a + 0.5) / NODES.about;
    const polar = Math.PI * x ** 3;
    const weight = ((3 * Math.PI * x * x) / NODES.about) * Math.sin(polar) * ((2 * Math.PI) / NODES.around);
    const [s, c] = [Math.sin(polar), Math.cos(polar)];
    for (let b = 0; b < NODES.around; b++) {
      const azimuth = (2 * Math.PI * (b + 0.5)) / NODES.around;
      const [u, v] = [s * Math.cos(azimuth), s * Math.sin(azimuth)];
      const wi = [cosine * u - sine * c, v, cosine * c + sine * u];
      if (wi[2] <= 0) continue;
      const f = module.reflected(values, pre, module.inc(values, pre, wi), wi, wr);
      if (Number.isFinite(f)) sum += f * wi[2] * weight;
    }
  }
  return sum;
}
