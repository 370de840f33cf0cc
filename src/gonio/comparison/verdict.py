"""Whether a model describes a scan: one grade from its error of prediction and the scan's own scatter.

The error of a model is told as a part of the value. From an lg RMSE of e decades it is 10^e - 1: an error of 0.0414
decades is 10 %. From E of another weighting it is its root, the rms error over the rms value, both under that
weighting.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.comparison.assessment import Row
from gonio.comparison.metrics import curves
from gonio.measured import dataset

Values = npt.NDArray[np.float64]

GOOD, FAIR, POOR = 0.10, 0.30, 1.0  # the most that a model of the grade errs by; 1 is a factor of two
OWN = 1.5  # times the scan's scatter: a model that errs by no more follows all that the scan shows
NORMAL = 1.4826  # the standard deviation of a normal distribution over its median absolute deviation
FEWEST = 20  # differences that show a scatter


class Verdict(NamedTuple):
    """How well a model describes a scan. Errors are parts of the value; NaN where there is none.

    metric: in which the errors were found. grade: good, fair, poor, or none where no model that was tried describes the
    scan. typical_error: over the points that were fitted. left_out_error: over directions that the fit was not shown.
    scatter: of the scan itself.
    """

    model: str
    metric: str
    grade: str
    typical_error: float
    left_out_error: float
    scatter: float

    @property
    def words(self) -> str:
        """The verdict as a sentence."""
        error = self.typical_error if math.isnan(self.left_out_error) else self.left_out_error
        if self.grade == "none":
            off = _factor(error) if self.metric == "log10_rmse" else f"{_percent(error)} of the weighted signal"
            return f"no model here describes this scan: the best, {self.model}, is off by {off}"
        left_out = "" if math.isnan(self.left_out_error) else f" (left out: {_percent(self.left_out_error)})"
        scatter = "" if math.isnan(self.scatter) else f", the scan's own scatter {_percent(self.scatter)}"
        typical = f"typical error {_percent(self.typical_error)}"
        return f"{self.model} describes this scan: {typical}{left_out}{scatter}: {self.grade}"


def verdict(row: Row, points: xr.Dataset) -> Verdict:
    """The verdict on one fit of a flat scan."""
    metric = row.metric
    typical = as_part(metric, row.metrics[metric])
    left_out = as_part(metric, row.validated[metric]) if row.validated else math.nan
    own = scatter(points)
    grade = _grade(typical if math.isnan(left_out) else left_out, own)
    if math.isnan(left_out) and grade == "good":
        grade = "fair"  # what predicts nothing that it was not shown is not known to be good
    return Verdict(row.model.name, metric, grade, typical, left_out, own)


def as_part(metric: str, value: float) -> float:
    """An error as a part of the value: of an lg RMSE in decades, or of E."""
    if metric == "log10_rmse":
        return 10**value - 1 if value < 300 else math.inf
    return math.sqrt(value) if value >= 0 else math.nan


def _grade(error: float, own: float) -> str:
    if error <= GOOD or error <= OWN * own:
        return "good"
    if error <= FAIR:
        return "fair"
    return "poor" if error < POOR else "none"


def scatter(points: xr.Dataset) -> float:
    """The scan's own scatter as a part of the value: how far positive points lie off the cubic through their
    neighbours.

    Along each in-plane curve the logarithm at a point is compared with the cubic through the two points on each side.
    The standard deviation is 1.4826 times the median absolute difference, each over the factor by which the noise of
    all five points adds up; so the few at a narrow peak, which no cubic follows, do not count. The coarser the steps,
    the more the curvature of the surface is in it: it is then an upper bound. NaN with fewer than 20 such points.
    """
    signed = dataset.signed_theta_r(points)
    values = points["brdf"].values
    parts = [_off_cubic(signed[rows][values[rows] > 0], values[rows][values[rows] > 0]) for _, rows in curves(points)]
    off = np.concatenate(parts) if parts else np.empty(0)
    return float(NORMAL * np.median(np.abs(off))) if off.size >= FEWEST else math.nan


def _off_cubic(theta: Values, values: Values) -> Values:
    """Differences of a curve's logarithms from the cubic through two neighbours on each side, over its noise factor."""
    theta, first = np.unique(theta, return_index=True)  # of repeats the first
    if len(theta) < 5:
        return np.empty(0)
    log = np.log(values[first])
    windows = np.lib.stride_tricks.sliding_window_view
    x, y = windows(theta, 5), windows(log, 5)
    others = (0, 1, 3, 4)
    # Lagrange's weights of the four neighbours at the point between them
    weights = np.stack(
        [np.prod([(x[:, 2] - x[:, m]) / (x[:, k] - x[:, m]) for m in others if m != k], axis=0) for k in others], axis=1
    )
    off = y[:, 2] - np.sum(weights * y[:, others], axis=1)
    out: Values = off / np.sqrt(1 + np.sum(weights**2, axis=1))
    return out


def _percent(part: float) -> str:
    percent = 100 * part
    return f"{percent:.0f} %" if percent >= 1 else f"{percent:.1g} %"


def _factor(part: float) -> str:
    """An error of more than the value, as a factor."""
    return f"a factor of {1 + part:.2g}" if part < 1e3 else f"a factor of {1 + part:.0e}"
