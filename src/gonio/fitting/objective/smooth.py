"""Parameters that vary smoothly along a coordinate: what is held against them, as rows of the least-squares system."""

import math
from collections.abc import Container, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.objective.entries import Entry

Values = npt.NDArray[np.float64]
AUTO = "auto"


class Smooth(NamedTuple):
    """One parameter with a value for each of a coordinate's, and how strongly it is held to vary smoothly along it.

    The search minimises E (guo2023, eq 11) plus `strength` times the integral, over the coordinate from 0 at its least
    value to 1 at its largest, of the squared second derivative of the parameter over its `scale`; the mean of these
    integrals where other coordinates group the parameter too. Derivatives are divided differences, so steps may be
    uneven. Strength 0 leaves each value free; the larger it is, the straighter the line through them. `auto` has it
    chosen by `gonio.fitting.search.strength.resolved`, which also finds the scale where it is NaN.
    """

    by: str
    strength: float | str = AUTO
    scale: float = math.nan

    @classmethod
    def parsed(cls, text: str) -> "Smooth":
        """`wavelength`, `wavelength:1e-5` or `wavelength:1e-5:scale`; ValueError where a number is none."""
        by, *numbers = (part.strip() for part in text.split(":"))
        if len(numbers) > 2 or not by:
            raise ValueError(f"{text!r} is not of the form coordinate:strength")
        strength = float(numbers[0]) if numbers and numbers[0] != AUTO else AUTO
        return cls(by, strength, float(numbers[1]) if len(numbers) > 1 else math.nan)

    def __str__(self) -> str:
        return f"{self.by}:{self.strength}:{self.scale}"

    @property
    def is_resolved(self) -> bool:
        return self.strength == 0 or (self.strength != AUTO and math.isfinite(self.scale))


Smoothing = Mapping[str, str | tuple[str, float | str] | Smooth]


def declared(smooth: Smoothing, points: xr.Dataset, held: Container[str], shared: Container[str]) -> dict[str, Smooth]:
    """What is to be smooth, by name; ValueError where a parameter or its coordinate cannot be."""
    out = {}
    for name, given in smooth.items():
        one = Smooth(given) if isinstance(given, str) else Smooth(*given)
        if name in held or name in shared:
            what = "held" if name in held else "shared"
            raise ValueError(f"{name} is {what} and smooth over {one.by}: choose one")
        if one.by not in points.coords:
            have = ", ".join(str(c) for c in points.coords)
            raise ValueError(f"the scan has no coordinate {one.by!r} to be smooth over; it has {have}")
        if points[one.by].dtype.kind not in "iuf":
            raise ValueError(f"{name} cannot be smooth over {one.by}, whose values are no numbers: group it instead")
        if len(np.unique(points[one.by].values)) < 3:
            raise ValueError(f"{name} cannot be smooth over fewer than three values of {one.by}: group it instead")
        if isinstance(one.strength, str) and one.strength != AUTO:
            raise ValueError(f"the strength of {name} is {one.strength!r}: give a number or {AUTO!r}")
        if not isinstance(one.strength, str) and not 0 <= one.strength < math.inf:
            raise ValueError(f"the strength of {name} is {one.strength:g}: it must be finite and not negative")
        if one.scale <= 0:
            raise ValueError(f"the scale of {name} is {one.scale:g}: it must be positive")
        out[name] = one
    return out


def penalty_rows(smooth: Mapping[str, Smooth], entries: Sequence[Entry], points: xr.Dataset) -> Values:
    """Rows (m, values) whose squared product with the values of `entries` is what is added to E."""
    size = sum(entry.size for entry in entries)
    blocks, at = [np.empty((0, size))], 0
    for entry in entries:
        one = smooth.get(entry.name)
        if one and one.strength:
            if not one.is_resolved:
                raise ValueError(
                    f"how smooth {entry.name} is to be is not resolved: gonio.fitting.search.strength.resolved finds it"
                )
            bends = _bends(entry, one.by, points)
            block = np.zeros((len(bends), size))
            block[:, at : at + entry.size] = math.sqrt(float(one.strength)) / one.scale * bends
            blocks.append(block)
        at += entry.size
    return np.concatenate(blocks)


def _bends(entry: Entry, by: str, points: xr.Dataset) -> Values:
    """Second derivatives (m, groups) along each curve of the entry, whose squares sum to their mean integral."""
    first = np.unique(entry.group, return_index=True)[1]
    x = points[by].values[first].astype(float)
    x = (x - x.min()) / np.ptp(x)
    others = [np.unique(points[c].values[first], return_inverse=True)[1] for c in entry.by if c != by]
    codes = np.column_stack([np.zeros(len(x), dtype=int), *others])
    curves = [np.flatnonzero((codes == row).all(axis=1)) for row in np.unique(codes, axis=0)]
    rows = [np.empty((0, len(x)))]
    for curve in curves:
        order = curve[np.argsort(x[curve])]
        bends = np.zeros((max(len(order) - 2, 0), len(x)))
        for row, (before, here, after) in zip(bends, zip(order, order[1:], order[2:], strict=False), strict=True):
            left, right = x[here] - x[before], x[after] - x[here]
            both = left + right
            row[[before, here, after]] = np.array([1 / left, -both / (left * right), 1 / right]) * math.sqrt(2 / both)
        rows.append(bends)
    return np.concatenate(rows) / math.sqrt(len(curves))
