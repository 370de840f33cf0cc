"""Figures of all directions of an incidence angle: seen from above, and as a lobe in space."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr

from gonio.geometry import Geometry
from gonio.measured import dataset
from gonio.measured.instrument import IDEAL, Acceptance
from gonio.measured.polarisers import analysed
from gonio.plotting.hemisphere import hemisphere, room_for_views
from gonio.plotting.lobes.lobe import Lobe, lobes
from gonio.plotting.panels import FAR_SIDE, evenly, first_set, origin_word
from gonio.plotting.style import quantity_of
from gonio.resampling.resample import resample
from gonio.results.prediction import directions_of
from gonio.results.view import MOST_PANELS, Fits, View, at_incidence

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Brdf = Callable[[Geometry], Any]


class _Panel(NamedTuple):
    """An incidence angle [deg], a function of directions, and the measured values that lie on it, if any."""

    theta_i: float
    brdf: Brdf
    points: xr.Dataset | None = None


def draw_hemisphere(title: str, scan: xr.Dataset, fits: Fits, view: View) -> "Figure":
    """The scan as measured, where it covers more than the plane of incidence, and the best model beside it."""
    panels, note = _panels(scan, fits, view, "the scan itself is of the plane of incidence alone")
    shown = {name: (panel.theta_i, panel.brdf) for name, panel in panels.items()}
    quantity = quantity_of(first_set(dataset.points(scan))[0])
    how: dict[str, Any] = {"logarithmic": not dataset.is_degree(scan), "note": note, "quantity": quantity}
    return hemisphere(shown, unit=dataset.unit(scan), title=title, **how)


def draw_lobe(title: str, scan: xr.Dataset, fits: Fits, view: View) -> "Figure":
    """The same as lobes in space; on those of a model lie the values of a scan of the plane of incidence."""
    panels, note = _panels(scan, fits, view, "")
    word = origin_word(scan)
    shown = {name: Lobe(p.theta_i, p.brdf, p.points, word) for name, p in panels.items()}
    quantity = quantity_of(first_set(dataset.points(scan))[0])
    return lobes(shown, unit=dataset.unit(scan), title=title, note=note, quantity=quantity, scale=view.scale)


def _panels(scan: xr.Dataset, fits: Fits, view: View, in_plane: str) -> tuple[Mapping[str, _Panel], str]:
    """The panels by their titles, and in words what is not drawn; `in_plane` is said of a scan in plane."""
    flat, note = first_set(dataset.points(scan))
    flat = at_incidence(flat, view.theta_i) if view.theta_i else flat
    # A format's own interpolation needs its own axes.
    whole = first_set(scan)[0] if dataset.PARAMETERISATION in scan.attrs else None
    outside = np.unique(flat["theta_i"].values[~dataset.is_in_plane(flat)])
    if not fits and not outside.size:
        raise ValueError(
            "the scan is only of the plane of incidence, which covers no hemisphere: draw curves or polar, or give a "
            "fit, as by --models, whose hemisphere is drawn"
        )
    angles = outside if outside.size else np.unique(flat["theta_i"].values)
    most = max(room_for_views(MOST_PANELS) // (1 + bool(fits and outside.size)), 1)
    panels: dict[str, _Panel] = {}
    chosen = angles[evenly(len(angles), most)].tolist()
    for angle in chosen:
        here = flat.isel(direction=np.flatnonzero(flat["theta_i"].values == angle))
        if outside.size:
            measured = partial(_as_measured, here if whole is None else whole, angle)
            panels[f"{origin_word(scan)}, θᵢ = {angle:.4g}°"] = _Panel(angle, measured)
        if fits:
            name, best = next(iter(fits.items()))
            values = {k: float(np.ravel(v)[0]) for k, v in best.at(here.isel(direction=[0])).items()}
            points = None if outside.size else here
            seen = partial(_degree, best.model, values, here.isel(direction=[0]))
            modelled = seen if dataset.is_degree(here) else partial(_at, best.model, values)
            panels[f"{name}, θᵢ = {angle:.4g}°"] = _Panel(angle, modelled, points)
    notes = [note] if note else []
    notes += [f"{len(chosen)} of {len(angles)} incidence angles"] * (len(angles) > most)
    notes += [FAR_SIDE] * (quantity_of(flat) == "BTDF")
    notes += [in_plane] * bool(in_plane and not outside.size)
    return panels, "; ".join(notes)


def _as_measured(here: xr.Dataset, theta_i: float, geometry: Geometry) -> Any:
    """The values of one set at an incidence angle [deg], NaN where nothing near was measured."""
    wanted = directions_of(geometry)
    theta_r, phi = wanted["theta_r"].values, wanted["phi"].values
    onto = dataset.make_scan(np.full(theta_r.size, theta_i), theta_r.ravel(), np.zeros(theta_r.size), phi.ravel())
    if "phi_i" in here.coords:  # a surface that was turned is seen as it lay first
        onto = onto.assign_coords(phi_i=("direction", np.full(theta_r.size, np.ravel(here["phi_i"].values)[0])))
        onto["phi_i"].attrs["units"] = "degree"
    directions = onto.drop_vars([str(n) for n in onto.data_vars])
    return resample(here, directions)["brdf"].values.reshape(theta_r.shape)


def _at(model: Any, values: Mapping[str, float], geometry: Geometry) -> Any:
    return model(geometry, values)


def _degree(model: Any, values: Mapping[str, float], like: xr.Dataset, geometry: Geometry) -> Any:
    """The degree of polarisation that a model has at directions, of the kind that a scan of one direction is."""
    flat = Geometry(*(np.ravel(np.broadcast_to(part, geometry.z_r.shape)) for part in geometry))
    wanted = like.isel(direction=np.zeros(flat.z_r.size, dtype=np.intp))
    return np.reshape(Acceptance(IDEAL, flat, analysed(wanted)).brdf(model, values), geometry.z_r.shape)
