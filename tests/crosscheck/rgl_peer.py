"""Values of Mitsuba 3's `measured` at 10 000 random pairs of directions of each RGL file beside the project.

    python tests/crosscheck/rgl_peer.py FILE     writes FILE, which tests/crosscheck/rgl_agreement.py compares with gonio

Knows nothing of gonio. What is stored is what BSDF.eval returns, f cos(theta_r), in single precision. `measured` leaves
the number of an isotropic file's symmetries unset (its pull request 1850): a process may find it 4 by chance and mirror
directions. So every pair is evaluated with its mirror image too, and the two are stored.
"""

import sys
from pathlib import Path

import mitsuba as mi
import numpy as np
from mitsuba_peer import GRID, VARIANT, directions

FILES = Path(__file__).resolve().parents[3] / "shared" / "data" / "files" / "rgl"
SEED = 20261124
COUNT = 10_000
LEAST_COSINE = 0.02  # up to 88.9 deg
MIRRORED = np.array([1, -1, 1])


def evaluate(bsdf, pairs):
    """(pairs, 3) of R, G, B."""
    context, interaction = mi.BSDFContext(), mi.SurfaceInteraction3f()
    found = np.empty((len(pairs), 3), dtype=np.float32)
    for row, pair in zip(found, (pairs / GRID).tolist(), strict=True):
        interaction.wi = pair[:3]
        row[:] = bsdf.eval(context, interaction, mi.Vector3f(pair[3:]))
    return found


def main(out):
    files = sorted(FILES.glob("*.bsdf"))
    if not files:
        print(f"no RGL files at {FILES}: nothing to compare")
        return
    mi.set_variant(VARIANT)
    random = np.random.default_rng(SEED)
    found = {"version": np.array(mi.__version__), "seed": np.array(SEED)}
    for path in files:
        pairs = np.concatenate([directions(random, COUNT, LEAST_COSINE) for _ in range(2)], axis=-1)
        bsdf = mi.load_dict({"type": "measured", "filename": str(path)})
        found[f"{path.stem} directions"] = pairs
        found[path.stem] = evaluate(bsdf, pairs)
        found[f"{path.stem} mirrored"] = evaluate(bsdf, pairs * np.tile(MIRRORED, 2))
    np.savez_compressed(out, **found)
    print(f"{out}: {len(files)} files at {COUNT} pairs")


if __name__ == "__main__":
    main(sys.argv[1])
