"""The paper's study (guo2023) on scans simulated from its published constants: every number of the demo page."""

import functools
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from gonio.comparison import Row, compare
from gonio.comparison.ranking import drop
from gonio.fitting import Anneal, Problem, Projection, Solution, fit
from gonio.fitting.search.solver import Progress
from gonio.geometry import Geometry
from gonio.measured.half_width import HalfWidth, half_widths, widest_angle
from gonio.measured.simulation import simulate
from gonio.model import Model
from gonio.models import catalogue
from gonio.models.publications import Published, load, published
from gonio.plausibility import Brdf, hemispherical_reflectance

CITE = "guo2023"
NOISE = 0.01  # relative, of every simulated value
BLOCKED = 5.0  # deg about the incident beam (formulas 9, decision 20)
COMPARED_AT = (30.0, 40.0, 50.0)  # deg, as Tables 2 and 3
THETA_R = np.arange(-80.0, 81.0)
# The paper compares its metals with Wang's model and its coatings with Liu's.
T_C = {"Al": "wang-2016", "Cu": "wang-2016", "SR107": "liu-2016", "S781": "liu-2016"}


@dataclass(frozen=True)
class Sample:
    """One sample: its simulated scan, the fits of it and the models compared on it."""

    constants: Published
    model: Model
    scan: xr.Dataset
    exact: Solution
    annealed: Solution
    speed_up: float
    free: Solution
    half_width: HalfWidth | None
    half_width_with_floor: str
    rows: Sequence[Row]

    def row(self, model: str) -> Row:
        return next(row for row in self.rows if row.model.name == model)

    @property
    def t_c(self) -> str:
        return T_C[self.constants.name]

    def brdf(self, theta_i: float) -> Brdf:
        """The published constants at one incidence angle [deg] as a function of directions."""
        return functools.partial(_evaluate, self.model, self.constants.at(theta_i))

    def error(self, model: str, theta_i: float) -> float:
        """NRMSE of a model at one incidence angle."""
        return float(self.row(model).by_incidence[theta_i]["nrmse"])


@dataclass(frozen=True)
class Study:
    """All samples, and the printed tables recomputed."""

    seed: int
    surfaces: Sequence[Sample]
    printed: Mapping[str, Any]


def run(seed: int, progress: Progress) -> Study:
    """Simulate and fit every published surface; seeded, the same numbers each time but for the seconds."""
    surfaces = []
    for k, constants in enumerate(published.values()):
        if constants.cite == CITE:
            surfaces.append(_surface(constants, seed + k))
            progress((k + 1) / len(published))
    return Study(seed, surfaces, _printed())


def _surface(constants: Published, seed: int) -> Sample:
    model = catalogue[constants.model]
    ks = constants.values["ks"]
    assert isinstance(ks, Mapping)
    scan = simulate(
        model,
        constants.values,
        sorted(ks),
        THETA_R,
        noise=NOISE,
        blocked=BLOCKED,
        seed=seed,
        unit=constants.unit,
        wavelength=constants.wavelength_nm,
    )
    sigma, gamma = float(constants.values["sigma"]), float(constants.values["gamma"])  # type: ignore[arg-type]
    grouped = {"ks": "theta_i"}
    as_paper = Problem(model, scan, held={"sigma": sigma, "gamma": gamma}, grouped=grouped)
    names = ["torrance-sparrow", T_C[constants.name], constants.model]
    readings = half_widths(scan)
    return Sample(
        constants=constants,
        model=model,
        scan=scan,
        exact=fit(as_paper),
        annealed=fit(as_paper, Anneal(chains=3, seed=seed)),
        speed_up=_speed_up(as_paper, seed),
        free=fit(Problem(model, scan, grouped=grouped)),
        half_width=widest_angle(readings),
        half_width_with_floor=str(half_widths(scan, floor=0.0)[-1].status),
        rows=compare(
            scan, [catalogue[n] for n in names], by="nrmse", held={"sigma": sigma}, grouped=grouped, weighting="uniform"
        ),
    )


def _speed_up(problem: Problem, seed: int) -> float:
    """Seconds of one annealing chain over seconds of the exact weights, searches alone, the median of repeats."""
    anneal, exact = Anneal(seed=seed), Projection()
    slow = _seconds(functools.partial(anneal.search, problem))
    return slow / float(np.median([_seconds(functools.partial(exact.search, problem)) for _ in range(21)]))


def _seconds(work: Any) -> float:
    started = time.perf_counter()
    work()
    return time.perf_counter() - started


