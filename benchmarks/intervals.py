"""Coverage: how often stated 95 % intervals hold the truth, over many simulated scans of several models.

`make intervals`, half an hour, writes benchmarks/intervals.json, of which docs/pages/intervals.py makes a page. With
names of cases as arguments only these are measured anew; the others stay as they are.
"""

import json
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import date
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from rich.progress import track

from figures import machine
from gonio import Problem, catalogue, published, simulate
from gonio.fitting import Projection, Solution, fit
from gonio.fitting.certainty.band import band
from gonio.fitting.certainty.bootstrap import KINDS, bca, bootstrap, percentile
from gonio.fitting.certainty.covariance import covariance
from gonio.fitting.certainty.profile import rises
from gonio.fitting.covariance_kinds import COVARIANCES
from gonio.model import Model

RECORD = Path(__file__).resolve().parent / "intervals.json"
SCANS = 500
LEVEL = 0.95
THETA_I = (30.0, 40.0, 50.0)
THETA_R = np.arange(-80, 81, 2.0)
# The truth is near, and a coarse grid with one local search finds it.
QUICK = Projection(grid=7, searches=1, rounds=1)
INTERVALS = (*COVARIANCES, "profile")
HOW = ("percentile", "bca", "robust")
RESAMPLED, DRAWS = 200, 100  # scans and draws of the bootstrap: every draw is a fit


@dataclass(frozen=True)
class Case:
    """A surface, what is held in its fits, and the noise: absolute, and relative to each value."""

    title: str
    model: Model
    values: dict[str, Any]
    constant: float
    proportional: float
    held: tuple[str, ...] = ()
    grouped: dict[str, str] = field(default_factory=dict)
    unit: str = "sr-1"


def of_the_paper(name: str, constant: float) -> Case:
    surface = published[name]
    values = {k: {a: v[a] for a in THETA_I} if isinstance(v, dict) else v for k, v in surface.values.items()}
    title = f"{surface.model}, {name} as published"
    return Case(title, catalogue[surface.model], values, constant, 0.01, grouped={"ks": "theta_i"}, unit="a.u.")


METAL = {"rho_s": 0.5, "rho_d": 0.2, "width": 0.25, "index": 1.4, "extinction": 7.6}
PLASTER = {"scale": 0.9, "rho": 0.8, "s": 0.4}
CASES = {
    "al": of_the_paper("Al", 5.0),
    "cu": of_the_paper("Cu", 5.0),
    "ggx": Case("ggx and a diffuse part, metal", catalogue["ggx"], METAL, 0.005, 0.03, held=("index", "extinction")),
    "oren-nayar": Case("oren-nayar, plaster", catalogue["oren-nayar"], PLASTER, 0.004, 0.02, held=("rho",)),
}
NOISES = ("constant", "proportional")


def scans(case: Case, noise: str, count: int = SCANS) -> Iterator[tuple[Problem, Solution]]:
    size = {"offset_noise": case.constant} if noise == "constant" else {"noise": case.proportional}
    for seed in track(range(count), description=f"{case.title}, {noise} noise"):
        scan = simulate(case.model, case.values, THETA_I, THETA_R, seed=seed, unit=case.unit, **size)
        held = {name: case.values[name] for name in case.held}
        problem = Problem(case.model, scan, held=held, grouped=case.grouped)
        yield problem, fit(problem, QUICK)


def true_value(case: Case, name: str) -> float:
    base, _, group = name.partition("[")
    return float(case.values[base][float(group[:-1])] if group else case.values[base])


def measure(case: Case, noise: str) -> dict[str, Any]:
    """Hits of every kind of interval by parameter, and of the band over the directions of the scan."""
    hits: dict[str, dict[str, int]] = {}
    inside, started = [], time.perf_counter()
    for problem, solution in scans(case, noise):
        vector, truth = solution.vector(problem.names), [true_value(case, n) for n in problem.names]
        for kind in COVARIANCES:
            stated = Solution(solution.dataset.assign_attrs(covariance=kind), solution.model)
            reach = stated.coverage_factor(LEVEL) * np.sqrt(np.diag(covariance(problem, vector, kind)))
            for name, near in zip(problem.names, np.abs(vector - truth) <= reach, strict=True):
                hits.setdefault(name, dict.fromkeys(INTERVALS, 0))[kind] += int(near)
        for name, rise in rises(problem, solution, dict(zip(problem.names, truth, strict=True))).items():
            hits[name]["profile"] += rise <= solution.coverage_factor(LEVEL)
        shown = band(solution, problem.points)
        off = np.abs(shown["brdf"].values - problem.brdf(np.array(truth)))
        inside.append(float(np.mean(off <= solution.coverage_factor(LEVEL) * shown["uncertainty"].values)))
    rates = {name: {kind: n / SCANS for kind, n in count.items()} for name, count in hits.items()}
    row = {"surface": case.title, "noise": noise, "rates": rates, "band": float(np.mean(inside))}
    return row | _measured(started)


def measure_bootstrap(kind: str) -> dict[str, Any]:
    """Hits of percentile and BCa intervals by parameter, for the metal under proportional noise."""
    case, started = CASES["ggx"], time.perf_counter()
    hits: dict[str, dict[str, int]] = {}
    for problem, solution in scans(case, "proportional", RESAMPLED):
        drawn = bootstrap(problem, solution, kind, DRAWS)
        kinds = (percentile(drawn, LEVEL), bca(drawn, LEVEL), solution.intervals(LEVEL))
        for how, ends in zip(HOW, kinds, strict=True):
            for name, (low, high) in ends.items():
                count = hits.setdefault(name, dict.fromkeys(HOW, 0))
                count[how] += int(low <= true_value(case, name) <= high)
    rates = {name: {how: n / RESAMPLED for how, n in count.items()} for name, count in hits.items()}
    return {"surface": case.title, "noise": "proportional", "resampled": kind, "rates": rates} | _measured(started)


def _measured(started: float) -> dict[str, Any]:
    return {"seconds": time.perf_counter() - started, "date": date.today().isoformat(), "machine": machine()}


def held(row: dict[str, Any]) -> bool:
    """Whether the intervals that are promised to hold do so, in the mean over the parameters of a surface."""
    means = (np.mean([rates[kind] for rates in row["rates"].values()]) for kind in ("robust", "absolute", "profile"))
    return all(0.93 <= mean <= 0.97 for mean in means)


def main(names: list[str]) -> int:
    every = {f"{key}-{noise}": partial(measure, case, noise) for key, case in CASES.items() for noise in NOISES}
    every |= {f"bootstrap-{kind}": partial(measure_bootstrap, kind) for kind in KINDS}
    if unknown := [name for name in names if name not in every]:
        print(f"no case {unknown[0]}: there are {', '.join(every)}")
        return 1
    record = json.loads(RECORD.read_text(encoding="utf-8")) if names and RECORD.exists() else {}
    cases = record.get("cases", {})
    record["setting"] = {
        "level": LEVEL,
        "scans": SCANS,
        "theta_i": THETA_I,
        "theta_r": [float(THETA_R[0]), float(THETA_R[-1])],
        "theta_r_step": float(THETA_R[1] - THETA_R[0]),
        "bootstrap_scans": RESAMPLED,
        "bootstrap_draws": DRAWS,
    }
    for name in names or every:
        cases[name] = every[name]()
        record["cases"] = {known: cases[known] for known in every if known in cases}
        RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    return 0 if all(held(row) for row in cases.values() if "band" in row) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
