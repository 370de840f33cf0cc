"""Spectral fits: what smoothing gains over free values, and what many values of a shape parameter cost.

Writes docs/spectral-fits.md and prints it: `make spectral`. The simulated surface is that of
tests/fitting/objective/test_smooth.py, whose slope and reflectances vary smoothly over the spectrum.
"""

import importlib.util
import os
import platform
import sys
import time
from collections.abc import Callable
from datetime import date
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import scipy

from gonio import Problem, catalogue, join, simulate
from gonio.fitting import fit
from gonio.fitting.objective.slopes import quick_jacobian
from gonio.fitting.search.descent import LeastSquares, descend
from gonio.fitting.search.strength import resolved

HERE = Path(__file__).resolve().parent
PAGE = HERE.parent / "docs" / "spectral-fits.md"
SEEDS = 10
STRENGTHS = 10.0 ** np.arange(-9, 1.5, 0.5)
CASES: dict[str, tuple[int, dict[str, Any], str]] = {
    "10 % of each value": (8, {"noise": 0.1}, "uniform"),
    "10 % of each value, 12 wavelengths": (12, {"noise": 0.1}, "uniform"),
    "10 % of each value, 20 wavelengths": (20, {"noise": 0.1}, "uniform"),
    "10 % of each value, weighed by it": (12, {"noise": 0.1}, "relative"),
    "1 % of each value": (12, {"noise": 0.01}, "uniform"),
}


def loaded(path: Path) -> ModuleType:
    """A Python file as a module, wherever it lies."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


smooth = loaded(HERE.parent / "tests" / "fit" / "test_smooth.py")


def errors(count: int, noise: dict[str, Any], weighting: str, seed: int) -> tuple[float, float, float]:
    """Relative rms error over all values of a spectrum: free, of the chosen strengths, of the best one for all."""
    scan, x = smooth.spectrum(count, seed=seed, **noise)
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


def gains(case: str) -> str:
    count, noise, weighting = CASES[case]
    found = np.array([errors(count, noise, weighting, seed) for seed in range(SEEDS)])
    free, auto, fixed = np.sqrt(np.mean(found**2, axis=0))
    ratios = found[:, 1] / found[:, 2]
    noises = case.split(",")[0] + (", relative weighting" if weighting == "relative" else "")
    return (
        f"| {count} | {noises} | {100 * free:.2f} % | {100 * auto:.2f} % | {100 * fixed:.2f} % "
        f"| {free / auto:.2f} | {auto / fixed:.2f} | {ratios.max():.2f} |"
    )


def scan_of(name: str, values: dict[str, Callable[[float], float]]) -> Any:
    """16 wavelengths of 100 directions with 3 % of noise."""
    parts = {}
    for k, x in enumerate(np.linspace(0, 1, 16)):
        here = {parameter: value(float(x)) for parameter, value in values.items()}
        theta_r = np.linspace(-75, 75, 50)
        parts[str(k)] = simulate(
            catalogue[name], here, [20.0, 50.0], theta_r, noise=0.03, seed=k, wavelength=400 + 300 * float(x)
        )
    return join(parts).drop_vars("scan")


def cost(name: str, grouped: str, values: dict[str, Callable[[float], float]], held: dict[str, float]) -> str:
    """One row: a fit with one shape value for each wavelength against fits of each wavelength alone."""
    scan = scan_of(name, values)
    problem = Problem(catalogue[name], scan, grouped={grouped: "wavelength"}, held=held)
    started = time.perf_counter()
    solution = fit(problem)
    seconds = time.perf_counter() - started
    squares, whole = 0.0, sum(entry.size for entry in problem.free_shape) == 16
    for wavelength in np.unique(scan["wavelength"].values) if whole else ():
        here = scan.isel(direction=np.flatnonzero(scan["wavelength"].values == wavelength))
        alone = Problem(catalogue[name], here, held=held)
        squares += fit(alone).cost * alone.scale
    excess = f"{solution.cost * problem.scale / squares - 1:.0e}" if whole else "not apart"
    shared = ", ".join(entry.name for entry in problem.free_shape if entry.size == 1) or "none"
    return f"| {name} | {grouped} | {shared} | {len(problem.names)} | {seconds:.1f} s | {excess} |"


def machine() -> str:
    info = Path("/proc/cpuinfo")
    names = info.read_text().splitlines() if info.exists() else []
    cpu = next((line.split(":")[1].strip() for line in names if line.startswith("model name")), platform.machine())
    return f"{cpu}; Python {platform.python_version()}, NumPy {np.__version__}, SciPy {scipy.__version__}"


def markdown() -> str:
    sparrow = {"ks": lambda x: 0.4 + 0.3 * x, "kd": lambda x: 0.1, "sigma": lambda x: 0.15 + 0.1 * np.sin(2.5 * x)}
    glossy = {"rho_s": lambda x: 0.8, "rho_d": lambda x: 0.1, "width": sparrow["sigma"], "index": lambda x: 1.5}
    costs = [
        cost("torrance-sparrow", "sigma", sparrow, {}),
        cost("ggx", "width", glossy, {"index": 1.5, "extinction": 0.0}),
        cost("ggx", "width", glossy, {"extinction": 0.0}),
    ]
    load = os.getloadavg()[0] / (os.cpu_count() or 1)
    gained = "\n".join(map(gains, CASES))
    rows = "\n".join(costs)
    return f"""# Spectral fits

Made by `make spectral` on {date.today().isoformat()}; {machine()}; {load:.1f} running tasks a core.

## Smooth values

Torrance-Sparrow at wavelengths with uneven steps, {2 * smooth.COARSE} directions each; ks rises in a straight line,
kd and sigma bend. All three are smooth with strength `auto`. Errors are relative, rms over all values and
{SEEDS} seeds. "Best fixed" is the strength, one for all three and on a grid of half decades, that turned out nearest to
the truth: nobody can know it beforehand.

| wavelengths | noise | free | auto | best fixed | free / auto | auto / best fixed | the worst seed |
|---|---|---:|---:|---:|---:|---:|---:|
{gained}

## One shape value for each wavelength

16 wavelengths of 100 directions with 3 % of noise. The excess is that of E over the sum of fits which know nothing of
each other; where another shape parameter is shared the wavelengths cannot be fitted apart.

| model | one a wavelength | shared shape | values | time | excess of E |
|---|---|---|---:|---:|---:|
{rows}
"""


def main() -> int:
    page = markdown()
    PAGE.write_text(page, encoding="utf-8")
    print(page)
    return 0


if __name__ == "__main__":
    sys.exit(main())
