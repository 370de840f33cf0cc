"""What a large residual costs: losses under which a few wrong points do not carry a fit away.

They measure a residual in units of its scatter, which is taken to be alike at every point: a robust loss belongs to a
weighting that makes it so, as relative or uncertainty do, or it takes a peak for an outlier.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Loss:
    """One loss of residuals in units of their scale, by what it makes of each.

    weight: of a point's squared error. slope: of weight times residual, over the weight. cost: half the square near
    zero, as for a squared loss.
    """

    help: str
    weight: Callable[[Values], Values]
    slope: Callable[[Values], Values]
    cost: Callable[[Values], Values]


HUBER, CAUCHY = 1.345, 2.385  # 95 % as efficient as squares where the noise is normal (holland1977)


def _huber(u: Values) -> Values:
    return HUBER / np.maximum(np.abs(u), HUBER)


LOSSES: Mapping[str, Loss] = {
    "squared": Loss("every error by its square", np.ones_like, np.ones_like, lambda u: u**2 / 2),
    "huber": Loss(
        "by its square up to 1.3 of the scatter, by its size beyond (huber1964)",
        _huber,
        lambda u: np.where(np.abs(u) <= HUBER, 1.0, 0.0),
        lambda u: np.where(np.abs(u) <= HUBER, u**2 / 2, HUBER * (np.abs(u) - HUBER / 2)),
    ),
    "cauchy": Loss(
        "by the logarithm of its square: gross errors count for nearly nothing",
        lambda u: 1 / (1 + (u / CAUCHY) ** 2),
        lambda u: (CAUCHY**2 - u**2) / (CAUCHY**2 + u**2),
        lambda u: CAUCHY**2 / 2 * np.log1p((u / CAUCHY) ** 2),
    ),
}
