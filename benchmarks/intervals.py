"""Coverage: how often stated 95 % intervals hold the truth, over many simulated scans of several models.

Writes docs/intervals.md and prints it: `make intervals`, half an hour. With names of cases as arguments only
these are measured anew; the others keep what benchmarks/intervals.json holds.
"""

import json
import platform
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import date
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import scipy
from rich.progress import track

from gonio import Problem, catalogue, published, simulate
from gonio.fitting import Projection, Solution, fit
from gonio.fitting.certainty.band import band
from gonio.fitting.certainty.bootstrap import KINDS, bca, bootstrap, percentile
from gonio.fitting.certainty.covariance import covariance
from gonio.fitting.certainty.profile import rises
from gonio.fitting.covariance_kinds import COVARIANCES
from gonio.model import Model

HERE = Path(__file__).resolve().parent
RESULTS = HERE / "intervals.json"
PAGE = HERE.parent / "docs" / "intervals.md"
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
        problem = Problem(case.model, scan, {n: case.values[n] for n in case.held}, case.grouped)
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
            stated = Solution(solution.dataset.assign_attrs(covariance=kind))
            reach = stated.coverage_factor(LEVEL) * np.sqrt(np.diag(covariance(problem, vector, kind)))
            for name, near in zip(problem.names, np.abs(vector - truth) <= reach, strict=True):
                hits.setdefault(name, dict.fromkeys(INTERVALS, 0))[kind] += int(near)
        for name, rise in rises(problem, solution, dict(zip(problem.names, truth, strict=True))).items():
            hits[name]["profile"] += rise <= solution.coverage_factor(LEVEL)
        shown = band(solution, problem.points)
        off = np.abs(shown["brdf"].values - problem.brdf(np.array(truth)))
        inside.append(float(np.mean(off <= solution.coverage_factor(LEVEL) * shown["uncertainty"].values)))
    rates = {name: {kind: n / SCANS for kind, n in found.items()} for name, found in hits.items()}
    seconds = time.perf_counter() - started
    return {"rates": rates, "band": float(np.mean(inside)), "seconds": seconds, "date": date.today().isoformat()}


def measure_bootstrap(kind: str) -> dict[str, Any]:
    """Hits of percentile and BCa intervals by parameter, for the metal under proportional noise."""
    case, started = CASES["ggx"], time.perf_counter()
    hits: dict[str, dict[str, int]] = {}
    for problem, solution in scans(case, "proportional", RESAMPLED):
        drawn = bootstrap(problem, solution, kind, DRAWS)
        kinds = (percentile(drawn, LEVEL), bca(drawn, LEVEL), solution.intervals(LEVEL))
        for how, ends in zip(HOW, kinds, strict=True):
            for name, (low, high) in ends.items():
                found = hits.setdefault(name, dict.fromkeys(HOW, 0))
                found[how] += low <= true_value(case, name) <= high
    rates = {name: {how: n / RESAMPLED for how, n in found.items()} for name, found in hits.items()}
    return {"rates": rates, "seconds": time.perf_counter() - started, "date": date.today().isoformat()}


def machine() -> str:
    info = Path("/proc/cpuinfo")
    names = info.read_text().splitlines() if info.exists() else []
    cpu = next((line.split(":")[1].strip() for line in names if line.startswith("model name")), platform.machine())
    return f"{cpu}; Python {platform.python_version()}, NumPy {np.__version__}, SciPy {scipy.__version__}"


def mean(result: dict[str, Any], kind: str) -> float:
    return float(np.mean([rates[kind] for rates in result["rates"].values()]))


def rows(results: dict[str, Any]) -> Iterator[tuple[Case, str, dict[str, Any]]]:
    for key, case in CASES.items():
        for noise in NOISES:
            if f"{key}-{noise}" in results:
                yield case, noise, results[f"{key}-{noise}"]


def percent(rate: float) -> str:
    return f"{100 * rate:.1f}"


