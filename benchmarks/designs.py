"""What designed readings are worth: bounds, whole designs, repeated measurements, and rival models told apart.

`make designs`, some minutes, writes benchmarks/designs.json. The surfaces are those of the paper, theta_i 30, 40 and 50
deg, theta_r -80 to 80 deg in steps of 2 deg, 5 deg about the beam blocked: 228 readings, with which designs among
directions a degree apart are compared.
"""

import json
import sys
from collections.abc import Iterator, Sequence
from datetime import date
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from rich.progress import track

from figures import machine
from gonio import Problem, catalogue, join, published, simulate
from gonio.design.continuous import continuous, distinct_bound, efficiency
from gonio.design.exact import chosen, exchanged, greedy
from gonio.design.next_readings import next_readings
from gonio.design.noise import Noise
from gonio.design.question import Question, aims_of
from gonio.design.rivals import Rival, told_apart
from gonio.fitting import Projection, Solution, fit
from gonio.fitting.objective.slopes import jacobian
from gonio.measured.dataset import geometry, points

Values = npt.NDArray[np.float64]
RECORD = Path(__file__).resolve().parent / "designs.json"
MODEL = catalogue["cauchy-lorentz"]
THREE, SIX = (30.0, 40.0, 50.0), (20.0, 30.0, 40.0, 50.0, 60.0, 70.0)
NOISES = {"1 % + 1": Noise(0.01, 1.0), "3 % + 0.1": Noise(0.03, 0.1), "constant 5": Noise(0.0, 5.0)}
WANTS = (("sigma",), ("gamma",), ("sigma", "gamma"))
# The truth is near, and a coarse grid with one local search finds it.
QUICK = Projection(grid=7, searches=1, rounds=1)
REPEATS, PILOT, DESIGNED = 60, 23, 53


class Reading(NamedTuple):
    """Rows (directions, values) of readings on a grid, with names and values of the free parameters."""

    names: list[str]
    values: Values
    rows: Values
    problem: Problem


def scan_of(name: str, angles: Sequence[float], step: float) -> xr.Dataset:
    values = {k: {a: v[a] for a in angles} if isinstance(v, dict) else v for k, v in published[name].values.items()}
    return simulate(MODEL, values, angles, np.arange(-80, 80 + step / 2, step), unit="a.u.", blocked=5)


def reading(name: str, angles: Sequence[float], step: float, noise: Noise) -> Reading:
    problem = Problem(MODEL, scan_of(name, angles, step), grouped={"ks": "theta_i"})
    true = published[name].values
    values = np.array([true["ks"][float(n[3:-1])] if n.startswith("ks") else true[n] for n in problem.names])
    deviation = noise.deviation(problem.brdf(values))
    return Reading(list(problem.names), values, jacobian(problem, values) / deviation[:, None], problem)


class Against(NamedTuple):
    """Directions to choose from, beside a uniform scan of 228 readings at three angles.

    targets (values,): standard uncertainties of the uniform scan. Of a ks that it has not, the median relative one of
    those that it has.
    """

    candidates: Reading
    targets: Values
    readings: int

    def question(self, want: Sequence[str]) -> Question:
        aims = aims_of(self.candidates.names, list(want), self.targets)
        return Question(self.candidates.rows, aims, np.zeros((len(self.targets),) * 2))

    def ratios(self, covariance: Values, want: Sequence[str]) -> list[float]:
        """Standard uncertainties over those of the uniform scan."""
        at = [self.candidates.names.index(name) for name in want]
        return [float(np.sqrt(covariance[k, k]) / self.targets[k]) for k in at]


def against(name: str, angles: Sequence[float], noise: Noise) -> Against:
    uniform, candidates = reading(name, THREE, 2.0, noise), reading(name, angles, 1.0, noise)
    spread = np.sqrt(np.diag(np.linalg.inv(uniform.rows.T @ uniform.rows)))
    known = dict(zip(uniform.names, spread, strict=True))
    relative = np.median([known[n] / v for n, v in zip(uniform.names, uniform.values, strict=True) if n[:2] == "ks"])
    pairs = zip(candidates.names, candidates.values, strict=True)
    return Against(candidates, np.array([known.get(n, relative * v) for n, v in pairs]), len(uniform.rows))


def fraction(case: Against, want: Sequence[str]) -> tuple[float, float]:
    """The part of the readings that suffices for the same uncertainties, and max q / sum w q of its design."""
    best = continuous(case.question(want), case.readings)
    return max(r**2 for r in case.ratios(best.covariance, want)), best.excess


def alike(case: Against) -> float:
    """The least fraction with which both sigma and gamma are as sure: their weights are found by halving."""
    low, high = 0.0, 1.0
    names, worse = case.candidates.names, 1.0
    for _ in range(10):
        share = (low + high) / 2
        weights = {"sigma": share, "gamma": 1 - share}
        aims = aims_of(names, list(weights), case.targets) * np.sqrt([weights.get(name, 1.0) for name in names])
        question = Question(case.candidates.rows, aims, np.zeros((len(names),) * 2))
        sigma, gamma = case.ratios(continuous(question, case.readings).covariance, WANTS[2])
        worse = max(sigma, gamma) ** 2
        low, high = (share, high) if sigma > gamma else (low, share)
    return worse


