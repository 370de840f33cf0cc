"""Ready weightings of the objective (guo2023, eq 11): the points of a scan into weights of their squared errors.

A weighting gives the weight g_k of each point in E = sum_k g_k (f_k - m_k)^2 / sum_k g_k m_k^2, with the modelled BRDF
f_k and the measured one m_k. The weights g1(theta_i) and g2(theta_r) of a Problem and its point_weights multiply it.

    uniform       g = 1, as in guo2023
    relative      g = 1/(m^2 + floor^2)
    solid-angle   g = cos(theta_r) sin(theta_r)
    uncertainty   g = 1/u^2, with u the stated standard uncertainty
    log           g = 1, for the squared difference of ln f and ln m in place of f and m

If g is the inverse of each point's variance up to a factor, the estimate is, to first order, the one of least variance.
The weights are computed from measured values and stay as they are during a fit. Where they depend on m itself, a point
that noise made smaller has more weight than one that noise made larger. The fitted values are then too small by about
the square of the relative noise.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.check import places
from gonio.measured.sound import LARGEST_SQUARED, SMALLEST_SQUARED, is_stated

Values = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Weighting:
    """One way to weigh squared errors.

    help: what it does, in a few words. weights: the weight of each point, from the points and a noise floor [unit of
    the BRDF]; ValueError where a point has none. logarithmic: whether logarithms are compared, in which the residual is
    not linear in the weights of the terms. floored: whether the noise floor is used; the others ignore it.
    suits: which points have a weight. It raises nothing for values without one: `fit_many` marks the lanes of such
    points instead of refusing the whole stack.
    """

    help: str
    weights: Callable[[xr.Dataset, float], Values]
    logarithmic: bool = False
    floored: bool = False
    suits: Callable[[xr.Dataset, float], npt.NDArray[np.bool_]] = lambda points, floor: np.ones(
        points["brdf"].shape, dtype=bool
    )


def _uniform(points: xr.Dataset, floor: float = 0.0) -> Values:
    """The same weight for every point, so that the large values near the peak determine the fit."""
    return np.ones(points.sizes["direction"])


def _relative(points: xr.Dataset, floor: float) -> Values:
    """Inverse variance of noise with a proportional and a constant part, 1/(m^2 + floor^2).

    With standard deviations r m (proportional) and c (constant), the variance is r^2 (m^2 + (c/r)^2): the floor is c/r,
    the BRDF at which both parts are equal. A floor also gives a finite weight to values that are zero or negative.
    Without one the weight is 1/m^2, which a value of zero does not have.
    """
    values = points["brdf"].values if floor > 0 else _positive(points, "relative", SMALLEST_SQUARED)
    weights: Values = 1 / (values**2 + floor**2)
    return weights


def _solid_angle(points: xr.Dataset, floor: float) -> Values:
    """The part that a point of an in-plane scan has in the reflected flux.

    The directions of one theta_r are a ring of solid angle 2 pi sin(theta_r) d theta_r. The flux through it is f
    cos(theta_r) times that.
    """
    theta_r = np.radians(points["theta_r"].values)
    return np.cos(theta_r) * np.sin(theta_r)


def _inverse_variance(points: xr.Dataset, floor: float) -> Values:
    return 1 / stated(points, "weighting by uncertainty", "choose another weighting") ** 2


def stated(points: xr.Dataset, purpose: str, remedy: str) -> Values:
    """The standard uncertainty (points,) of every value of a flat scan, in the unit of the BRDF.

    Raises ValueError where the scan states none, or where one is not positive and finite, with the first place. The
    message begins with `purpose`, for which the uncertainty is needed, and ends with `remedy`.
    """
    if "uncertainty" not in points:
        raise ValueError(
            f"{purpose} needs a column uncertainty_sr-1 (or std_sr-1), and the scan has none: add it, or {remedy}"
        )
    uncertainty: Values = points["uncertainty"].values
    if (unknown := ~is_stated(uncertainty)).any():
        wrong = int((unknown & (np.abs(uncertainty) > 0)).sum())
        limits = f"outside {SMALLEST_SQUARED:g} to {LARGEST_SQUARED:g}"
        of_them = f" ({wrong} {'is' if wrong == 1 else 'are'} negative, infinite or {limits})" if wrong else ""
        those = f"{int(unknown.sum())} of {len(uncertainty)} have none{of_them}"
        where = places(points, unknown, 1)
        raise ValueError(f"{purpose} needs a positive uncertainty for every value, and {those}: {where}: {remedy}")
    return uncertainty


def _logarithmic(points: xr.Dataset, floor: float) -> Values:
    """Equal weights of differences of logarithms, which are relative errors where these are small."""
    _positive(points, "log", 0.0)
    return _uniform(points)


def _is_positive(points: xr.Dataset, floor: float) -> npt.NDArray[np.bool_]:
    return np.asarray((points["brdf"].values > 0) | (floor > 0))


def _has_square(points: xr.Dataset, floor: float) -> npt.NDArray[np.bool_]:
    return np.asarray((points["brdf"].values >= SMALLEST_SQUARED) | (floor > 0))


def _is_stated(points: xr.Dataset, floor: float) -> npt.NDArray[np.bool_]:
    return is_stated(points["uncertainty"].values)


def _positive(points: xr.Dataset, name: str, least: float) -> Values:
    """The measured values (points,), all positive and at least `least`.

    Raises ValueError with the remedies of the weighting where some are not.
    """
    values: Values = points["brdf"].values
    unfit = int(((values <= 0) | (values < least)).sum())
    if unfit:
        needed = "positive values" if (values <= 0).any() else f"values of at least {least:g}, which have a square"
        with_floor = "give a noise floor (--noise-floor), " if WEIGHTINGS[name].floored else ""
        raise ValueError(
            f"{name} weighting needs {needed}, and {unfit} of {len(values)} are not: {with_floor}"
            "mask what is below a floor (--floor) or choose another weighting"
        )
    return values


WEIGHTINGS: Mapping[str, Weighting] = {
    "uniform": Weighting("every point has the same weight, as in guo2023", _uniform),
    "relative": Weighting(
        "1/(brdf^2 + floor^2): equal relative errors count alike above a noise floor",
        _relative,
        floored=True,
        suits=_has_square,
    ),
    "solid-angle": Weighting("cos theta_r sin theta_r: a point's part in the reflected flux", _solid_angle),
    "uncertainty": Weighting(
        "1/uncertainty^2: the inverse variance that the scan states", _inverse_variance, suits=_is_stated
    ),
    "log": Weighting(
        "squared difference of logarithms: every decade counts alike",
        _logarithmic,
        logarithmic=True,
        suits=_is_positive,
    ),
}
