"""Ranked fits into figures: which predictor and which curves each figure needs."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from gonio.app.output import LEVEL
from gonio.app.views.evaluation import EvaluatedModel
from gonio.comparison import METRICS, Row
from gonio.fitting.certainty.band import band
from gonio.fitting.solution import Solution
from gonio.geometry import Geometry
from gonio.measured import dataset
from gonio.model import Model
from gonio.plotting.components import components
from gonio.plotting.convergence import convergence
from gonio.plotting.curves import curves
from gonio.plotting.error_bars import error_bars
from gonio.plotting.hemisphere import hemisphere
from gonio.plotting.model_curves import model_curves
from gonio.plotting.polarisation import polarisation
from gonio.plotting.residuals import residuals
from gonio.plotting.spectra import SPECTRAL, spectra
from gonio.plotting.style import Band
from gonio.polarisation import reflected

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Ranked = Mapping[str, tuple[xr.Dataset, Sequence[Row]]]
MOST_PANELS = 4


def draw(kind: str, ranked: Ranked, normalised: bool = False, banded: bool = False) -> "Figure":
    """One figure of scans with the models fitted to them, the best first; only `errors` takes several scans.

    normalised, banded: for `curves`, over their specular value or with 95 % bands.
    Raises ValueError where the figure cannot show what it was given.
    """
    if banded and (normalised or kind != "curves"):
        raise ValueError("bands are drawn on curves that are not normalised: leave out --band, or the other option")
    if kind == "errors":
        return _errors(ranked)
    if len(ranked) > 1:
        raise ValueError(f"{kind} shows one scan: give one, or draw errors")
    (name, (scan, rows)), *_ = ranked.items()
    if kind == "curves":
        shaded = bands(rows) if banded else {}
        return curves(scan, predictors(rows), title=name, normalised=normalised, bands=shaded)
    return _DRAWINGS[kind](name, scan, rows)


def predictors(rows: Sequence[Row]) -> dict[str, Callable[[xr.Dataset], Any]]:
    """A function of directions for each fit, in the order of the names, so that a model keeps its colour."""
    ordered = sorted(rows, key=lambda row: row.model.name)
    return {row.model.name: row.solution.predict for row in ordered}


def bands(rows: Sequence[Row]) -> dict[str, Band]:
    """A function of directions for the 95 % band of each fit."""

    def ends(row: Row, points: xr.Dataset) -> tuple[Any, Any]:
        at_points = band(row.solution, points)
        reach = row.solution.coverage_factor(LEVEL) * at_points["uncertainty"].values
        return at_points["brdf"].values - reach, at_points["brdf"].values + reach

    return {row.model.name: partial(ends, row) for row in rows}


def _residuals(name: str, scan: xr.Dataset, rows: Sequence[Row]) -> "Figure":
    return residuals(scan, predictors(rows), title=name)


def _components(name: str, scan: xr.Dataset, rows: Sequence[Row]) -> "Figure":
    best = rows[0]
    return components(scan, best.model, best.solution.components, title=f"{name}: {best.model.name}")


def _convergence(name: str, _scan: xr.Dataset, rows: Sequence[Row]) -> "Figure":
    histories = {row.model.name: row.solution.dataset["history"].values for row in rows}
    if max(len(h) for h in histories.values()) < 2:
        raise ValueError("an exact solution has no course to draw: add --solver anneal")
    return convergence(histories, title=name)


def _hemisphere(name: str, scan: xr.Dataset, rows: Sequence[Row]) -> "Figure":
    best, flat = rows[0], dataset.points(scan)
    angles = np.unique(flat["theta_i"].values)
    chosen = angles[np.unique(np.linspace(0, len(angles) - 1, MOST_PANELS).round().astype(int))]
    panels: dict[str, tuple[float, Callable[[Geometry], Any]]] = {}
    for angle in chosen:
        here = flat.isel(direction=[int(np.flatnonzero(flat["theta_i"].values == angle)[0])])
        values = {k: float(np.ravel(v)[0]) for k, v in best.solution.at(here).items()}
        panels[f"{best.model.name} {len(panels) + 1}"] = (float(angle), partial(_at, best.model, values))
    return hemisphere(panels, unit=dataset.unit(scan), title=name, logarithmic=True)


def _at(model: Any, values: Mapping[str, float], geometry: Geometry) -> Any:
    return model(geometry, values)


def _spectra(name: str, _scan: xr.Dataset, rows: Sequence[Row]) -> "Figure":
    ordered = sorted(rows, key=lambda row: row.model.name)
    return spectra({row.model.name: row.solution.parameters() for row in ordered}, title=name)


def has_spectra(solution: Solution) -> bool:
    """Whether a fit has a parameter with one value for each wavelength."""
    return any(SPECTRAL in p.get("by", "").split(",") for p in solution.parameters().values())


def _errors(ranked: Ranked) -> "Figure":
    angles = sorted(set.intersection(*({*rows[0].by_incidence} for _, rows in ranked.values())))
    if not angles:
        raise ValueError("the scans have no incidence angle in common")
    names = sorted(row.model.name for row in next(iter(ranked.values()))[1])
    errors = {
        model: {
            scan: [next(r for r in rows if r.model.name == model).by_incidence[a]["nrmse"] for a in angles]
            for scan, (_, rows) in ranked.items()
        }
        for model in names
    }
    return error_bars(errors, angles, metric=METRICS["nrmse"].title)


def draw_model(kind: str, surface: EvaluatedModel, theta_i: Sequence[float], stokes: Sequence[float]) -> "Figure":
    """One figure of a model alone at the incidence angles given [deg]; `stokes` is the arriving light of `dolp`."""
    title = surface.published.title if surface.published else surface.model.title
    if kind == "curves":
        return model_curves(surface.model, {angle: surface.values(angle) for angle in theta_i}, surface.unit, title)
    if len(theta_i) > MOST_PANELS:
        raise ValueError(f"{kind} has room for {MOST_PANELS} incidence angles: name fewer with --theta-i")
    if kind == "dolp":
        polarised = {
            f"{surface.model.name} {k + 1}": (angle, partial(_light, surface.model, surface.values(angle), stokes))
            for k, angle in enumerate(theta_i)
        }
        return polarisation(polarised, title=title)
    views = {
        f"{surface.model.name} {k + 1}": (angle, partial(_at, surface.model, surface.values(angle)))
        for k, angle in enumerate(theta_i)
    }
    return hemisphere(views, unit=surface.unit, title=title, logarithmic=True)


def _light(model: Model, values: Mapping[str, float], stokes: Sequence[float], geometry: Geometry) -> Any:
    return reflected(np.asarray(model.mueller(geometry, values)), stokes)


_DRAWINGS: Mapping[str, Callable[[str, xr.Dataset, Sequence[Row]], "Figure"]] = {
    "residuals": _residuals,
    "components": _components,
    "convergence": _convergence,
    "hemisphere": _hemisphere,
    "spectra": _spectra,
}
