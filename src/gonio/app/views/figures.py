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
from gonio.plotting.hemisphere import hemisphere, top_view
from gonio.plotting.model_curves import model_curves
from gonio.plotting.panels import FAR_SIDE, first_set, origin_word
from gonio.plotting.polarisation import polarisation
from gonio.plotting.residuals import residuals
from gonio.plotting.spectra import SPECTRAL, spectra
from gonio.plotting.style import Band, quantity_of
from gonio.polarisation import reflected
from gonio.resampling.resample import resample

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Ranked = Mapping[str, tuple[xr.Dataset, Sequence[Row]]]
MOST_PANELS = 4
OF_FITS = ("residuals", "components", "convergence", "spectra", "errors")  # figures that show nothing of a scan alone


def draw(kind: str, ranked: Ranked, normalised: bool = False, banded: bool = False) -> "Figure":
    """One figure of scans with the models fitted to them, the best first; only `errors` takes several scans.

    normalised, banded: for `curves`, over their specular value or with 95 % bands.
    Raises ValueError where the figure cannot show what it was given.
    """
    if banded and (normalised or kind != "curves"):
        raise ValueError("bands are drawn on curves that are not normalised: leave out --band, or the other option")
    if kind in OF_FITS and not all(rows for _, rows in ranked.values()):
        raise ValueError(f"{kind} shows fits, and no model was fitted: name one with --models")
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
    return components(
        scan,
        best.model,
        best.solution.components,
        title=name if name == best.model.name else f"{name}: {best.model.name}",
    )


def _convergence(name: str, _scan: xr.Dataset, rows: Sequence[Row]) -> "Figure":
    histories = {row.model.name: row.solution.dataset["history"].values for row in rows}
    if max(len(h) for h in histories.values()) < 2:
        raise ValueError("an exact solution has no course to draw: add --solver anneal")
    return convergence(histories, title=name)


def _hemisphere(name: str, scan: xr.Dataset, rows: Sequence[Row]) -> "Figure":
    """The scan as measured, where it covers more than the plane of incidence, and the best model beside it."""
    flat, note = first_set(dataset.points(scan))
    # A format's own interpolation needs its own axes.
    whole = first_set(scan)[0] if dataset.PARAMETERISATION in scan.attrs else None
    outside = np.unique(flat["theta_i"].values[~dataset.is_in_plane(flat)])
    if not rows and not outside.size:
        raise ValueError(
            "the scan is only of the plane of incidence, which covers no hemisphere: draw curves, or name a model with "
            "--models, whose hemisphere is drawn"
        )
    angles = outside if outside.size else np.unique(flat["theta_i"].values)
    most = MOST_PANELS // 2 if rows and outside.size else MOST_PANELS
    panels: dict[str, tuple[float, Callable[[Geometry], Any]]] = {}
    for angle in angles[np.unique(np.linspace(0, len(angles) - 1, most).round().astype(int))].tolist():
        here = flat.isel(direction=np.flatnonzero(flat["theta_i"].values == angle))
        if outside.size:
            panels[f"{origin_word(scan)}, θᵢ = {angle:.4g}°"] = (
                angle,
                partial(_as_measured, here if whole is None else whole, angle),
            )
        if rows:
            values = {k: float(np.ravel(v)[0]) for k, v in rows[0].solution.at(here.isel(direction=[0])).items()}
            panels[f"{rows[0].model.name}, θᵢ = {angle:.4g}°"] = (angle, partial(_at, rows[0].model, values))
    notes = [note] if note else []
    notes += [f"{len(panels) // (1 + bool(rows))} of {len(angles)} incidence angles"] * (len(angles) > most)
    notes += [FAR_SIDE] * (quantity_of(flat) == "BTDF")
    notes += ["the scan itself is of the plane of incidence alone"] * (not outside.size)
    return hemisphere(
        panels,
        unit=dataset.unit(scan),
        title=name,
        logarithmic=True,
        note="; ".join(notes),
        quantity=quantity_of(flat),
    )


def _as_measured(here: xr.Dataset, theta_i: float, _: Geometry) -> Any:
    """The values of one set at an incidence angle [deg] over the top view, NaN where nothing near was measured."""
    theta_r, phi = top_view()
    onto = dataset.make_scan(np.full(theta_r.size, theta_i), theta_r.ravel(), np.zeros(theta_r.size), phi.ravel())
    if "phi_i" in here.coords:  # a surface that was turned is seen as it lay first
        onto = onto.assign_coords(phi_i=("direction", np.full(theta_r.size, np.ravel(here["phi_i"].values)[0])))
        onto["phi_i"].attrs["units"] = "degree"
    directions = onto.drop_vars([str(n) for n in onto.data_vars])
    return resample(here, directions)["brdf"].values.reshape(theta_r.shape)


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
            f"θᵢ = {angle:g}°": (angle, partial(_light, surface.model, surface.values(angle), stokes))
            for angle in theta_i
        }
        return polarisation(polarised, title=title)
    views = {f"θᵢ = {angle:g}°": (angle, partial(_at, surface.model, surface.values(angle))) for angle in theta_i}
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
