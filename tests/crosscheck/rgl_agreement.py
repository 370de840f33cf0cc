"""gonio against what tests/crosscheck/rgl_peer.py evaluated; writes tests/reference/peers/rgl.json.

    python tests/crosscheck/rgl_agreement.py samples FOLDER     writes the synthetic files for the peer
    python tests/crosscheck/rgl_agreement.py compare FOLDER ALL

Every pair is compared; 500 of a real file and 50 of a synthetic one are kept for tests/test_rgl_peer.py, with the
largest differences over all of them. Differences are relative to the largest f cos(theta_r) of the file's pairs. Single
precision places a direction in the warp to 6e-8 of a turn, many cells wide, so relative to the value itself a few steep
places are worse than the bar.
"""

import sys
from pathlib import Path

import numpy as np

from gonio import read

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[1] / "tools"))
from crosscheck.peers import write
from gonio.formats.rgl.file import evaluate
from places import FILES as SHARED_FILES
from samples import pbsdf, rgl

FILES = SHARED_FILES / "rgl"
GRID = 2**24
KEPT, KEPT_SYNTHETIC = 500, 50
BAR = 1e-5
BIAS = 1e-6  # rounding has no preferred sign, a difference in form has


def angles(pairs):
    """theta_i, theta_r, phi, phi_i [deg] of integer directions (n, 6)."""
    w = np.asarray(pairs) / GRID
    theta = [np.degrees(np.arctan2(np.hypot(w[:, k], w[:, k + 1]), w[:, k + 2])) for k in (0, 3)]
    azimuth = [np.degrees(np.arctan2(w[:, k + 1], w[:, k])) for k in (0, 3)]
    return theta[0], theta[1], azimuth[1] - azimuth[0], azimuth[0]


def differences(path, pairs, expected):
    """The differences of f cos(theta_r) (n, sets) and the largest value of each pair (n,), over the largest of all."""
    scan = read(path)
    theta_i, theta_r, phi, phi_i = angles(pairs)
    found = np.atleast_2d(evaluate(scan, theta_i, theta_r, phi, phi_i)).T * np.cos(np.radians(theta_r))[:, None]
    last = scan["theta_i"].values.max()
    expected = np.asarray(expected, dtype=float)[:, : found.shape[1]]
    inside = theta_i <= (last if last < 89.99 else 90)
    error = (found - expected)[inside]
    return error / np.abs(expected).max(), np.abs(expected)[inside].max(axis=1) / np.abs(expected).max()


def path_of(stem, folder):
    return next(p for p in (FILES / f"{stem}.bsdf", Path(folder) / f"{stem}.bsdf") if p.exists())


def compare(folder, everything):
    stored = np.load(everything)
    columns, surfaces = {}, {}
    for stem in [n.removesuffix(" directions") for n in stored.files if n.endswith(" directions")]:
        pairs, expected = stored[f"{stem} directions"], stored[stem]
        path = path_of(stem, folder)
        error, value = differences(path, pairs, expected)
        worst, bias = np.abs(error).max(), abs(error.sum()) / value.sum() / error.shape[1]
        share = np.mean(np.abs(error).max(axis=1) <= BAR * value)
        print(f"{stem}: {len(pairs)} pairs, largest {worst:.2g}, bias {bias:.1g}, to {BAR:g} of itself {share:.4f}")
        assert worst <= BAR, f"{stem} disagrees"
        assert bias <= BIAS, f"{stem} disagrees"
        told = {"largest_difference": worst, "bias": bias, "within_bar": share}
        surfaces[stem] = {"pairs": len(pairs)} | {n: float(f"{v:.3g}") for n, v in told.items()}
        kept = KEPT if path.parent == FILES else KEPT_SYNTHETIC
        columns[f"directions {stem}"] = pairs[:kept].T.tolist()
        columns[stem] = [[float(str(v)) for v in column] for column in expected[:kept].T]
    for stem in pbsdf.VARIANTS:
        scan = read(Path(folder) / f"{stem}.pbsdf")
        index, expected = stored[f"{stem} nodes"], stored[stem]
        found = scan["mueller"].transpose("phi_d", "theta_d", "theta_h", "wavelength", ...).values[tuple(index.T)]
        worst = np.abs(found - expected).max() / np.abs(expected).max()
        print(f"{stem}: {len(index)} nodes, largest difference {worst:.2g}")
        assert worst <= BAR, f"{stem} disagrees"
        surfaces[f"{stem}.pbsdf"] = {"pairs": len(index), "largest_difference": float(f"{worst:.3g}")}
        columns[f"nodes {stem}.pbsdf"] = index.T.tolist()
        columns[f"{stem}.pbsdf"] = [float(f"{v:.7g}") for v in expected[:, 0].ravel()]
    about = {
        "peer": "Mitsuba",
        "version": str(stored["version"]),
        "plugins": "measured, measured_polarized",
        "precision": "single",
        "seed": int(stored["seed"]),
        "value": "f cos(theta_r) [1/sr] as BSDF.eval returns it, a list a channel or wavelength; .pbsdf: f, all 16",
        "directions": f"x y z of w_i, x y z of w_r, each times {GRID}",
        "largest_difference": "of gonio over all pairs, relative to the largest value of the file's pairs",
        "bias": "the sum of the differences over the sum of the values",
        "within_bar": f"share of the pairs that agree to {BAR:g} relative to themselves",
    }
    write("rgl.json", about, columns, surfaces)


if __name__ == "__main__":
    if sys.argv[1] == "samples":
        Path(sys.argv[2]).mkdir(parents=True, exist_ok=True)
        rgl.samples(Path(sys.argv[2]))
        rgl.written(Path(sys.argv[2]))
        pbsdf.samples(Path(sys.argv[2]))
    else:
        compare(sys.argv[2], sys.argv[3])
