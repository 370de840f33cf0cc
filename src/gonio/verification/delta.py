"""The relative deviation by which guo2023 judges its set-up (eq 9), and what it must not exceed."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]


def delta(measured: npt.ArrayLike, theory: npt.ArrayLike) -> float:
    """sqrt(mean(((measured - theory)/measured)^2)) (guo2023, eq 9); NaN of nothing.

    Raises ValueError where a measured value is not above zero, which the equation divides by.
    """
    values, expected = np.asarray(measured, dtype=float), np.asarray(theory, dtype=float)
    if not values.size:
        return float("nan")
    if not (values > 0).all():
        raise ValueError(f"{int((~(values > 0)).sum())} measured values are not above zero, and eq 9 divides by them")
    return float(np.sqrt(np.mean(((values - expected) / values) ** 2)))


@dataclass(frozen=True)
class Deviation:
    """The deviation of some values, over which range, and against which uncertainty.

    what: which values, in words. expanded: their relative expanded uncertainty (k = 2), NaN where none is known.
    """

    what: str
    count: int
    delta: float
    expanded: float

    @property
    def passes(self) -> bool | None:
        """Whether delta is below half the expanded uncertainty; None where that is not known."""
        return self.delta < self.expanded / 2 if self.expanded == self.expanded and self.count else None
