"""What a large residual costs: losses under which a few wrong points do not decide a fit.

A loss rho(u) of a residual u takes the place of u^2/2. It is minimised by iteratively reweighted least squares
(holland1977): each point has the weight w(u) = rho'(u)/u, and fits and weights are computed in turn until they agree
(`search.reweighting`). So this file has no search of its own, only the functions that such a search needs.

    squared   rho = u^2/2,                                     w = 1
    huber     rho = u^2/2 for |u| <= k, else k (|u| - k/2),    w = min(1, k/|u|)         (huber1964)
    cauchy    rho = k^2/2 ln(1 + (u/k)^2),                     w = 1/(1 + (u/k)^2)

A residual is measured in units of its scatter, which is taken to be the same at every point. A robust loss therefore
belongs to a weighting that makes it so, such as relative or uncertainty. Under uniform weighting and noise in
proportion to the value, it takes a peak for an outlier.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Loss:
    """One loss of residuals u (points,) in units of their scatter, by what it makes of each.

    weight: w(u) = rho'(u)/u, of a point's squared error. slope: the derivative of w(u) u, over w(u): 1 for a squared
    loss, negative where a residual that grows pulls less. The covariance of a robust fit needs it (huber1967).
    cost: rho(u), which is half the square near zero, so that losses compare with squared errors.
    """

    help: str
    weight: Callable[[Values], Values]
    slope: Callable[[Values], Values]
    cost: Callable[[Values], Values]


# The k of each loss: where noise is normal, the variance is 1/0.95 of that of squared errors (holland1977). A smaller k
# resists outliers more, and costs more of that efficiency.
HUBER, CAUCHY = 1.345, 2.385


def _huber(u: Values) -> Values:
    """min(1, k/|u|), in a form that does not divide by a residual of zero."""
    return HUBER / np.maximum(np.abs(u), HUBER)


LOSSES: Mapping[str, Loss] = {
    "squared": Loss("the square of every residual", np.ones_like, np.ones_like, lambda u: u**2 / 2),
    "huber": Loss(
        "the square up to 1.3 of the scatter, proportional to the residual beyond (huber1964)",
        _huber,
        lambda u: np.where(np.abs(u) <= HUBER, 1.0, 0.0),
        lambda u: np.where(np.abs(u) <= HUBER, u**2 / 2, HUBER * (np.abs(u) - HUBER / 2)),
    ),
    "cauchy": Loss(
        "the logarithm of the square: gross errors have nearly no weight",
        lambda u: 1 / (1 + (u / CAUCHY) ** 2),
        lambda u: (CAUCHY**2 - u**2) / (CAUCHY**2 + u**2),
        lambda u: CAUCHY**2 / 2 * np.log1p((u / CAUCHY) ** 2),
    ),
}
