"""Fits of many scans against SciPy one by one, their cost from 1e3 to 1e6 scans (`--growth`), and one long scan.

Scans are simulated: 3 incidence angles of 161 directions in plane, Cauchy-Lorentz with one ks an incidence angle (seven
values), proportional noise of 2 %. SciPy's residual is written out for this model with all that is constant kept, so
that it is as quick as NumPy makes it.
"""

import json
import resource
import statistics
import sys
import time
from dataclasses import replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import least_squares

from figures import Figure, machine
from gonio import Geometry, Problem, catalogue
from gonio.fitting import FOR_MANY, Anneal, fit_many
from gonio.fitting.status import STATUSES

MODEL = catalogue["cauchy-lorentz"]
THETA_I = np.repeat([20.0, 40.0, 60.0], 161)
SIGNED = np.tile(np.linspace(-80.0, 80.0, 161), 3)
DIRECTIONS = {"theta_i": THETA_I, "theta_r": np.abs(SIGNED), "phi": np.where(SIGNED >= 0, 180.0, 0.0)}
GEOMETRY = Geometry.from_degrees(*DIRECTIONS.values())
GROUP = np.repeat([0, 1, 2], 161)
GROUPED = {"ks": "theta_i"}
RECORD = Path(__file__).with_name("growth.json")
ROUNDS, ALONE = 5, 40  # rounds, and scans that SciPy fits in each
SAME = 1e-6  # of E: the same minimum


def stack(lanes: int, seed: int = 1, dtype: str = "float64") -> xr.Dataset:
    """Simulated scans (sample, direction), in one array."""
    rng = np.random.default_rng(seed)
    values = np.empty((lanes, len(SIGNED)), dtype=dtype)
    for first in range(0, lanes, 4096):
        some = min(4096, lanes - first)
        shape = {"sigma": rng.uniform(0.08, 0.4, (some, 1)), "gamma": rng.uniform(10, 90, (some, 1))}
        basis = MODEL.basis(GEOMETRY, shape)
        ks, kdd, kid = (rng.uniform(*r, (some, n)) for *r, n in ((0.05, 0.6, 3), (1, 20, 1), (0.01, 0.1, 1)))
        exact = ks[:, GROUP] * basis["ks"] + kdd * basis["kdd"] + kid * basis["kid"]
        values[first : first + some] = exact * (1 + 0.02 * rng.standard_normal(exact.shape))
    coords = {name: ("direction", v, {"units": "degree"}) for name, v in DIRECTIONS.items()}
    return xr.Dataset({"brdf": (("sample", "direction"), values, {"units": "sr-1"})}, coords=coords)


