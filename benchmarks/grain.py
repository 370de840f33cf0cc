"""How often a simulated brushed metal comes back from its turned scans: `make grain`.

Writes benchmarks/grain.json: of REPEATS scans of each model with 1 % noise, in how many of 100 each value lies within
two of its standard uncertainties. A normal error does so in 95.4 of 100; of REPEATS that has a standard deviation of 1.
Each scan has noise of its own, and is weighted as `gonio fit` does where no weighting is asked for.
"""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from rich.progress import track

from gonio import Problem, catalogue, simulate
from gonio.fitting import Projection, fit
from gonio.fitting.solution import Solution

HERE = Path(__file__).resolve().parent
REPEATS, NOISE, WITHIN = 400, 0.01, 2.0
THETA_I, THETA_R, PHI_I = (10.0, 30.0, 50.0, 70.0), np.arange(-70.0, 71.0, 10.0), (0.0, 45.0, 90.0, 135.0)
ALUMINIUM = {"index": 1.37, "extinction": 7.62}
OF_BEST = {"gamma": 720.0, "s": 0.8, "rho_f": 0.0}
BRUSHED: dict[str, tuple[dict[str, float], dict[str, float], tuple[str, str, str]]] = {  # values, those held, asked for
    "ggx-grain": (
        {"rho_s": 0.8, "rho_d": 0.05, "w_x": 0.08, "w_y": 0.3, "psi": 20.0},
        ALUMINIUM,
        ("w_x", "w_y", "psi"),
    ),
    "beckmann-grain": (
        {"rho_s": 0.8, "rho_d": 0.05, "m_x": 0.08, "m_y": 0.3, "psi": 20.0},
        ALUMINIUM,
        ("m_x", "m_y", "psi"),
    ),
    "student-t-grain": (
        {"rho_s": 0.8, "rho_d": 0.05, "w_x": 0.08, "w_y": 0.3, "psi": 20.0, "c": 2.5},
        ALUMINIUM,
        ("w_x", "w_y", "psi"),
    ),
    "gonio-best-grain": (
        {"rho_u": 0.3, "rho_s": 0.8, "rho_dd": 0.05, "f0": 0.9, "h": 2.0, "width": 0.05, "c": 1.8, "m_x": 0.08}
        | {"m_y": 0.3, "psi": 20.0},
        OF_BEST,
        ("m_x", "m_y", "psi"),
    ),
}
SOLVER = Projection(grid=3, searches=2, line=5, rounds=1)


def scan(name: str, seed: int, noise: float = NOISE) -> xr.Dataset:
    """A brushed metal in plane at four azimuths of its stage; its grain stands at 20 deg."""
    values, held, _ = BRUSHED[name]
    return simulate(catalogue[name], values | held, THETA_I, THETA_R, noise=noise, seed=seed, phi_i=PHI_I)


def solved(name: str, measured: xr.Dataset) -> Solution:
    return fit(Problem(catalogue[name], measured, weighting="auto", held=BRUSHED[name][1]), SOLVER)


def fitted(name: str, seed: int) -> Solution:
    return solved(name, scan(name, seed))


def errors(name: str, seed: int) -> list[float]:
    """Of both widths and the azimuth, in standard uncertainties."""
    solution, (values, _, asked) = fitted(name, seed), BRUSHED[name]
    return [(solution.values[n] - values[n]) / solution.uncertainties[n] for n in asked]


def main() -> int:
    found: dict[str, Any] = {}
    for k, (name, (_, _, asked)) in enumerate(BRUSHED.items()):
        seeds = range(k * REPEATS, (k + 1) * REPEATS)
        off = np.array([errors(name, seed) for seed in track(seeds, name, disable=not sys.stderr.isatty())])
        within = np.abs(off) <= WITHIN
        found[name] = dict(zip(asked, (100 * within.mean(axis=0)).round(1).tolist(), strict=True)) | {
            "all three": round(100 * float(within.all(axis=1).mean()), 1),
            "rms error over uncertainty": [float(f"{v:.3g}") for v in np.sqrt((off**2).mean(axis=0))],
        }
        print(name, found[name], flush=True)
    record = {"repeats": REPEATS, "noise": NOISE, "within": WITHIN, "models": found}
    (HERE / "grain.json").write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
