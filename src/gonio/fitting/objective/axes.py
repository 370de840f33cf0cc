"""Shape parameters as coordinates u from 0 to 1, so that every search steps through each of them sensibly.

A grid or a random walk with even steps of the parameter would spend nearly all of them in the largest decade of one
that spans several, such as a rms height from 0.001 to 10 um. Even steps of its logarithm resolve every decade:

    even steps      v = lower + u (upper - lower)
    steps by ratio  v = (lower + d) ((upper + d)/(lower + d))^u - d

The offset d is zero for a positive lower bound. A logarithm cannot start at zero: there d is the parameter's default,
so that steps are nearly even well below the default and nearly logarithmic well above it.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gonio.model import Parameter

Values = npt.NDArray[np.float64]


class Axes:
    """Maps unit coordinates (..., n) to values between bounds: by ratios where a parameter spans decades, else evenly.

    parameters: the declaration of each of the n values. lower, upper (n,): their bounds, in the unit of the parameter.
    evenly: marks values that step evenly in any case. Values of one smooth curve do, because a straight line, which has
    no penalty, is then a straight line in these coordinates too.
    Raises ValueError for a bound that is not finite.
    """

    def __init__(
        self, parameters: list[Parameter], lower: Values, upper: Values, evenly: Sequence[bool] | None = None
    ) -> None:
        if not (np.isfinite(lower).all() and np.isfinite(upper).all()):
            raise ValueError("shape parameters need finite bounds")
        self.lower, self.upper = lower, upper
        offsets = [_offset(p, low, high) for p, low, high in zip(parameters, lower, upper, strict=True)]
        self._by_ratio = np.array([offset is not None for offset in offsets], dtype=bool)
        if evenly is not None:
            self._by_ratio &= ~np.array(evenly, dtype=bool)
        self._offset = np.array([offset or 0.0 for offset in offsets])
        with np.errstate(divide="ignore", invalid="ignore"):  # a lower bound of 0 without offset: replaced below
            ratio = np.log((upper + self._offset) / (lower + self._offset))
        self._log_ratio = np.where(self._by_ratio, ratio, 0.0)  # finite everywhere, so that `values` needs no mask

    def __len__(self) -> int:
        return len(self.lower)

    @property
    def maps(self) -> tuple[Values, ...]:
        """What a compiled search needs to map coordinates itself, each (n,).

        Lower and upper bound, offset, logarithm of the ratio, and whether the value steps by ratio.
        """
        return self.lower, self.upper, self._offset, self._log_ratio, self._by_ratio

    def values(self, unit: Values) -> Values:
        """The parameter values (..., n) at unit coordinates; never outside the bounds, which rounding could pass."""
        evenly = self.lower + unit * (self.upper - self.lower)
        by_ratio = (self.lower + self._offset) * np.exp(unit * self._log_ratio) - self._offset
        out: Values = np.clip(np.where(self._by_ratio, by_ratio, evenly), self.lower, self.upper)
        return out

    def unit(self, values: Values) -> Values:
        """The coordinates of values between the bounds: the inverse of `values`. 0 where both bounds are equal."""
        width = np.where(self.upper > self.lower, self.upper - self.lower, 1.0)
        with np.errstate(divide="ignore", invalid="ignore"):  # values that step evenly have a logarithm of ratio 0
            by_ratio = np.log((values + self._offset) / (self.lower + self._offset)) / self._log_ratio
        out: Values = np.clip(np.where(self._by_ratio, by_ratio, (values - self.lower) / width), 0.0, 1.0)
        return out


def _offset(parameter: Parameter, lower: float, upper: float) -> float | None:
    """The offset d that is added before taking logarithms, in the parameter's unit; None for even steps.

    Steps are even within one decade, and where the lower bound is below zero, which has no logarithm.
    """
    if lower > 0 and upper > 10 * lower:
        return 0.0
    if lower == 0 and parameter.default > 0 and upper > 10 * parameter.default:
        return parameter.default
    return None
