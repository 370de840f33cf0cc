"""Mitsuba 3's `measured` and `measured_polarized` at random pairs of directions, for tests/crosscheck/rgl_agreement.py.

    python tests/crosscheck/rgl_peer.py FOLDER OUT

Knows nothing of gonio: evaluates the RGL files beside the project at 10 000 pairs each, the synthetic RGL files in
FOLDER at 1 000, the synthetic KAIST ones at their nodes, and writes the arrays to OUT. Values are those of BSDF.eval,
f times the cosine, in single precision. `measured` leaves the number of an isotropic file's symmetries unset (pull
request 1850 of Mitsuba 3): a process may find it to be 4 by chance and mirror the pairs whose x and y of w_i differ in
sign. So these pairs of an isotropic file are turned by a quarter first, which changes nothing else.
"""

import sys
from pathlib import Path

import mitsuba as mi
import numpy as np
from mitsuba_peer import GRID, directions

FILES = Path(__file__).resolve().parents[3] / "shared" / "data" / "files" / "rgl"
SEED = 20261124
COUNT, SYNTHETIC_COUNT = 10_000, 1_000
LEAST_COSINE = 0.02  # up to 88.9 deg
NODE = 1e-3  # sine of the angle from which on azimuths are well told


def evaluate(path, pairs, wavelengths=()):
    """(pairs, sets) of R, G, B or of the wavelengths [nm]."""
    bsdf, context, interaction = load("measured", path), mi.BSDFContext(), mi.SurfaceInteraction3f()
    count = len(wavelengths) or 3
    if len(wavelengths):
        interaction.wavelengths = np.resize(wavelengths, 4).tolist()
    found = np.empty((len(pairs), count), dtype=np.float32)
    for row, pair in zip(found, (pairs / GRID).tolist(), strict=True):
        interaction.wi = pair[:3]
        row[:] = list(bsdf.eval(context, interaction, mi.Vector3f(pair[3:])))[:count]
    return found


def load(kind, path):
    return mi.load_dict({"type": kind, "filename": str(path)})


def measured(path, count, random):
    """The arrays of one file."""
    tensors = mi.tensor_io.read(str(path))
    wavelengths = tensors.get("wavelengths", ())
    mi.set_variant("scalar_spectral" if len(wavelengths) else "scalar_rgb")
    pairs = np.concatenate([directions(random, count, LEAST_COSINE) for _ in range(2)], axis=-1)
    if len(tensors["phi_i"]) <= 2:
        pairs = turned(pairs)
    return {f"{path.stem} directions": pairs, path.stem: evaluate(path, pairs, wavelengths)}


def turned(pairs):
    """The pairs with x and y of w_i of one sign, by a quarter turn of both directions about z."""
    x_i, y_i, z_i, x_r, y_r, z_r = pairs.T
    quarter = np.stack([-y_i, x_i, z_i, -y_r, x_r, z_r], axis=-1)
    return np.where((x_i * y_i < 0)[:, None], quarter, pairs)


def nodes(tensors, random):
    """Indices (n, 3) of the nodes of phi_d, theta_d, theta_h above the horizon, and their w_i and w_r (n, 3)."""
    index = np.array(list(np.ndindex(tensors["M"].shape[:3])))
    p, d, h = (np.float64(tensors[n])[0][k] for n, k in zip(("phi_d", "theta_d", "theta_h"), index.T, strict=True))
    zero = np.zeros_like(h)
    half = np.stack([np.sin(h), zero, np.cos(h)], -1)
    along = np.stack([np.cos(h), zero, -np.sin(h)], -1)
    across = np.stack([zero, zero + 1, zero], -1)
    w_i = np.cos(d)[:, None] * half + np.sin(d)[:, None] * (np.cos(p)[:, None] * along + np.sin(p)[:, None] * across)
    w_r = 2 * np.sum(half * w_i, -1, keepdims=True) * half - w_i
    turn = random.uniform(0, 2 * np.pi, len(h))
    c, s = np.cos(turn), np.sin(turn)
    w_i, w_r = (np.stack([c * w[:, 0] - s * w[:, 1], s * w[:, 0] + c * w[:, 1], w[:, 2]], -1) for w in (w_i, w_r))
    good = (w_i[:, 2] > 0) & (w_r[:, 2] > 0) & (np.sin(h) > NODE) & (np.sin(d) > NODE) & (np.abs(p) < np.pi - NODE)
    return index[good], w_i[good], w_r[good]


def polarized(path, random):
    """Mueller matrices (n, wavelengths, 4, 4) over the cosine of w_i, x across the plane of the rays on both."""
    tensors = mi.tensor_io.read(str(path))
    mi.set_variant("scalar_spectral_polarized")
    bsdf, context = load("measured_polarized", path), mi.BSDFContext()
    index, w_i, w_r = nodes(tensors, random)
    found = np.empty((len(index), len(tensors["wvls"]), 4, 4))
    interaction = mi.SurfaceInteraction3f()
    for k, (source, detector) in enumerate(zip(w_i, w_r, strict=True)):
        across = np.cross(source, detector)
        vectors = (across / np.linalg.norm(across), -source, detector)
        x, forward, back = (mi.Vector3f(v.tolist()) for v in vectors)
        interaction.wi = back  # in radiance transport `wi` leads to the detector and `wo` to the source
        for m, wavelength in enumerate(tensors["wvls"].tolist()):
            interaction.wavelengths = [wavelength] * 4
            value = bsdf.eval(context, interaction, mi.Vector3f(source.tolist()))
            value = mi.mueller.rotate_mueller_basis(
                value, forward, mi.mueller.stokes_basis(forward), x, back, mi.mueller.stokes_basis(back), x
            )
            found[k, m] = np.array([[value[i, j][0] for j in range(4)] for i in range(4)]) / source[2]
    return {f"{path.stem} nodes": index, path.stem: found}


def main(folder, out):
    mi.set_variant("scalar_rgb")
    random = np.random.default_rng(SEED)
    found = {"version": np.array(mi.__version__), "seed": np.array(SEED)}
    files = sorted(FILES.glob("*.bsdf"))
    if not files:
        print(f"no RGL files at {FILES}: only synthetic ones are compared")
    for path in files:
        found |= measured(path, COUNT, random)
    for path in sorted(Path(folder).glob("*.bsdf")):
        found |= measured(path, SYNTHETIC_COUNT, random)
    for path in sorted(Path(folder).glob("*.pbsdf")):
        found |= polarized(path, random)
    np.savez_compressed(out, **found)
    print(f"{out}: {len(found)} arrays")


if __name__ == "__main__":
    main(*sys.argv[1:])