class Alone:
    """SciPy's least_squares over all seven values of one scan, from the model's defaults and the best weights there."""

    def __init__(self) -> None:
        self.half_tan2 = np.asarray(GEOMETRY.tan_alpha_squared) / -2
        self.peak = MODEL.basis(GEOMETRY, {"sigma": 0.2})["ks"] * 0.04 / np.exp(self.half_tan2 / 0.04)
        self.theta_r2 = np.asarray(GEOMETRY.theta_r_deg) ** 2
        lower, upper = zip(*((p.lower, p.upper) for p in MODEL.shape.values()), strict=True)
        self.bounds = ([0.0] * 5 + list(lower), [np.inf] * 5 + list(upper))
        start = MODEL.basis(GEOMETRY, {"sigma": 0.2, "gamma": 45.0})
        self.columns = np.zeros((len(SIGNED), 5))
        self.columns[np.arange(len(SIGNED)), GROUP] = start["ks"]
        self.columns[:, 3], self.columns[:, 4] = start["kdd"], start["kid"]

    def residual(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        width, gamma = x[5] * x[5], x[6]
        facets = x[GROUP] * self.peak * np.exp(self.half_tan2 / width) / width
        return facets + (x[3] * gamma / np.pi) / (self.theta_r2 + gamma * gamma) + x[4] - y

    def fit(self, y: np.ndarray) -> float:
        """E at the minimum."""
        scale = np.sqrt(np.sum(y * y))
        weights = np.maximum(np.linalg.lstsq(self.columns, y / scale, rcond=None)[0], 1e-3)
        start = np.concatenate([weights, [0.2, 45.0]])
        return 2 * least_squares(self.residual, start, bounds=self.bounds, x_scale="jac", args=(y / scale,)).cost


def against_scipy(lanes: int = 10_000) -> dict[str, Any]:
    """How many times as quick a fit is as SciPy's, at the same minimum; both in turn, several rounds."""
    scans = stack(lanes)
    problem = Problem(MODEL, scans.isel(sample=0), grouped=GROUPED)
    fit_many(problem, scans.isel(sample=slice(0, 1000)), covariance="")
    alone, ratios, rates, excess = Alone(), [], [], []
    for round_ in range(ROUNDS):
        started = time.perf_counter()
        found = fit_many(problem, scans, covariance="")
        many = (time.perf_counter() - started) / lanes
        chosen = np.random.default_rng(round_).choice(lanes, ALONE, replace=False)
        values = scans["brdf"].values[chosen]
        started = time.perf_counter()
        costs = [alone.fit(y) for y in values]
        ratios.append((time.perf_counter() - started) / ALONE / many)
        rates.append(1 / many)
        excess += list(found["cost"].values[chosen] / np.array(costs) - 1)
    names, counts = np.unique(found["status"].values, return_counts=True)
    return {
        "ratio": statistics.median(ratios),
        "ratios": ratios,
        "fits_a_second": statistics.median(rates),
        "scipy_fits_a_second": statistics.median(r / q for r, q in zip(rates, ratios, strict=True)),
        "lanes": lanes,
        "converged": int(found["converged"].sum()),
        "statuses": {STATUSES[int(s)].name.lower(): int(n) for s, n in zip(names, counts, strict=True)},
        "compared": len(excess),
        "same_minimum": int(np.sum(np.abs(excess) <= SAME)),
        "scipy_is_worse": int(np.sum(np.array(excess) < -SAME)),
        "scipy_is_better": int(np.sum(np.array(excess) > SAME)),
    }


def growth(sizes: tuple[int, ...] = (1_000, 10_000, 100_000, 1_000_000)) -> dict[str, Any]:
    """Cost of a fit and peak memory beyond the stack itself, for more and more scans."""
    problem = Problem(MODEL, stack(1).isel(sample=0), grouped=GROUPED)
    fit_many(problem, stack(1000), covariance="")
    rows = []
    for size in sizes:
        scans = stack(size, dtype="float32")
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        started = time.perf_counter()
        found = fit_many(problem, scans, covariance="")
        seconds = time.perf_counter() - started
        after = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        rows.append(
            {
                "scans": size,
                "microseconds_a_fit": 1e6 * seconds / size,
                "stack_MB": scans["brdf"].nbytes / 1e6,
                "solution_MB": found.nbytes / 1e6,
                "peak_growth_MB": max(after - before, 0) / 1e3,
                "converged": int(found["converged"].sum()),
            }
        )
        print(rows[-1], flush=True)
    return {"rows": rows, "ratio": rows[-1]["microseconds_a_fit"] / rows[0]["microseconds_a_fit"]}


def thoroughness(lanes: int = 6_000) -> dict[str, Any]:
    """How often a search ends higher than a longer one, and what single precision does to E and to time."""
    scans = stack(lanes)
    problem = Problem(MODEL, scans.isel(sample=0), grouped=GROUPED)
    longer = fit_many(problem, scans, replace(FOR_MANY, searches=6, line=41), covariance="")["cost"].values
    found = fit_many(problem, scans, covariance="")
    excess = found["cost"].values / longer - 1
    narrow = fit_many(problem, scans, precision="float32", covariance="")["cost"].values / longer - 1
    return {
        "scans": lanes,
        "ended_higher": int(np.sum(excess > SAME)),
        "highest_excess_of_E": float(excess.max()),
        "single_precision_excess_of_E_median": float(np.median(np.abs(narrow))),
        "single_precision_excess_of_E_99th_percentile": float(np.percentile(np.abs(narrow), 99)),
    }


def long_scan(points: int = 100_000) -> dict[str, Any]:
    """Seconds for one scan of many samples, GGX with Fresnel reflectance of a conductor, after compilation."""
    rng = np.random.default_rng(0)
    angles = rng.uniform(0, 1, (3, points)) * np.array([[85.0], [85.0], [360.0]])
    directions = dict(zip(("theta_i", "theta_r", "phi"), angles, strict=True))
    model = catalogue["ggx"]
    truth = dict.fromkeys(model.weights, 0.7) | {"width": 0.3, "index": 1.5, "extinction": 0.3}
    values = model(Geometry.from_degrees(*angles), truth) * (1 + 0.02 * rng.standard_normal(points))
    coords = {name: ("direction", v, {"units": "degree"}) for name, v in directions.items()}
    scans = xr.Dataset({"brdf": (("sample", "direction"), values[None], {"units": "sr-1"})}, coords=coords)
    problem = Problem(model, scans.isel(sample=0))
    seconds = []
    for _ in range(ROUNDS + 1):
        started = time.perf_counter()
        found = fit_many(problem, scans, covariance="")
        seconds.append(time.perf_counter() - started)
    return {
        "seconds": statistics.median(seconds[1:]),
        "first_seconds": seconds[0],
        "points": points,
        "E": float(found["cost"][0]),
        "status": STATUSES[int(found["status"][0])].name.lower(),
    }


def annealed(lanes: int = 128, iterations: int = 2000) -> dict[str, Any]:
    """How many times as quick the annealing of a scan is among many as alone."""
    scans, anneal = stack(lanes), Anneal(max_iterations=iterations)
    problem = Problem(MODEL, scans.isel(sample=0), grouped=GROUPED)
    fit_many(problem, scans, anneal, covariance="")
    ratios = []
    for _ in range(ROUNDS):
        started = time.perf_counter()
        fit_many(problem, scans, anneal, covariance="")
        many = (time.perf_counter() - started) / lanes
        started = time.perf_counter()
        anneal.search(problem)
        ratios.append((time.perf_counter() - started) / many)
    return {"ratio": statistics.median(ratios), "ratios": ratios, "lanes": lanes, "iterations": iterations}


def measure() -> tuple[Figure, ...]:
    """Fits against SciPy's, one long scan, and annealing of many against that of one."""
    many, long, chains = against_scipy(), long_scan(), annealed()
    return (
        Figure("fits_over_scipy", many.pop("ratio"), details=many),
        Figure("long_scan_seconds", long.pop("seconds"), details=long),
        Figure("anneal_one_over_many", chains.pop("ratio"), details=chains),
    )


if __name__ == "__main__":
    if "--growth" in sys.argv[1:]:
        found = growth() | {"thoroughness": thoroughness(), "machine": machine(), "date": date.today().isoformat()}
        RECORD.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    else:
        print(*measure(), sep="\n")
