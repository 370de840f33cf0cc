"""Shape parameters as coordinates from 0 to 1, so that every search steps through each of them sensibly."""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from gonio.model import Parameter

Values = npt.NDArray[np.float64]


class Axes:
    """Maps unit coordinates (..., n) to values between bounds: by ratios where a parameter spans decades, else evenly.

    A parameter from zero upwards steps by ratios of its value plus its default, which resolves both ends.
    `evenly` marks values that step evenly in any case: those of one smooth curve, which are then straight here too.
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
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.log((upper + self._offset) / (lower + self._offset))
        self._log_ratio = np.where(self._by_ratio, ratio, 0.0)

    def __len__(self) -> int:
        return len(self.lower)

    @property
    def maps(self) -> tuple[Values, ...]:
        """Lower and upper bound, offset, logarithm of the ratio, and whether it counts, one a coordinate."""
        return self.lower, self.upper, self._offset, self._log_ratio, self._by_ratio

    def values(self, unit: Values) -> Values:
        evenly = self.lower + unit * (self.upper - self.lower)
        by_ratio = (self.lower + self._offset) * np.exp(unit * self._log_ratio) - self._offset
        out: Values = np.clip(np.where(self._by_ratio, by_ratio, evenly), self.lower, self.upper)
        return out

    def unit(self, values: Values) -> Values:
        """The coordinates of values between the bounds: the inverse of `values`."""
        width = np.where(self.upper > self.lower, self.upper - self.lower, 1.0)
        with np.errstate(divide="ignore", invalid="ignore"):
            by_ratio = np.log((values + self._offset) / (self.lower + self._offset)) / self._log_ratio
        out: Values = np.clip(np.where(self._by_ratio, by_ratio, (values - self.lower) / width), 0.0, 1.0)
        return out


def _offset(parameter: Parameter, lower: float, upper: float) -> float | None:
    """What is added before taking logarithms; None for even steps."""
    if lower > 0 and upper > 10 * lower:
        return 0.0
    if lower == 0 and parameter.default > 0 and upper > 10 * parameter.default:
        return parameter.default
    return None
