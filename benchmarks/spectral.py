"""Spectral fits: what smoothing gains over free values, and what many values of a shape parameter cost.

`make spectral` writes benchmarks/spectral.json, of which docs/pages/spectral_fits.py makes a page. The simulated
surface is that of tests/fitting/objective/test_smooth.py, whose slope and reflectances vary smoothly over the spectrum.
"""

import json
import os
import sys
import time
from collections.abc import Callable
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from figures import machine
from gonio import Problem, catalogue, join, simulate
from gonio.fitting import fit
from gonio.fitting.objective.slopes import quick_jacobian
from gonio.fitting.search.descent import LeastSquares, descend
from gonio.fitting.search.strength import resolved
from places import ROOT, loaded

RECORD = Path(__file__).resolve().parent / "spectral.json"
SEEDS = 10
STRENGTHS = 10.0 ** np.arange(-9, 1.5, 0.5)
CASES = (  # wavelengths, noise relative to each value, weighting
    (8, 0.1, "uniform"),
    (12, 0.1, "uniform"),
    (20, 0.1, "uniform"),
    (12, 0.1, "relative"),
    (12, 0.01, "uniform"),
)
WAVELENGTHS, THETA_I, THETA_R, NOISE = 16, [20.0, 50.0], np.linspace(-75, 75, 50), 0.03  # where fits are timed

smooth = loaded(ROOT / "tests" / "fitting" / "objective" / "test_smooth.py")


def errors(count: int, noise: float, weighting: str, seed: int) -> tuple[float, float, float]:
    """Relative rms error over all values of a spectrum: free, of the chosen strengths, of the best one for all."""
    scan, x = smooth.spectrum(count, noise, seed)
    true = np.concatenate([smooth.truth(x)[name] for name in ("ks", "kd", "sigma")])
    problem = resolved(Problem(smooth.SPARROW, scan, smooth=smooth.SMOOTH, weighting=weighting))

    def error(chosen: dict[str, Any]) -> float:
        one = Problem(smooth.SPARROW, scan, smooth=chosen, weighting=weighting)
        squares = LeastSquares(one.residual, one.lower, one.upper, jacobian=lambda v: quick_jacobian(one, v))
        end = descend(squares, true, last_digits=False)
        return float(np.sqrt(np.mean((end.point / true - 1) ** 2)))

    def alike(strength: float) -> float:
        return error({name: one._replace(strength=strength) for name, one in problem.smoothed.items()})

    return alike(0.0), error(problem.smoothed), min(map(alike, STRENGTHS))


def gain(count: int, noise: float, weighting: str) -> dict[str, Any]:
    """Errors over all seeds, and how much larger than with the best strength the chosen one makes that of a seed."""
    of_seeds = np.array([errors(count, noise, weighting, seed) for seed in range(SEEDS)])
    free, auto, fixed = map(float, np.sqrt(np.mean(of_seeds**2, axis=0)))
    largest = float(np.max(of_seeds[:, 1] / of_seeds[:, 2]))
    row = {"wavelengths": count, "noise": noise, "weighting": weighting}
    return row | {"free": free, "auto": auto, "best_fixed": fixed, "largest_auto_over_best_fixed": largest}


def scan_of(name: str, values: dict[str, Callable[[float], float]]) -> Any:
    """A simulated scan whose values are functions of the place in the spectrum, from 0 to 1."""
    parts = {}
    for k, x in enumerate(np.linspace(0, 1, WAVELENGTHS)):
        here = {parameter: value(float(x)) for parameter, value in values.items()}
        wavelength = 400 + 300 * float(x)
        parts[str(k)] = simulate(catalogue[name], here, THETA_I, THETA_R, noise=NOISE, seed=k, wavelength=wavelength)
    return join(parts).drop_vars("scan")


def cost(
    name: str, grouped: str, values: dict[str, Callable[[float], float]], held: dict[str, float]
) -> dict[str, Any]:
    """A fit with one shape value for each wavelength, and how far its E is above that of fits of one wavelength each.

    There is no such excess where another shape parameter is shared by all wavelengths.
    """
    scan = scan_of(name, values)
    problem = Problem(catalogue[name], scan, grouped={grouped: "wavelength"}, held=held)
    started = time.perf_counter()
    solution = fit(problem)
    seconds = time.perf_counter() - started
    squares, whole = 0.0, sum(entry.size for entry in problem.free_shape) == WAVELENGTHS
    for wavelength in np.unique(scan["wavelength"].values) if whole else ():
        here = scan.isel(direction=np.flatnonzero(scan["wavelength"].values == wavelength))
        alone = Problem(catalogue[name], here, held=held)
        squares += fit(alone).cost * alone.scale
    return {
        "model": name,
        "grouped": grouped,
        "shared": [entry.name for entry in problem.free_shape if entry.size == 1],
        "values": len(problem.names),
        "seconds": seconds,
        "excess_of_E": solution.cost * problem.scale / squares - 1 if whole else None,
    }


def main() -> int:
    sparrow = {"ks": lambda x: 0.4 + 0.3 * x, "kd": lambda x: 0.1, "sigma": lambda x: 0.15 + 0.1 * np.sin(2.5 * x)}
    glossy = {"rho_s": lambda x: 0.8, "rho_d": lambda x: 0.1, "width": sparrow["sigma"], "index": lambda x: 1.5}
    costs = [
        cost("torrance-sparrow", "sigma", sparrow, {}),
        cost("ggx", "width", glossy, {"index": 1.5, "extinction": 0.0}),
        cost("ggx", "width", glossy, {"extinction": 0.0}),
    ]
    record = {
        "machine": machine(),
        "date": date.today().isoformat(),
        "load_a_core": os.getloadavg()[0] / (os.cpu_count() or 1),
        "seeds": SEEDS,
        "strengths": [float(STRENGTHS[0]), float(STRENGTHS[-1])],
        "directions": 2 * smooth.COARSE,
        "costs_of": {"wavelengths": WAVELENGTHS, "directions": len(THETA_I) * len(THETA_R), "noise": NOISE},
        "costs": costs,
        "gains": [],
    }
    for case in CASES:
        record["gains"].append(gain(*case))
        print(record["gains"][-1], flush=True)
    RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    print(*costs, sep="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
