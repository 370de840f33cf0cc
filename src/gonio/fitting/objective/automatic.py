"""The weighting that a scan itself asks for: `weighting="auto"`.

A weighting says which errors count alike. The best one follows from the noise and from what a model can miss. A model
of a real surface misses by some per cent of the value, at the peak as in the wings, so relative errors should count
alike wherever the values are more than noise. The choice, from the values in use:

    log           all positive. Every relative error counts alike, over all decades.
    uncertainty   all positive, no more than two decades, and a standard uncertainty stated for each value.
    relative      some not positive, or many no larger than their stated uncertainty: a logarithm is noise there. The
                  constant noise is estimated, and the noise floor is where it equals the relative error expected.

The constant noise c is, from the first of these that the scan has: the median stated uncertainty of the smallest
values; the scatter of repeats of the smallest values; the rms of the negative values, which noise about zero makes. The
noise floor is at least the value below which a twentieth of the positive ones lie: a zero says that the value is small,
and not how small, and a few values that are wrong must not count for more than all others.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.sound import is_stated

Values = npt.NDArray[np.float64]

AUTO = "auto"
DECADES = 2.0  # between the least and the largest value: beyond it uniform weights see the peak alone
NOISY = 1 / 3  # of a value: a standard uncertainty beyond which its logarithm says little (three standard deviations)
FEW = 0.05  # of the values: so many noisy ones are let pass
SMALLEST = 0.2  # the part of the values, the smallest by size, that shows the constant noise
RESOLVED = 0.05  # the part of the positive values that lie below every noise floor
RELATIVE_ERROR = 0.1  # of a value: what a good model of a real surface misses (docs/real-surfaces.md)


class Choice(NamedTuple):
    """A weighting by its name, its noise floor [unit of the BRDF], and the reason in words."""

    weighting: str
    noise_floor: float
    reason: str


def chosen(points: xr.Dataset) -> Choice:
    """The weighting for a flat scan of values in use (direction)."""
    values = np.asarray(points["brdf"].values, dtype=float)
    uncertainty = points["uncertainty"].values if "uncertainty" in points else np.full_like(values, np.nan)
    stated = is_stated(uncertainty)
    count, unfit = len(values), int((values <= 0).sum())
    if unfit == count:
        return Choice("uniform", 0.0, "no value is positive")
    if unfit:
        return _relative(points, values, uncertainty, f"{unfit} of {count} values are not positive")
    noisy = int((uncertainty[stated] > NOISY * values[stated]).sum())
    if noisy > FEW * count:
        return _relative(
            points, values, uncertainty, f"{noisy} of {count} values are less than 3 standard uncertainties"
        )
    decades = math.log10(float(values.max() / values.min()))
    if decades > DECADES:
        return Choice("log", 0.0, f"all {count} values are positive and span {decades:.1f} decades")
    if stated.all():
        return Choice("uncertainty", 0.0, f"the scan states an uncertainty for each of its {count} values")
    return Choice("log", 0.0, f"all {count} values are positive, and no uncertainty is stated for all")


def _relative(points: xr.Dataset, values: Values, uncertainty: Values, reason: str) -> Choice:
    noise, source = _constant_noise(points, values, uncertainty)
    least = float(np.quantile(values[values > 0], RESOLVED))
    if noise < RELATIVE_ERROR * least:
        words = f"the noise floor is the value below which {RESOLVED:.0%} of the positive ones lie"
        return Choice("relative", float(f"{least:.3g}"), f"{reason}; {words}")
    floor = float(f"{noise / RELATIVE_ERROR:.3g}")
    return Choice(
        "relative", floor, f"{reason}; noise {noise:.2g} from {source}, equal to {RELATIVE_ERROR:.0%} at the floor"
    )


def _constant_noise(points: xr.Dataset, values: Values, uncertainty: Values) -> tuple[float, str]:
    """The standard deviation of the noise of values near zero, and what says so."""
    sizes = np.abs(values)
    small = sizes <= np.quantile(sizes, SMALLEST)
    stated = small & is_stated(uncertainty)
    if stated.any():
        return float(np.median(uncertainty[stated])), "the stated uncertainty of the smallest values"
    if (scatter := _scatter_of_repeats(points, values, small)) > 0:
        return scatter, "repeats of the smallest values"
    negative = values[values < 0]
    if negative.size:
        return float(np.sqrt(np.mean(negative**2))), f"the {negative.size} negative values"
    return 0.0, ""


def _scatter_of_repeats(points: xr.Dataset, values: Values, small: npt.NDArray[np.bool_]) -> float:
    """The standard deviation of values at the same direction and of the same set, pooled over `small`; 0 without any.

    With the d degrees of freedom of all repeats and the squares S about the mean of each, it is sqrt(S/d).
    """
    names = [str(name) for name in points.coords if points[name].dims == ("direction",)]
    keys = [np.unique(points[name].values[small], return_inverse=True)[1].ravel() for name in names]
    _, group, counts = np.unique(np.column_stack(keys), axis=0, return_inverse=True, return_counts=True)
    means = np.bincount(group.ravel(), values[small]) / counts
    freedom = int((counts - 1).sum())
    squares = float(np.sum((values[small] - means[group.ravel()]) ** 2))
    return math.sqrt(squares / freedom) if freedom else 0.0
