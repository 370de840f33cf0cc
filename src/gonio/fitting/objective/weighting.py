"""Ready weightings of the objective (guo2023, eq 11): the points of a scan into weights of their squared errors."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

Values = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Weighting:
    """One way to weigh squared errors, from the points and a noise floor that only a `floored` one has a use for.

    `suits` says which values have a weight; where one has none, `weights` raises ValueError. `logarithmic` compares
    logarithms, in which no weight enters linearly.
    """

    help: str
    weights: Callable[[xr.Dataset, float], Values]
    logarithmic: bool = False
    floored: bool = False
    suits: Callable[[xr.Dataset, float], npt.NDArray[np.bool_]] = lambda points, floor: np.ones(
        points["brdf"].shape, dtype=bool
    )


def _uniform(points: xr.Dataset, floor: float = 0.0) -> Values:
    return np.ones(points.sizes["direction"])


def _relative(points: xr.Dataset, floor: float) -> Values:
    values = points["brdf"].values if floor > 0 else _positive(points, "relative")
    weights: Values = 1 / (values**2 + floor**2)
    return weights


def _solid_angle(points: xr.Dataset, floor: float) -> Values:
    theta_r = np.radians(points["theta_r"].values)
    return np.cos(theta_r) * np.sin(theta_r)


def _inverse_variance(points: xr.Dataset, floor: float) -> Values:
    return 1 / stated(points, "weighting by uncertainty", "choose another weighting") ** 2


def stated(points: xr.Dataset, purpose: str, remedy: str) -> Values:
    """The standard uncertainty of every value of a flat scan; ValueError with the remedy where one has none."""
    if "uncertainty" not in points:
        raise ValueError(
            f"{purpose} needs a column uncertainty_sr-1 (or std_sr-1), and the scan has none: add it, or {remedy}"
        )
    uncertainty: Values = points["uncertainty"].values
    unknown = int((~(uncertainty > 0)).sum())
    if unknown:
        raise ValueError(
            f"{purpose} needs a positive one for every value, and {unknown} of {len(uncertainty)} have none: {remedy}"
        )
    return uncertainty


def _logarithmic(points: xr.Dataset, floor: float) -> Values:
    _positive(points, "log")
    return _uniform(points)


def _is_positive(points: xr.Dataset, floor: float) -> npt.NDArray[np.bool_]:
    return np.asarray((points["brdf"].values > 0) | (floor > 0))


def _is_stated(points: xr.Dataset, floor: float) -> npt.NDArray[np.bool_]:
    return np.asarray(points["uncertainty"].values > 0)


def _positive(points: xr.Dataset, name: str) -> Values:
    values: Values = points["brdf"].values
    wrong = int((values <= 0).sum())
    if wrong:
        keep = "give a noise floor (--noise-floor), " if WEIGHTINGS[name].floored else ""
        raise ValueError(
            f"{name} weighting needs positive values, and {wrong} of {len(values)} are not: {keep}"
            "mask what is below a floor (--floor) or choose another weighting"
        )
    return values


WEIGHTINGS: Mapping[str, Weighting] = {
    "uniform": Weighting("every point alike, as the paper does", _uniform),
    "relative": Weighting(
        "1/(brdf^2 + floor^2): every relative error alike above a noise floor",
        _relative,
        floored=True,
        suits=_is_positive,
    ),
    "solid-angle": Weighting("cos theta_r sin theta_r: a hemisphere's energy from an in-plane scan", _solid_angle),
    "uncertainty": Weighting("1/uncertainty^2: what the scan itself is sure of", _inverse_variance, suits=_is_stated),
    "log": Weighting(
        "squared difference of logarithms: every decade alike", _logarithmic, logarithmic=True, suits=_is_positive
    ),
}
