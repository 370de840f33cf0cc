"""The grid of a format for a scan that a model fills: to grazing incidence, and as fine as the model's lobe needs.

A program that reads a file whose incidence angles end early has to repeat the last one, or to darken the rim of every
sphere. Where a model fills the gaps, a file has all incidence angles: those of the scan, and further ones on both sides
of them up to 90 deg, or as far as the model is bounded. Towards grazing incidence its lobe is met by a grid that was
laid out for the steps of the scan at a few nodes alone, so that nodes are added about it. Nodes of the scan's own
layout stay, and with them every measured value.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.formats.format import Format
from gonio.measured.coordinates import grid, system_of
from gonio.measured.dataset import SETS, make_scan
from gonio.resampling.lobes import HORIZON_AT, LARGEST, WIDEST, Brdf, Lobe
from gonio.resampling.resample import Fill, Filling
from gonio.resampling.sources import sets_of

Values = npt.NDArray[np.float64]

MOST_SETS = 3  # of a scan, whose lobes are looked at
SAME = 1e-4  # deg: angles nearer than this are one
PRINTED = 30  # angles, the most that a line lists


def bounded(filling: Filling) -> Filling:
    """The filling with its function taken at HORIZON_AT beyond it, as many models have no bound at the horizon."""
    function = filling.function
    assert function is not None

    def at_most(points: xr.Dataset) -> Values:
        held = {n: points[n].copy(data=np.minimum(points[n].values, HORIZON_AT)) for n in ("theta_i", "theta_r")}
        return function(points.assign_coords(held))

    return replace(filling, function=at_most)


def to_grazing(scan: xr.Dataset, target: Format, function: Fill) -> xr.Dataset:
    """The layout of a format for a scan, with the incidence angles and nodes that the function needs in its gaps."""
    assert target.layout is not None
    own = target.layout(scan)
    if "theta_i" not in own.dims:  # patches, or half-difference angles: of every incidence
        return own
    lobes = [Lobe.of(_brdf(function, scan, labels)) for labels in _labels(scan)[:MOST_SETS]]
    lobe = Lobe(min(one.width for one in lobes), min(one.last for one in lobes))
    system = system_of(own)
    if system is None or "theta_i" not in system.axes:
        return target.layout(_further(scan, _outside(own["theta_i"].values, lobe.incidences(WIDEST))))
    axes = {str(a): own[a].values.astype(float) for a in own.dims}
    further = (lobe.specular if system.name == "specular" else lobe.spherical)(1.0, False)
    finer = {n: _joined(v, further[n]) if n in further else v for n, v in axes.items()}
    turns = next(n for n in axes if n in ("phi_s", "phi"))
    if axes[turns].max() <= 180.0:  # half a circle stands for all
        finer[turns] = finer[turns][finer[turns] <= 180.0]
    if system.name == "specular":  # between incidence angles the lobe stays in its place
        finer["theta_i"] = _outside(axes["theta_i"], further["theta_i"])
    if np.prod([float(len(v)) for v in finer.values()]) > LARGEST:
        finer = axes | {"theta_i": _outside(axes["theta_i"], lobe.incidences(WIDEST))}
    made = grid(system.name, **finer)
    empty = np.full([len(v) for v in finer.values()], np.nan)
    return target.layout(made.assign(brdf=(tuple(finer), empty, scan["brdf"].attrs)).assign_attrs(scan.attrs))


def outside_data(scan: xr.Dataset, ready: xr.Dataset, filling: Filling) -> str:
    """Which incidence angles of a filled table are not the scan's, in words; empty where all are."""
    has = scan["theta_i"].broadcast_like(scan["brdf"]).where(scan["brdf"].notnull())
    low, high = float(has.min()), float(has.max())
    name = filling.name.split()[0] if filling.name else "the function"
    beyond = ready["theta_i"].values.ravel()
    beyond = np.unique(beyond[(beyond < low - SAME) | (beyond > high + SAME)].round(6))
    beyond = beyond[beyond <= 90.0]
    if not len(beyond):
        return ""
    listed = f" ({', '.join(f'{v:g}' for v in beyond)} deg)" if len(beyond) <= PRINTED else ""
    measured = f"{low:g} deg" if high - low < SAME else f"{low:g} to {high:g} deg"
    return (
        f"incidence is measured at {measured} alone: at all other angles{listed} values are {name}'s, or those that "
        f"symmetry gives; within {90 - HORIZON_AT:g} deg of the horizon they are {name}'s at that distance from it"
    )


def _labels(scan: xr.Dataset) -> list[Mapping[str, Any]]:
    single = {n: scan[n].values.ravel()[0] for n in SETS if n in scan.coords and scan[n].size}
    return [single | key for key, _ in sets_of(scan)]


def _brdf(function: Fill, scan: xr.Dataset, labels: Mapping[str, Any]) -> Brdf:
    """The function as one of angles, for one set; of a turned surface at its first position."""
    turned = "phi_i" in scan.coords

    def brdf(theta_i: Values, theta_r: Values, phi: Values) -> Values:
        count = len(theta_i)
        phi_i = np.full(count, float(np.ravel(scan["phi_i"].values)[0])) if turned else None
        points = make_scan(theta_i, theta_r, np.zeros(count), phi, phi_i=phi_i)
        return np.nan_to_num(
            function(points.assign_coords({n: ("direction", np.full(count, v)) for n, v in labels.items()}))
        )

    return brdf


def _outside(own: Values, further: Values) -> Values:
    """The own incidence angles, and further ones before the first and after the last."""
    step = WIDEST / 4  # a further angle closer than this to an end is left out, but for the very last
    kept = (further < own.min() - step) | (further > own.max() + step)
    kept |= (further == further.max()) & (further > own.max() + SAME)
    return np.unique(np.concatenate([own, further[kept]]))


def _joined(own: Values, further: Values) -> Values:
    """The own angles, and those further ones that are none of them."""
    at = np.clip(np.searchsorted(own, further), 1, max(len(own) - 1, 1))
    near = np.abs(own[np.minimum(at, len(own) - 1)] - further) < SAME
    near |= np.abs(own[at - 1] - further) < SAME
    return np.unique(np.concatenate([own, further[~near]]))


def _further(scan: xr.Dataset, theta_i: Values) -> xr.Dataset:
    """The scan with directions, but no values, at all of these incidence angles [deg] as well."""
    own = np.unique(scan["theta_i"].values.astype(float))
    more = theta_i[(theta_i < own[0] - SAME) | (theta_i > own[-1] + SAME)]
    if scan["theta_i"].dims == ("theta_i",):
        return scan.reindex(theta_i=np.unique(np.concatenate([own, more])))
    if scan["brdf"].dims != ("direction",) or not len(more):
        return scan
    rows = scan.isel(direction=np.zeros(len(more), dtype=int))
    rows = rows.assign(brdf=("direction", np.full(len(more), np.nan), scan["brdf"].attrs))
    rows = rows.assign_coords(theta_i=("direction", more, scan["theta_i"].attrs))
    return xr.concat([scan, rows], dim="direction", combine_attrs="override")
