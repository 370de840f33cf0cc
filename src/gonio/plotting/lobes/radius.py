"""How values become lengths from a centre: as they are, or as decades above a floor that the figure names."""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gonio.plotting.style import LOG
from gonio.units import unit_label

Values = npt.NDArray[np.float64]

DECADES = 6.0  # the floor lies at most so far below the largest value: goniometers measure no more
APART = 0.2  # of the radius
INNERMOST = 0.25  # of the radius: no circle is smaller
FEW = 3  # decades: a shorter radius has circles between powers of ten


@dataclass(frozen=True)
class Radius:
    """The length of a value: the value on a linear radius, and log10(value / floor) on a logarithmic one.

    What is at or below the floor, zero on a linear radius, lies at the centre.
    """

    logarithmic: bool
    floor: float
    top: float

    @classmethod
    def of(cls, scale: str, values: Values) -> "Radius":
        """A radius for values: its floor is the power of ten below the least positive one, DECADES down at most."""
        finite = values[np.isfinite(values)]
        top = float(finite.max(initial=0.0)) or 1.0  # any radius where all is dark
        positive = finite[finite > 0]
        if scale != LOG or not positive.size:
            return cls(False, 0.0, top)
        least = max(float(positive.min()), top / 10**DECADES)
        return cls(True, 10.0 ** math.floor(math.log10(least) + 1e-9), top)

    def lengths(self, values: Values) -> Values:
        """The lengths of values, NaN for NaN."""
        values = np.asarray(values, dtype=float)
        if not self.logarithmic:
            return np.maximum(values, 0.0)
        return np.log10(np.maximum(values, self.floor) / self.floor)

    @property
    def end(self) -> float:
        """The length of the outermost circle, a little beyond the largest value."""
        length = float(self.lengths(np.array([self.top]))[0])
        return 1.05 * length if length > 0 else 1.0

    def circles(self, apart: float = APART) -> tuple[list[float], list[str]]:
        """Where circles are drawn, and their labels.

        apart: of the radius, the least distance between circles, which the labels need. Powers of ten come first.
        """
        kept: dict[float, float] = {}
        for marks in self._powers() if self.logarithmic else self._round():
            for length, mark in zip(self.lengths(np.array(marks)).tolist(), marks, strict=True):
                has_room = all(abs(length - other) >= apart * self.end for other in kept)
                if INNERMOST * self.end <= length <= self.end and has_room:
                    if kept and r"\times" in _label(mark):  # too wide beside another
                        continue
                    kept[length] = mark
        lengths = sorted(kept)
        return lengths, [_label(kept[length]) for length in lengths]

    def _round(self) -> list[list[float]]:
        from matplotlib.ticker import MaxNLocator

        # The outermost first: from it the scale is read best.
        return [list(MaxNLocator(4, steps=[1, 2, 5, 10]).tick_values(0, self.top))[::-1]]

    def _powers(self) -> list[list[float]]:
        """Powers of ten from outside, and what may stand between them."""
        first, decades = round(math.log10(self.floor)), math.floor(self.end)
        powers = [10.0 ** (first + k) for k in range(decades, -1, -1)]
        return [[m * power for power in powers] for m in ((1, 3, 5, 2) if decades < FEW else (1,))]

    def centre(self, unit: str) -> str:
        """What lies at the centre, in words for the heading."""
        if not self.logarithmic:
            return ""
        return f"centre: {_plain(self.floor)} {unit_label(unit)} and less".replace("  ", " ")


def _label(value: float) -> str:
    power = math.floor(math.log10(value) + 1e-9)
    if -3 <= power <= 3:
        return f"{value:.6g}"
    mantissa = round(value / 10**power, 6)
    times = "" if mantissa == 1 else rf"{mantissa:g}\times"
    return rf"$\mathdefault{{{times}10^{{{power}}}}}$"


SUPERSCRIPTS = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


def _plain(value: float) -> str:
    """A power of ten for a heading, in which nothing is taken for a formula."""
    power = round(math.log10(value))
    return f"{value:g}" if -3 <= power <= 3 else "10" + str(power).translate(SUPERSCRIPTS)
