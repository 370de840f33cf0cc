"""Quantities that follow from a fit, each with its uncertainty: reflectance, albedo, peak and half width."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.certainty.band import propagate
from gonio.fitting.objective.differences import derivative
from gonio.fitting.search.solver import Progress, silent
from gonio.fitting.solution import Solution
from gonio.geometry import Geometry
from gonio.measured import dataset
from gonio.plausibility import bihemispherical_reflectance, hemispherical_reflectance

Values = npt.NDArray[np.float64]
Curve = Callable[[Values, Values], Values]  # all values of the fit and signed theta_r [deg] to the BRDF

RELATIVE = "the data are relative: without a calibration there is no reflectance"
NARROW = "a lobe is too narrow for the quadrature: gonio check --samples draws directions instead"
NODES = (48, 96, 200)  # of quadratures, each tried where the one before depends on its nodes
COARSER, SAME = 0.7, 1e-4  # a quadrature has converged if this share of its nodes changes it by no more, relative
FINE = 0.05  # deg: step of the grid on which a peak and its half are searched


@dataclass(frozen=True)
class Derived:
    """One number: what it is, at which incidence and set, its value and standard uncertainties, or why there is none.

    systematic: the systematic part of the uncertainty, NaN where the scan states none.
    """

    name: str
    where: Mapping[str, Any]
    unit: str
    value: float = math.nan
    uncertainty: float = math.nan
    systematic: float = math.nan
    why: str = field(default="", kw_only=True)


def derived(
    solution: Solution,
    scan: xr.Dataset,
    theta_i: Sequence[float] | None = None,
    progress: Progress = silent,
) -> list[Derived]:
    """What follows from a fit, for every set of the scan that was fitted: reflectance, albedo, peak and half width.

    Parameters
    ----------
    solution : Solution
        The fit.
    scan : xarray.Dataset
        The scan that was fitted.
    theta_i : sequence of float, optional
        Incidence angles [deg], by default those of the scan.
    progress : callable
        Called with the part of the work that is done, 0 to 1.

    Returns
    -------
    list of Derived
        At each incidence angle the directional-hemispherical reflectance, the largest BRDF in plane within the angles
        that the scan covers, and half the width of that peak at half its height. Over all incidence angles the
        bihemispherical reflectance under uniform light (white-sky albedo). Each has its standard uncertainty.
        Reflectances extrapolate the model over the hemisphere; relative data have none.

    Raises
    ------
    ValueError
        A grouped parameter has no value for an incidence angle.

    """
    flat = dataset.points(scan)
    numbers: list[Derived] = []
    parts = list(_sets(flat))
    for finished, (key, part) in enumerate(parts):
        angles = np.unique(part["theta_i"].values).tolist() if theta_i is None else theta_i
        for k, angle in enumerate(angles):
            numbers += _at_incidence(solution, part, key, float(angle))
            progress((finished + (k + 1) / (len(angles) + 1)) / len(parts))
        numbers.append(_albedo(solution, part, key))
        progress((finished + 1) / len(parts))
    return numbers


def _sets(flat: xr.Dataset) -> Iterator[tuple[dict[str, Any], xr.Dataset]]:
    """The coordinates that distinguish each set of a flat scan, and its part of the scan."""
    keys = dataset.sets(flat)
    for row in dict.fromkeys(zip(*(flat[key].values.tolist() for key in keys), strict=True)) if keys else [()]:
        key = dict(zip(keys, row, strict=True))
        yield key, dataset.select(flat, key)


def _at_incidence(solution: Solution, part: xr.Dataset, key: Mapping[str, Any], theta_i: float) -> Iterator[Derived]:
    """The reflectance and the peak at one incidence angle [deg] of a set."""
    model, (used, values_of) = solution.model, _values_of(solution, part, theta_i)
    where = {"theta_i": theta_i, **key}

    def reflectance(values: Values, nodes: int) -> float:
        return hemispherical_reflectance(lambda g: np.asarray(model(g, values_of(values))), theta_i, nodes)

    def curve(values: Values, theta_r: Values) -> Values:
        return np.asarray(model(Geometry.in_plane(np.full_like(theta_r, theta_i), theta_r), values_of(values)))

    yield _integral("reflectance", where, solution, reflectance, used)
    yield from _peak(where, solution, curve, part, used)


def _values_of(
    solution: Solution, part: xr.Dataset, theta_i: float
) -> tuple[list[int], Callable[[Values], dict[str, float]]]:
    """Which values of the fit hold at one incidence angle of a set, and a function that picks them by name from all."""
    sets = {name: part[name].values[:1] for name in dataset.SETS if name in part.coords}
    direction = dataset.make_scan([theta_i], [0.0], [0.0], coordinates=sets)
    indices = {name: int(np.ravel(index)[0]) for name, index in solution.places(direction).items()}
    return list(indices.values()), lambda values: {name: float(values[index]) for name, index in indices.items()}


def _albedo(solution: Solution, part: xr.Dataset, key: Mapping[str, Any]) -> Derived:
    """The bihemispherical reflectance of a set."""
    stored, model = solution.dataset, solution.model
    grouped = [
        n for n, by in zip(stored["name"].values, stored["by"].values, strict=True) if "theta_i" in by.split(",")
    ]
    refused = f"{grouped[0]} has one value for each theta_i, and none between them" if grouped else ""
    used, values_of = _values_of(solution, part, float(part["theta_i"].values[0]))

    def albedo(values: Values, nodes: int) -> float:
        return bihemispherical_reflectance(lambda g: np.asarray(model(g, values_of(values))), nodes)

    return _integral("albedo", key, solution, albedo, used, refused)


def _integral(
    name: str,
    where: Mapping[str, Any],
    solution: Solution,
    integral: Callable[[Values, int], float],
    used: list[int],
    refused: str = "",
) -> Derived:
    """A reflectance, unless the data are relative or the quadrature depends on its nodes.

    `used`: places of the values that it depends on. `refused` says why there is no such number, "" where there is.
    """
    if solution.unit != dataset.ABSOLUTE:
        refused = RELATIVE
    if refused:
        return Derived(name, where, "1", why=refused)
    values = solution.dataset["value"].values
    converged = (
        n for n in NODES if math.isclose(integral(values, n), integral(values, int(COARSER * n)), rel_tol=SAME)
    )
    nodes = next(converged, None)
    if nodes is None:
        return Derived(name, where, "1", why=NARROW)
    band = propagate(solution, lambda values: np.array([integral(values, nodes)]), used)
    return Derived(name, where, "1", float(band.value[0]), float(band.uncertainty[0]), float(band.systematic[0]))


def _peak(
    where: Mapping[str, Any], solution: Solution, curve: Curve, part: xr.Dataset, used: list[int]
) -> Iterator[Derived]:
    """The largest value in plane and the half width about it; `used`: places of the values that the curve depends on.

    Where values of the fit change, the angle of the peak moves. Its height does not depend on that to first order, for
    the slope is 0 there. The angles of half height move by the change of half height less the curve's, over its slope.
    """
    unit = solution.unit
    curve_rows = dataset.is_in_plane(part) & (part["theta_i"].values == where["theta_i"])
    in_plane = part.isel(direction=np.flatnonzero(curve_rows))
    if in_plane.sizes["direction"] < 2:
        why = "the scan has no curve in plane at this incidence"
        yield from (Derived("peak", where, unit, why=why), Derived("half width", where, "deg", why=why))
        return
    values, signed = solution.dataset["value"].values, dataset.signed_theta_r(in_plane)
    top, sides = _top_and_sides(lambda theta_r: curve(values, theta_r), float(signed.min()), float(signed.max()))
    theta_r = np.array([top, *sides])
    slopes = derivative(lambda theta_r: curve(values, theta_r), sides).diagonal() if len(sides) else sides

    def numbers(values: Values) -> Values:
        peak, *halves = curve(values, theta_r)
        moved = sides + (peak / 2 - np.array(halves)) / slopes
        return np.array([peak, np.ptp(moved) / 2] if len(moved) else [peak])

    band = propagate(solution, numbers, used)
    columns = zip(band.value.tolist(), band.uncertainty.tolist(), band.systematic.tolist(), strict=True)
    yield Derived("peak", where, unit, *next(columns))
    why = "the fit does not fall to half its peak on both sides within the scan"
    yield Derived("half width", where, "deg", *next(columns, ()), why="" if len(sides) else why)


def _top_and_sides(curve: Callable[[Values], Values], low: float, high: float) -> tuple[float, Values]:
    """Where a curve is largest between two angles [deg], and the two angles beside it where it has half that height.

    No angles of half height unless it falls to half on both sides.
    """
    from scipy.optimize import brentq, minimize_scalar

    def height(theta_r: float) -> float:
        return float(curve(np.array([theta_r]))[0])

    grid = np.linspace(low, high, max(int((high - low) / FINE), 3) + 1)
    heights = curve(grid)
    k = int(np.argmax(heights))
    bounds = grid[max(k - 1, 0)], grid[min(k + 1, len(grid) - 1)]
    refined = float(minimize_scalar(lambda t: -height(t), bounds=bounds, method="bounded", options={"xatol": 1e-9}).x)
    top = refined if height(refined) > heights[k] else float(grid[k])
    half = height(top) / 2
    lower, upper = np.flatnonzero((heights < half) & (grid < top)), np.flatnonzero((heights < half) & (grid > top))
    if not (lower.size and upper.size):
        return top, np.empty(0)
    return top, np.array([brentq(lambda t: height(t) - half, grid[end], top) for end in (lower[-1], upper[0])])
