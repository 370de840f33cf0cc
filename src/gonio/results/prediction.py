"""A fit at directions: its BRDF there, and how far that is from what was measured."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.comparison.assessment import Row
from gonio.comparison.metrics import judged, metrics, metrics_by_incidence
from gonio.fitting.objective.weighting import WEIGHTINGS
from gonio.fitting.schema import SCAN
from gonio.fitting.solution import Solution
from gonio.geometry import Geometry
from gonio.measured import dataset
from gonio.measured.polarisers import DOLP, POLARISATION

Values = npt.NDArray[np.float64]
ROUNDED = 9  # digits of angles that come from unit vectors, so that a group of 30 deg is found


def predicted(solution: Solution, where: xr.Dataset | Geometry, coordinates: Mapping[str, Any]) -> xr.DataArray:
    """The fitted BRDF at directions, as `Solution.predict` gives it."""
    places = directions_of(where) if isinstance(where, Geometry) else where
    if lacking := [name for name in ("theta_i", "theta_r") if name not in places.variables]:
        raise ValueError(f"the directions have no {lacking[0]}: give a scan, or a gonio.Geometry")
    places = _with_coordinates(places, _of_degrees(solution, places) | dict(coordinates))
    dims, flat, kept = _flat(places)
    values = np.full(len(kept), np.nan)
    values[kept] = solution.brdf(flat.isel(direction=np.flatnonzero(kept)))
    coords = {n: v.variable for n, v in places.coords.items() if set(v.dims) <= set(dims)}
    sizes = [places.sizes[d] for d in dims]
    quantity = "degree of polarisation" if solution.unit == dataset.DEGREE else "BRDF"
    attrs = {"units": solution.unit, "long_name": f"{quantity} of {solution.model.name}"}
    return xr.DataArray(values.reshape(sizes), dims=dims, coords=coords, attrs=attrs, name="brdf")


def _of_degrees(solution: Solution, places: xr.Dataset) -> dict[str, str]:
    """Which degree of polarisation a fit of them predicts where nothing says it: that of its scan."""
    if solution.unit != dataset.DEGREE or POLARISATION in places.variables:
        return {}
    known = np.unique(solution.scan[POLARISATION].values).tolist() if solution.has_scan else [f">{DOLP}"]
    return {POLARISATION: str(known[0])}


def directions_of(geometry: Geometry) -> xr.Dataset:
    """The angles [deg] of a Geometry as a Dataset of coordinates: one dimension is `direction`, several are counted.

    A single pair of directions has none.
    """
    x_i, y_i, z_i, x_r, y_r, z_r = np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in geometry))
    phi_i, phi_r = np.degrees(np.arctan2(y_i, x_i)), np.degrees(np.arctan2(y_r, x_r))
    angles = {
        "theta_i": np.degrees(np.arctan2(np.hypot(x_i, y_i), z_i)),
        "theta_r": np.degrees(np.arctan2(np.hypot(x_r, y_r), z_r)),
        "phi": (phi_r - phi_i) % 360.0,
    } | ({"phi_i": phi_i} if np.any(np.round(phi_i, ROUNDED)) else {})
    dims = ("direction",) if z_i.ndim == 1 else tuple(f"direction_{k}" for k in range(z_i.ndim))
    return xr.Dataset(
        coords={name: (dims, np.round(angle, ROUNDED), {"units": "degree"}) for name, angle in angles.items()}
    )


def _with_coordinates(places: xr.Dataset, coordinates: Mapping[str, Any]) -> xr.Dataset:
    """The directions with one value of each coordinate given, which they must not have themselves."""
    for name, value in coordinates.items():
        if name in places.variables:
            raise ValueError(f"the directions have a coordinate {name!r} of their own: leave {name}={value!r} out")
    return places.assign_coords({name: float(v) if name == "wavelength" else v for name, v in coordinates.items()})


def _flat(places: xr.Dataset) -> tuple[tuple[Any, ...], xr.Dataset, npt.NDArray[np.bool_]]:
    """The dimensions of directions, every one of them on `direction`, and which are above the horizon."""
    template = places["brdf"] if "brdf" in places else _outer(places)
    coords = {
        str(name): ("direction", np.ravel(value.broadcast_like(template).transpose(*template.dims).values))
        for name, value in places.coords.items()
        if set(value.dims) <= set(template.dims)
    }
    flat = xr.Dataset(coords=coords)
    if "direction" not in flat.sizes:
        raise ValueError("the directions have no coordinates: give a scan, or a gonio.Geometry")
    kept = (flat["theta_i"].values <= dataset.HORIZON) & (flat["theta_r"].values <= dataset.HORIZON)
    return template.dims, flat, kept


def _outer(places: xr.Dataset) -> xr.DataArray:
    """Any array on all dimensions of the angles."""
    angles = [places[name] for name in dataset.DIRECTIONS if name in places.variables]
    return xr.broadcast(*angles)[0]


def residuals(solution: Solution) -> xr.DataArray:
    """The fitted BRDF less the measured one (points,), with the coordinates of the points."""
    scan = solution.scan
    out = scan["brdf"].copy(data=solution.brdf(scan) - scan["brdf"].values)
    out.attrs = {"units": solution.unit, "long_name": "fitted less measured BRDF"}
    return out.rename("residual")


def metrics_of(solution: Solution) -> dict[str, float]:
    """Every metric of METRICS over the points that were fitted, E under the weights of the fit, as `assess` has it."""
    weights = solution.scan.pipe(lambda _: solution.dataset[f"{SCAN}weight"].values)
    return metrics(solution.scan, solution.brdf(solution.scan), None if is_logarithmic(solution) else weights)


def is_logarithmic(solution: Solution) -> bool:
    """Whether the fit compared logarithms."""
    return WEIGHTINGS[solution.dataset.attrs["weighting"]].logarithmic


def row_of(solution: Solution, scan: xr.Dataset) -> Row:
    """A stored fit as a row of a ranking of fits to this scan: metrics with weights of 1, no information criteria.

    Raises ValueError for a scan in another unit, or with directions of no group of the fit.
    """
    points = dataset.points(scan)
    if dataset.unit(scan) != solution.unit:
        raise ValueError(
            f"the fit is in {solution.unit}, and the scan in {dataset.unit(scan)}: they cannot be compared"
        )
    modelled = solution.brdf(points)
    return Row(
        solution,
        int((~solution.dataset["held"].values).sum()),
        metrics(points, modelled),
        judged(points, modelled),
        metrics_by_incidence(points, modelled),
        math.nan,
        math.nan,
        float(points["theta_r"].max()),
        "log10_rmse" if is_logarithmic(solution) else "E",
    )
