"""Figures of merit: how much modelled values differ from measured ones, over a scan and over each of its curves.

Every model of a scan is judged at the same points. A logarithm needs positive values, so lg RMSE leaves out what was
measured as zero or below, for all models alike, and a model's value below a floor counts as the floor: one that is zero
in the wings would otherwise be judged by the lobe alone, and one that is 1e-300 there by nothing else. The floor is a
tenth of the least positive value measured. With the floor at that value itself, a model that predicts nothing would
have no error where the wings are flat. Of a fit with a noise floor it is a tenth of that, where that is more: measured
values below it are noise, and count as the floor too. `judged` says how many values each rule concerns.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.measured.distinct import distinct
from gonio.resampling.difference import least_logarithm, log10_rmse

Values = npt.NDArray[np.float64]

MOST_INCIDENCES = 1000  # angles; a scan has tens


@dataclass(frozen=True)
class Metric:
    """One figure of merit: its heading, and its definition in a few words and in full; smaller is better."""

    title: str
    brief: str
    help: str


METRICS: Mapping[str, Metric] = {
    "delta": Metric(
        "delta",
        "rms relative error",
        "rms of the error relative to the measured value, over positive values (guo2023, eq 9)",
    ),
    "E": Metric(
        "E",
        "squared error over squared measurement",
        "weighted squared error over weighted squared measurement (eq 11)",
    ),
    "nrmse": Metric(
        "nRMSE",
        "rms error of curves over their specular value",
        "rms difference of curves that are each divided by their own value at the specular angle (Tables 2 and 3)",
    ),
    "log10_rmse": Metric(
        "lg RMSE",
        "rms error of the decimal logarithm",
        "rms difference of decimal logarithms over values measured as positive; a modelled value below a tenth of the "
        "least of them counts as that",
    ),
}


@dataclass(frozen=True)
class Judged:
    """The points that lg RMSE is over.

    points: how many were measured. not_positive: how many of them it leaves out, since they were measured as zero or
    below. floor: in the unit of the values; NaN without a positive one. floored: how many modelled values lie below the
    floor, where the measured one is positive, and count as the floor.
    """

    points: int
    not_positive: int
    floor: float
    floored: int


def least(points: xr.Dataset) -> float:
    """The floor of modelled values in a logarithm, in the unit of the flat scan; NaN without a positive value."""
    return least_logarithm(points["brdf"].values)


def judged(points: xr.Dataset, modelled: Values, floor: float | None = None) -> Judged:
    """How many points of a flat scan lg RMSE leaves out or floors; `floor` as `metrics` takes it."""
    measured = points["brdf"].values
    floor = least(points) if floor is None else floor
    positive = measured > 0
    return Judged(
        len(measured), int(np.count_nonzero(~positive)), floor, int(np.count_nonzero(positive & (modelled < floor)))
    )


def metrics(
    points: xr.Dataset, modelled: Values, weights: Values | None = None, floor: float | None = None
) -> dict[str, float]:
    """Every metric of METRICS between the BRDF of a flat scan and modelled values at the same directions.

    Parameters
    ----------
    points : xarray.Dataset
        A flat scan.
    modelled : array
        Values (points,) in its unit.
    weights : array, optional
        The weights (points,) of E (guo2023, eq 11); 1 where None.
    floor : float, optional
        `least` of the whole scan, where the points are a part of one; None takes that of the points.

    Returns
    -------
    dict
        Each metric by name. A metric that the data do not allow is NaN: delta and log10_rmse without positive values,
        nrmse without a curve that holds its specular angle. So is one with a modelled value that is NaN.

    """
    measured = points["brdf"].values
    weights = np.ones_like(measured) if weights is None else weights
    floor = least(points) if floor is None else floor
    positive = measured > 0
    error, signal = modelled - measured, float(np.sum(weights * measured**2))
    return {
        "delta": _rms(error[positive] / measured[positive]),
        "E": float(np.sum(weights * error**2)) / signal if signal else math.nan,
        "nrmse": _rms(_normalised_error(points, modelled, floor)),
        "log10_rmse": log10_rmse(measured, modelled, floor),
    }


def metrics_by_incidence(
    points: xr.Dataset, modelled: Values, floor: float | None = None
) -> dict[float, dict[str, float]]:
    """The metrics of each incidence angle [deg] on its own; none where there are more than MOST_INCIDENCES.

    `floor` as `metrics` takes it: None is that of all the points. A grid of other coordinates
    than theta_i may have as many as directions: then no angle has a curve of its own.
    """
    theta_i = points["theta_i"].values
    if len(distinct(theta_i[: 100 * MOST_INCIDENCES])[0]) > MOST_INCIDENCES:  # of millions, the first are enough
        return {}
    angles, group = distinct(theta_i)
    if len(angles) > MOST_INCIDENCES:
        return {}
    floor = least(points) if floor is None else floor
    rows_of = {float(angle): np.flatnonzero(group == k) for k, angle in enumerate(angles)}
    return {angle: metrics(points.isel(direction=rows), modelled[rows], floor=floor) for angle, rows in rows_of.items()}


def curves(points: xr.Dataset) -> Iterator[tuple[dict[str, Any], npt.NDArray[np.intp]]]:
    """The in-plane curves of a flat scan: the coordinates of each, and its rows in the order of signed theta_r."""
    keys = ("theta_i", *dataset.sets(points))
    in_plane = np.flatnonzero(dataset.is_in_plane(points))
    if not in_plane.size:
        return
    columns = [distinct(points[key].values[in_plane]) for key in keys]
    order = np.lexsort((dataset.signed_theta_r(points)[in_plane], *(group for _, group in reversed(columns))))
    new_curve = np.any([np.diff(group[order]) != 0 for _, group in columns], axis=0)
    for part in np.split(order, np.flatnonzero(new_curve) + 1):
        yield {k: v[group[part[0]]].item() for k, (v, group) in zip(keys, columns, strict=True)}, in_plane[part]


def at_specular(theta_r: Values, values: Values, theta_i: float) -> float:
    """A curve's value at its specular angle, interpolated; NaN where the scan does not reach it."""
    if not theta_r[0] <= theta_i <= theta_r[-1]:
        return math.nan
    return float(np.interp(theta_i, theta_r, values))


def _normalised_error(points: xr.Dataset, modelled: Values, floor: float) -> Values:
    """Differences of the curves that hold their specular angle, each curve normalised by its own value there.

    A modelled value there below the floor counts as the floor, so that every model is judged by the same curves.
    """
    signed, measured = dataset.signed_theta_r(points), points["brdf"].values
    errors = []
    for key, rows in curves(points):
        modelled_specular = at_specular(signed[rows], modelled[rows], key["theta_i"])
        measured_specular = at_specular(signed[rows], measured[rows], key["theta_i"])
        if measured_specular > 0:
            errors.append(modelled[rows] / np.maximum(modelled_specular, floor) - measured[rows] / measured_specular)
    return np.concatenate(errors) if errors else np.empty(0)


def _rms(values: Values) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else math.nan
