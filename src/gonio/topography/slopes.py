"""Slopes of a height map by finite differences, with what each operator makes of a wave.

A slope is one of a band: of a wave of n pixels a period an operator passes the share that `transfer` gives, and white
noise of rms s gives the forward operator a slope of 2 s/pitch whatever the surface is.
"""

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr

from gonio.topography.heights import Values, pitch, values

AUTO = ""
WIDEST = 7  # points of the widest operator


class Operator(NamedTuple):
    """A finite difference: its weights over neighbouring points, and how many of them a pixel is apart."""

    weights: tuple[float, ...]
    words: str

    def transfer(self, period: float) -> float:
        """What it makes of the slope of a wave with so many pixels a period, over the true slope."""
        t = 2 * math.pi / period
        half = (len(self.weights) - 1) / 2
        odd = sum(w * math.sin((k - half) * t) for k, w in enumerate(self.weights))
        return odd / t


OPERATORS: Mapping[str, Operator] = {
    "forward": Operator((-1.0, 1.0), "difference of neighbours, on the points between them"),
    "central": Operator((-0.5, 0.0, 0.5), "half the difference over two pixels"),
    "seven-point": Operator(
        (-1 / 60, 9 / 60, -45 / 60, 0.0, 45 / 60, -9 / 60, 1 / 60), "seven points, exact to the sixth order"
    ),
}


class Slopes(NamedTuple):
    """Slopes along x and y at the same points (NaN where a height is missing), and the operator that made them."""

    x: Values
    y: Values
    operator: str

    @property
    def length(self) -> Values:
        """The length of the gradient where it is known, as one row."""
        both = np.hypot(self.x, self.y).ravel()
        return both[np.isfinite(both)]

    @property
    def rms(self) -> float:
        """Sdq: the root of the mean squared gradient; NaN where nothing is known."""
        return float(np.sqrt(np.mean(self.length**2))) if self.length.size else math.nan


def chosen(heights: xr.Dataset, operator: str = AUTO) -> str:
    """The operator by name: the one asked for, else seven-point, or forward on a map that is too small for it.

    Raises ValueError for one that is not known.
    """
    if operator in OPERATORS:
        return operator
    if operator:
        raise ValueError(f"{operator!r} is no operator of slopes: choose {', '.join(OPERATORS)}")
    return "seven-point" if min(heights.sizes["x"], heights.sizes["y"]) > WIDEST else "forward"


def slopes(heights: xr.Dataset, operator: str = AUTO) -> Slopes:
    """The slopes along x and y at every point whose neighbours are all in use.

    Parameters
    ----------
    heights : xarray.Dataset
        A levelled map: the tilt of a map is a slope as well.
    operator : str
        forward, central or seven-point; without it seven-point where the map has room for it.

    Returns
    -------
    Slopes
        x and y (rows, columns), without the rim that the operator needs.

    Raises
    ------
    ValueError
        The operator is not known, or wider than the map.

    """
    name = chosen(heights, operator)
    weights = OPERATORS[name].weights
    z, (dx, dy) = values(heights), pitch(heights)
    if min(z.shape) < len(weights):
        raise ValueError(
            f"the operator {name} takes {len(weights)} points, and the map has {min(z.shape)} along a side"
        )
    along = [_difference(z, weights, axis) / step for axis, step in ((1, dx), (0, dy))]
    rows, columns = (n - len(weights) + 1 for n in z.shape)
    # The forward operator's points lie between the pixels: those of x and y half a pixel apart are taken for one.
    first = (len(weights) - 1) // 2
    return Slopes(along[0][first : first + rows], along[1][:, first : first + columns], name)


def _difference(z: Values, weights: tuple[float, ...], axis: int) -> Values:
    count = z.shape[axis] - len(weights) + 1
    parts = (weight * np.take(z, range(k, k + count), axis) for k, weight in enumerate(weights) if weight)
    return np.sum(list(parts), axis=0)


def noise_slope(first: xr.Dataset, second: xr.Dataset, operator: str = AUTO) -> float:
    """The rms slope of noise alone, from two maps of one place: that of their difference over sqrt(2).

    Raises ValueError for maps of different size or pitch.
    """
    if first.sizes != second.sizes or not np.allclose(pitch(first), pitch(second), rtol=1e-6):
        raise ValueError("noise is told from two maps of one place, and these differ in size or pitch")
    difference = first.assign(z=first["z"] - second["z"].values)
    return slopes(difference, operator).rms / math.sqrt(2)