def markdown(results: dict[str, Any]) -> str:
    heads = " | ".join(INTERVALS)
    means = "\n".join(
        f"| {case.title} | {noise} | {' | '.join(percent(mean(r, k)) for k in INTERVALS)} | {percent(r['band'])} |"
        for case, noise, r in rows(results)
    )
    single = "\n".join(
        f"| {case.title} | {noise} | {name} | {' | '.join(percent(rates[k]) for k in INTERVALS)} |"
        for case, noise, r in rows(results)
        for name, rates in r["rates"].items()
    )
    resampled = "\n".join(
        f"| {kind} | {name} | {' | '.join(percent(rates[how]) for how in HOW)} |"
        for kind in KINDS
        for name, rates in results.get(f"bootstrap-{kind}", {"rates": {}})["rates"].items()
    )
    dates = sorted({r["date"] for r in results.values()})
    minutes = sum(r["seconds"] for r in results.values()) / 60
    return f"""# Coverage of intervals

Made by `make intervals` on {" and ".join(dates)} in {minutes:.0f} minutes; {machine()}.

A 95 % interval is worth its name if it holds the truth in 95 of 100 repetitions of the measurement. Each row repeats
one {SCANS} times: incidence at 30, 40 and 50 deg, theta_r from -80 to 80 deg in steps of 2 deg,
uniform weighting, and noise that is normal and either the same at every point or proportional to the value there.
The numbers are the percentage of intervals that held the truth.

| surface | noise | {heads} | band |
|---|---|{"---:|" * (len(INTERVALS) + 1)}
{means}

Means over the parameters; `band` is that of the fitted curve, robust, over the directions of the scan. A perfect
interval of one parameter comes out at 94 to 96 in two of three rows, because {SCANS} draws scatter by 1.

| surface | noise | parameter | {heads} |
|---|---|---|{"---:|" * len(INTERVALS)}
{single}

The bootstrap, on {RESAMPLED} scans of the metal under proportional noise with {DRAWS} draws each, because every draw
is a fit; {RESAMPLED} scans scatter by 1.5, and the last column is the robust covariance on these same scans:

| resampled | parameter | percentiles | BCa | robust |
|---|---|---:|---:|---:|
{resampled}

## Reading it

- **robust**, the default, learns the noise from the scatter about the fit, point by point (HC3). It needs not know how
  the noise depends on the signal. Where few points determine a value, as the specular weight at 50 deg, that is little
  to learn from, and its intervals are a little too narrow.
- **scaled** is the textbook's s² (J'J)⁻¹. It holds for constant noise. Under proportional noise the peak scatters more
  than the mean of all points, and the intervals of what the peak determines are too narrow, those of the rest too wide.
- **absolute** takes the uncertainty that the scan states at its word. Here that is the truth, so it has to hold.
- **profile** is the profile likelihood at the level of the robust covariance.
- **bootstrap**: residuals and their signs make up for leverage as the robust covariance does. Pairs do not, and end
  short where few points determine a value. BCa needs the bias as well, which so few draws know badly.
"""


def main(names: list[str]) -> int:
    every = {f"{key}-{noise}": partial(measure, case, noise) for key, case in CASES.items() for noise in NOISES}
    every |= {f"bootstrap-{kind}": partial(measure_bootstrap, kind) for kind in KINDS}
    if unknown := [name for name in names if name not in every]:
        print(f"no case {unknown[0]}: there are {', '.join(every)}")
        return 1
    results = json.loads(RESULTS.read_text(encoding="utf-8")) if names and RESULTS.exists() else {}
    for name in names or every:
        results[name] = every[name]()
        RESULTS.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    page = markdown(results)
    PAGE.write_text(page, encoding="utf-8")
    print(page)
    held = [0.93 <= mean(r, kind) <= 0.97 for _, _, r in rows(results) for kind in ("robust", "absolute", "profile")]
    return 0 if all(held) else 1


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
