"""The way from reading to reading: their order, its cost, and which incidence angles are worth a move of the table.

A reading takes its time, an arm its time for every degree, and a table that is turned to another incidence angle its
own. Along one arm the shortest way to visit some angles is from one end to the other; the next incidence angle begins
at the end where the arm is.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.dataset import signed_theta_r

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]


class Cost(NamedTuple):
    """Seconds: of a reading, of a degree of the arm, and of a move of the table to another incidence angle."""

    read: float = 1.0
    arm: float = 0.0
    table: float = 0.0

    @classmethod
    def given(cls, parts: Mapping[str, float]) -> "Cost":
        """From `{"read": 5, "table": 60}`; ValueError for another name, or for a time below zero."""
        if unknown := [name for name in parts if name not in cls._fields]:
            raise ValueError(f"--cost has no {unknown[0]!r}: give seconds for {', '.join(cls._fields)}")
        if below := [name for name, value in parts.items() if value < 0]:
            raise ValueError(f"--cost {below[0]} is {parts[below[0]]:g}: give seconds of 0 or more")
        return cls(**parts)

    def seconds(self, directions: xr.Dataset) -> float:
        """How long readings at directions in their order take, from where the first one is."""
        moved = float(np.abs(np.diff(_arm(directions))).sum())
        tables = int(np.count_nonzero(np.diff(directions["theta_i"].values))) + 1
        return self.read * directions.sizes["direction"] + self.arm * moved + self.table * tables


def in_order(directions: xr.Dataset) -> Places:
    """Places of directions in the order of measuring: by incidence angle and azimuth, along the arm and back again."""
    arm, plane = _arm(directions), _plane(directions)
    blocks = np.unique(np.stack([directions["theta_i"].values, plane], axis=1), axis=0)
    out: list[int] = []
    for turn, (theta_i, azimuth) in enumerate(blocks):
        at = np.flatnonzero((directions["theta_i"].values == theta_i) & (plane == azimuth))
        along = at[np.argsort(arm[at], kind="stable")]
        out += (along[::-1] if turn % 2 else along).tolist()
    return np.array(out, dtype=np.intp)


def not_worth_it(directions: xr.Dataset, design: Callable[[Places], tuple[Places, float]], cost: Cost) -> list[float]:
    """The incidence angles [deg] to leave out for the least variance times seconds.

    design: places of the directions that may be read -> places chosen and the variance that they leave. A variance
    falls as the inverse of the time spent, so that their product is what a second is worth. From all angles on, the one
    whose loss costs least is left out, as long as the product falls.
    """

    def product(angles: list[float]) -> float:
        places, variance = design(np.flatnonzero(np.isin(directions["theta_i"].values, angles)))
        some = directions.isel(direction=places)
        return variance * cost.seconds(some.isel(direction=in_order(some)))

    angles: list[float] = np.unique(directions["theta_i"].values).tolist()
    left_out: list[float] = []
    best = product(angles)
    while len(angles) > 1:
        trials = [(product([a for a in angles if a != angle]), angle) for angle in angles]
        least, angle = min(trials)
        if not least < best:
            break
        best = least
        angles.remove(angle)
        left_out.append(angle)
    return sorted(left_out)


def _plane(directions: xr.Dataset) -> Values:
    """The azimuth [deg] of the plane in which the arm moves; 0 for the plane of incidence."""
    azimuth = directions["phi"].values % 180.0
    return np.where(directions["theta_r"].values == 0, 0.0, azimuth)


def _arm(directions: xr.Dataset) -> Values:
    return signed_theta_r(directions)