def whole(case: Against, count: int) -> dict[str, Any]:
    """The best distinct and repeated readings for sigma and gamma."""
    want = WANTS[2]
    question = case.question(want)
    first = greedy(question, count)
    places = exchanged(question, first)
    often = chosen(question, count, repeats=True)
    covariance = {
        k: question.covariance(question.information(counted(question, p)))
        for k, p in (("greedy", first), ("distinct", places), ("repeats", often))
    }
    bound = continuous(question, count).bound
    return {
        "ratios": case.ratios(covariance["distinct"], want),
        "greedy": question.value(covariance["greedy"]),
        "exchanged": question.value(covariance["distinct"]),
        "efficiency": efficiency(question, distinct_bound(question, places, count), covariance["distinct"]),
        "efficiency_of_repeats": efficiency(question, bound, covariance["repeats"]),
    }


def counted(question: Question, places: npt.NDArray[np.intp]) -> Values:
    return np.bincount(places, minlength=len(question.rows)).astype(float)


def measured_at(name: str, directions: xr.Dataset, noise: Noise, random: np.random.Generator) -> xr.Dataset:
    """Readings of a published surface at directions of one scan, with noise that they state."""
    incidence = directions["theta_i"].values
    true = {
        k: np.array([v[a] for a in incidence]) if isinstance(v, dict) else v for k, v in published[name].values.items()
    }
    brdf = np.asarray(MODEL(geometry(directions), true))
    deviation = noise.deviation(brdf)
    measured = brdf + deviation * random.standard_normal(len(brdf))
    units = {"units": "a.u."}
    return directions.assign(brdf=("direction", measured, units), uncertainty=("direction", deviation, units))


def fitted(scan: xr.Dataset) -> Solution:
    problem = Problem(MODEL, scan, grouped={"ks": "theta_i"}, weighting="uncertainty")
    return fit(problem, QUICK, covariance="absolute")


def repeated(name: str, noise: Noise, repeats: int) -> dict[str, Any]:
    """Fits of 228 uniform readings, and of a pilot with what was designed from it for gamma, over and over."""
    grid = points(scan_of(name, THREE, 2.0))
    candidates = points(scan_of(name, THREE, 1.0)).drop_vars("mask")
    pilot_at = np.round(np.linspace(0, grid.sizes["direction"] - 1, PILOT)).astype(int)
    found: dict[str, list[Solution]] = {"uniform": [], "designed": []}
    for seed in track(range(repeats), "repeated measurements", disable=repeats < REPEATS):
        random = np.random.default_rng(seed)
        found["uniform"].append(fitted(measured_at(name, grid, noise, random)))
        pilot = measured_at(name, grid.isel(direction=pilot_at), noise, random)
        plan = next_readings(fitted(pilot), candidates, DESIGNED, ["gamma"], noise=noise)
        more = measured_at(name, plan.directions, noise, random)
        both = join({"pilot": pilot, "designed": more}).drop_vars("scan")
        found["designed"].append(fitted(both))
    return {
        kind: {
            value: {
                "mean": float(np.mean([s.values[value] for s in some])),
                "sd": float(np.std([s.values[value] for s in some], ddof=1)),
                "stated": float(np.median([s.uncertainties[value] for s in some])),
            }
            for value in ("sigma", "gamma")
        }
        for kind, some in found.items()
    }


def told(name: str, rival: str, steps: int = 100) -> dict[str, float]:
    """Readings for a noncentrality of 16 on a uniform grid and by a T-optimal design, and no design's fewer than."""
    noise = NOISES["1 % + 1"]
    truth = reading(name, THREE, 1.0, noise)
    brdf = truth.problem.brdf(truth.values)
    problem = Problem(catalogue[rival], truth.problem.points, grouped={"ks": "theta_i"})
    made = Rival.of(problem, brdf, noise.deviation(brdf))
    uniform = told_apart([made], 0, np.ones(len(brdf)))
    best = told_apart([made], steps, np.full(len(brdf), 1 / len(brdf)), repeats=True)
    shape = dict(zip(made.problem.names, best.values.tolist(), strict=True))
    return {"uniform": uniform.readings, "t_optimal": best.readings, "least": 16 / best.largest} | {
        n: shape[n] for n in ("n", "sigma_m") if n in shape
    }


def table() -> Iterator[dict[str, Any]]:
    for noise_name, noise in NOISES.items():
        for angles in (THREE, SIX):
            for name in ("Al", "SR107"):
                case = against(name, angles, noise)
                for want in WANTS:
                    part, excess = fraction(case, want)
                    yield {
                        "noise": noise_name,
                        "theta_i": list(angles),
                        "surface": name,
                        "want": list(want),
                        "fraction": part,
                        "excess": excess,
                    }


def main() -> None:
    noise = NOISES["1 % + 1"]
    record = {
        "fractions": list(track(table(), "bounds", total=36)),
        "alike": {s: alike(against(s, THREE, noise)) for s in ("Al", "SR107")},
        "whole": {f"{s} {n}": whole(against(s, THREE, noise), n) for s in ("Al", "SR107") for n in (76, 114)},
        "repeated": repeated("Al", noise, REPEATS) | {"repeats": REPEATS},
        "rivals": {f"{s} {r}": told(s, r) for s in ("Al", "SR107") for r in ("liu-2016", "wang-2016")},
        "date": date.today().isoformat(),
        "machine": machine(),
    }
    RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    sys.exit(main())
