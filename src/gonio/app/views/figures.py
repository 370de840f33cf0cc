"""Ranked fits into figures: which predictor and which curves each figure needs."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from gonio.app.views.evaluation import Surface
from gonio.comparison import METRICS, Row
from gonio.geometry import Geometry
from gonio.measured import dataset
from gonio.model import Model
from gonio.plotting.error_bars import error_bars
from gonio.plotting.hemisphere import hemisphere, room_for_views
from gonio.plotting.lobes.lobe import Lobe, lobes
from gonio.plotting.lobes.polar import Arc, polar
from gonio.plotting.model_curves import in_plane, model_curves
from gonio.plotting.panels import parted
from gonio.plotting.polarisation import polarisation
from gonio.plotting.style import LINEAR, SCALES
from gonio.plotting.together.samples import samples
from gonio.polarisation import reflected
from gonio.results.figures import drawn, named
from gonio.results.view import MOST_PANELS, OF_SCALES, WHOLE, View, at_incidence
from gonio.results.view import OF_FITS as OF_ONE_SCAN

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Ranked = Mapping[str, tuple[xr.Dataset, Sequence[Row]]]
OF_FITS = (*OF_ONE_SCAN, "errors")  # figures that show nothing of a scan alone


def draw(kind: str, ranked: Ranked, view: View = WHOLE) -> "Figure":
    """One figure of scans with the models fitted to them, the best first; `curves` and `errors` take several scans.

    Raises ValueError where the figure cannot show what it was given.
    """
    if kind in OF_FITS and not all(rows for _, rows in ranked.values()):
        raise ValueError(f"{kind} shows fits, and no model was fitted: name one with --models")
    view.refuse_unfit(kind)
    if kind == "errors":
        return _errors(ranked)
    if kind == "curves" and (len(ranked) > 1 or view.together):
        return _together(ranked, view)
    if len(ranked) > 1:
        raise ValueError(f"{kind} shows one scan: give one, or draw curves or errors")
    (name, (scan, rows)), *_ = ranked.items()
    return drawn(kind, name, scan, named(rows), view)


def _together(ranked: Ranked, view: View) -> "Figure":
    """Curves of several scans, or of all sets of one, in the same panels."""
    if view.normalised or view.banded:
        raise ValueError("several sets in one panel have no bands and are not normalised: leave these options out")
    data: dict[str, tuple[xr.Dataset, Mapping[str, Callable[[xr.Dataset], Any]]]] = {}
    for name, (scan, rows) in ranked.items():
        flat = at_incidence(scan, view.theta_i) if view.theta_i else dataset.points(scan)
        parts = parted(flat) if view.together else {"": flat}
        for word, part in parts.items():
            data[" ".join(text for text in (name * (len(ranked) > 1 or not word), word) if text)] = (
                part,
                predictors(rows),
            )
    return samples(data, title="" if len(ranked) > 1 else next(iter(ranked)), scales=view.scales)


def predictors(rows: Sequence[Row]) -> dict[str, Callable[[xr.Dataset], Any]]:
    """A function of directions for each fit, in the order of the names, so that a model keeps its colour."""
    ordered = sorted(rows, key=lambda row: row.model.name)
    return {row.model.name: row.solution.brdf for row in ordered}


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


def draw_model(
    kind: str, surface: Surface, theta_i: Sequence[float], stokes: Sequence[float], scales: Sequence[str] = SCALES
) -> "Figure":
    """One figure of a model alone at the incidence angles given [deg]; `stokes` is the arriving light of `dolp`."""
    title = surface.title
    if tuple(scales) != SCALES and kind not in OF_SCALES:
        raise ValueError(f"{kind} has its own scale: leave --scale out, or draw curves, polar or lobe")
    if kind == "curves":
        values = {angle: surface.values(angle) for angle in theta_i}
        return model_curves(surface.model, values, surface.unit, title, linear=tuple(scales) == (LINEAR,))
    if kind == "polar":
        return polar([_arc(surface, angle) for angle in theta_i], unit=surface.unit, title=title, scales=scales)
    room = room_for_views(MOST_PANELS)
    if len(theta_i) > room:
        raise ValueError(
            f"{kind} has room for {room} of {len(theta_i)} incidence angles: name fewer by --theta-i, or a larger size"
        )
    if kind == "dolp":
        polarised = {
            f"θᵢ = {angle:g}°": (angle, partial(_light, surface.model, surface.values(angle), stokes))
            for angle in theta_i
        }
        return polarisation(polarised, title=title)
    views = {f"θᵢ = {angle:g}°": (angle, partial(_at, surface.model, surface.values(angle))) for angle in theta_i}
    if kind == "lobe":
        shown = {name: Lobe(angle, brdf) for name, (angle, brdf) in views.items()}
        return lobes(shown, unit=surface.unit, title=title, scale=scales[0])
    return hemisphere(views, unit=surface.unit, title=title, logarithmic=True)


def _arc(surface: Surface, theta_i: float) -> Arc:
    """The model in the plane of incidence, to the horizon."""
    theta_r, values = in_plane(surface.model, surface.values(theta_i), theta_i)
    return Arc(theta_i, {surface.model.name: (theta_r, values)})


def _at(model: Model, values: Mapping[str, float], geometry: Geometry) -> Any:
    return model(geometry, values)


def _light(model: Model, values: Mapping[str, float], stokes: Sequence[float], geometry: Geometry) -> Any:
    return reflected(np.asarray(model.mueller(geometry, values)), stokes)
