"""Parameters that vary smoothly along a coordinate: the roughness penalty, as rows of the least-squares system.

A parameter v with one value for each value of a coordinate (a spectrum, say) has the penalty

    strength * integral_0^1 (v''(x) / scale)^2 dx,   x = (c - c_min)/(c_max - c_min),

which the search adds to E (guo2023, eq 11). A straight line in x has no penalty. The second derivative at an inner
value is the divided difference of three neighbours, so steps may be uneven. The integral is the trapezoidal sum over
the inner values; the two end values have no second derivative. The penalty is then |P v|^2 with a constant matrix P,
and enters every least-squares problem as further rows below those of the points.

The penalty biases the estimate towards a straight line. Uncertainties do not include that bias. How strong the penalty
should be is decided in `gonio.fitting.search.strength`, not here.
"""

import math
from collections.abc import Container, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.objective.entries import Entry

Values = npt.NDArray[np.float64]
AUTO = "auto"  # strength that is to be chosen by leave-one-out prediction


class Smooth(NamedTuple):
    """How one parameter is held smooth: along which coordinate, how strongly, and in which unit of the parameter.

    Parameters
    ----------
    by : str
        The coordinate. The parameter has one value for each of its values, which must be at least three numbers.
    strength : float or str
        The factor of the penalty (see the module). It has no unit, because x runs from 0 to 1 and the parameter is
        divided by `scale`. 0 leaves each value free; the larger it is, the straighter the line through them. `auto`
        has it chosen by `gonio.fitting.search.strength.resolved`.
    scale : float
        The size of the parameter, in its own unit. NaN has it found by `resolved` as well.

    """

    by: str
    strength: float | str = AUTO
    scale: float = math.nan

    @classmethod
    def parsed(cls, text: str) -> "Smooth":
        """`wavelength`, `wavelength:1e-5` or `wavelength:1e-5:scale`; ValueError for another form or a bad number."""
        by, *numbers = (part.strip() for part in text.split(":"))
        if len(numbers) > 2 or not by:
            raise ValueError(f"{text!r} is not of the form coordinate:strength")
        strength = float(numbers[0]) if numbers and numbers[0] != AUTO else AUTO
        return cls(by, strength, float(numbers[1]) if len(numbers) > 1 else math.nan)

    def __str__(self) -> str:
        """The text that `parsed` reads: a Solution stores its smooth parameters in this form."""
        return f"{self.by}:{self.strength}:{self.scale}"

    @property
    def is_resolved(self) -> bool:
        """Whether strength and scale are numbers; strength 0 needs no scale, because nothing is then added to E."""
        return self.strength == 0 or (self.strength != AUTO and math.isfinite(self.scale))


Smoothing = Mapping[str, str | tuple[str, float | str] | Smooth]


def declared(smooth: Smoothing, points: xr.Dataset, held: Container[str], shared: Container[str]) -> dict[str, Smooth]:
    """The smooth parameters by name, each as a full Smooth, strength and scale possibly still open.

    Raises ValueError where a parameter cannot be smooth (it is held or shared), where its coordinate is not in the
    scan, is not a number or has fewer than three values, or where strength or scale is out of range.
    """
    out = {}
    for name, declaration in smooth.items():
        smoothing = Smooth(declaration) if isinstance(declaration, str) else Smooth(*declaration)
        by, strength = smoothing.by, smoothing.strength
        if name in held or name in shared:
            state = "held" if name in held else "shared"
            raise ValueError(f"{name} is {state} and smooth over {by}: choose one")
        if by not in points.coords:
            have = ", ".join(str(c) for c in points.coords)
            raise ValueError(f"the scan has no coordinate {by!r} to be smooth over; it has {have}")
        if points[by].dtype.kind not in "iuf":
            raise ValueError(f"{name} cannot be smooth over {by}, whose values are not numbers: group it instead")
        if len(np.unique(points[by].values)) < 3:  # two values always lie on a straight line, which has no penalty
            raise ValueError(f"{name} cannot be smooth over fewer than three values of {by}: group it instead")
        if isinstance(strength, str) and strength != AUTO:
            raise ValueError(f"the strength of {name} is {strength!r}: give a number or {AUTO!r}")
        if not isinstance(strength, str) and not 0 <= strength < math.inf:
            raise ValueError(f"the strength of {name} is {strength:g}: it must be finite and not negative")
        if smoothing.scale <= 0:  # false for NaN, a scale that is still to be found
            raise ValueError(f"the scale of {name} is {smoothing.scale:g}: it must be positive")
        out[name] = smoothing
    return out


def penalty_rows(smooth: Mapping[str, Smooth], entries: Sequence[Entry], points: xr.Dataset) -> Values:
    """The matrix P (m, values) whose squared product with the values of `entries` is what is added to E.

    The columns are the values of all entries in their order, of which only those of smooth parameters are not zero.
    m is 0 where nothing is smooth or every strength is 0.
    Raises ValueError for a parameter whose strength or scale is still open.
    """
    size = sum(entry.size for entry in entries)
    blocks, at = [np.empty((0, size))], 0
    for entry in entries:
        smoothing = smooth.get(entry.name)
        if smoothing and smoothing.strength:
            if not smoothing.is_resolved:
                raise ValueError(
                    f"the strength or the scale of smooth {entry.name} is not resolved: "
                    "gonio.fitting.search.strength.resolved finds them"
                )
            second = _second_derivatives(entry, smoothing.by, points)
            block = np.zeros((len(second), size))
            block[:, at : at + entry.size] = math.sqrt(float(smoothing.strength)) / smoothing.scale * second
            blocks.append(block)
        at += entry.size
    return np.concatenate(blocks)


def _second_derivatives(entry: Entry, by: str, points: xr.Dataset) -> Values:
    """Rows (m, groups), whose squared product with the values of an entry is the integral of v''^2 over x.

    Where other coordinates group the parameter too, each combination of theirs has a curve of its own, and the result
    is the mean of the curves' integrals. A sum would make the penalty grow with the number of scans while E does not.
    A curve of fewer than three values adds no row.
    """
    first = np.unique(entry.group, return_index=True)[1]  # one point of each group: it has the group's coordinates
    x = points[by].values[first].astype(float)
    x = (x - x.min()) / np.ptp(x)
    others = [np.unique(points[c].values[first], return_inverse=True)[1] for c in entry.by if c != by]
    codes = np.column_stack([np.zeros(len(x), dtype=int), *others])
    curves = [np.flatnonzero((codes == row).all(axis=1)) for row in np.unique(codes, axis=0)]
    rows = [np.empty((0, len(x)))]
    for curve in curves:
        order = curve[np.argsort(x[curve])]
        second = np.zeros((max(len(order) - 2, 0), len(x)))
        for row, (before, here, after) in zip(second, zip(order, order[1:], order[2:], strict=False), strict=True):
            # v'' = 2/both (v_before/left - both v_here/(left right) + v_after/right), times sqrt(both/2), its part of x
            left, right = x[here] - x[before], x[after] - x[here]
            both = left + right
            row[[before, here, after]] = np.array([1 / left, -both / (left * right), 1 / right]) * math.sqrt(2 / both)
        rows.append(second)
    return np.concatenate(rows) / math.sqrt(len(curves))