def _printed() -> dict[str, Any]:
    """Tables 2 and 3: errors as printed, drops as printed and recomputed, and their averages."""
    paper = load(CITE)
    errors, stated = paper["errors"], paper["drops"]
    ours = errors["cauchy-lorentz"]
    out: dict[str, Any] = {"errors": errors, "drops": {}}
    for reference in ("torrance-sparrow", "t-c"):
        cells = [
            (sample, angle, stated[reference][sample][k], drop(errors[reference][sample][k], ours[sample][k]))
            for sample in ours
            for k, angle in enumerate(errors["theta_i"])
        ]
        old = np.array([errors[reference][s] for s in ours])
        new = np.array([ours[s] for s in ours])
        out["drops"][reference] = {
            "cells": cells,
            "average": (stated[reference]["average"], float(np.mean([c[3] for c in cells]))),
            "average_error": (stated[reference]["average_error"], float(np.mean(old - new))),
            "pooled": drop(float(old.sum()), float(new.sum())),
        }
    return out


def facts(study: Study) -> dict[str, str]:
    """The numbers of the page's section on what the paper leaves open, computed here."""
    al, sr = (next(s for s in study.surfaces if s.constants.name == n) for n in ("Al", "SR107"))
    model, constants = al.model, al.constants
    sums = {s.constants.name: [hemispherical_reflectance(s.brdf(t), t) for t in (20.0, 70.0)] for s in study.surfaces}
    ratios = [_exchange(model, s.constants, 30.0, 50.0) for s in study.surfaces]
    azimuths = [float(model(Geometry.from_degrees(40.0, 40.0, phi), constants.at(40.0))) for phi in (0.0, 90.0, 180.0)]
    t_s = study.printed["drops"]["torrance-sparrow"]
    t_c = study.printed["drops"]["t-c"]
    worst = study.printed["errors"]
    excess = [s.annealed.cost / s.exact.cost - 1 for s in study.surfaces]
    return {
        "sum_least": f"{min(v[0] for v in sums.values()):.0f}",
        "sum_most": f"{max(v[1] for v in sums.values()):.0f}",
        "exchange_least": f"{min(ratios):.2f}",
        "exchange_most": f"{max(ratios):.2f}",
        "azimuth_0": f"{azimuths[0]:.0f}",
        "azimuth_90": f"{azimuths[1]:.0f}",
        "azimuth_180": f"{azimuths[2]:.0f}",
        "coating_status": sr.half_width_with_floor,
        "pooled_t_s": f"{t_s['pooled']:.1f}",
        "pooled_t_c": f"{t_c['pooled']:.1f}",
        "cu_t_c_50": f"{worst['t-c']['Cu'][2]:.4f}",
        "cu_t_s_50": f"{worst['torrance-sparrow']['Cu'][2]:.4f}",
        "peak_30": f"{_peak(model, sr.constants, 30.0):.1f}",
        "peak_50": f"{_peak(model, sr.constants, 50.0):.1f}",
        "delta_t_s": f"{_least_delta(study):.2f}",
        "iterations": f"{al.annealed.dataset.sizes['step']}",
        "excess_least": f"{100 * min(excess):.2g} %",
        "excess_most": f"{100 * max(excess):.2g} %",
        "speed_up": f"{np.median([s.speed_up for s in study.surfaces]):,.0f}",
    }


def _evaluate(model: Model, values: Mapping[str, float], geometry: Geometry) -> Any:
    return model(geometry, values)


def _exchange(model: Model, constants: Published, one: float, other: float) -> float:
    """f(one to other) over f(other to one): 1 for a reciprocal model."""
    there = model(Geometry.from_degrees(one, other, 180.0), constants.at(one))
    back = model(Geometry.from_degrees(other, one, 180.0), constants.at(other))
    return float(there / back)


def _peak(model: Model, constants: Published, theta_i: float) -> float:
    """The in-plane theta_r [deg] of the largest value."""
    theta_r = np.linspace(0.0, 85.0, 3401)
    curve = model(Geometry.in_plane(np.full_like(theta_r, theta_i), theta_r), constants.at(theta_i))
    return float(theta_r[np.argmax(curve)])


def _least_delta(study: Study) -> float:
    """The least eq 9 error that Torrance-Sparrow reaches on a metal at 30 to 50 deg."""
    metals = [s for s in study.surfaces if s.t_c == "wang-2016"]
    return min(float(s.row("torrance-sparrow").by_incidence[a]["delta"]) for s in metals for a in COMPARED_AT)
