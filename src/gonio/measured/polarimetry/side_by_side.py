"""The readings of one direction in several states of polarisation, side by side: one number of each state.

Repeats of a state at a direction are averaged. The uncertainty of such a mean is the scatter of its n values over
sqrt(n), or what the stated uncertainties give where that is more or n is 1. A systematic cause shifts all of them, so
its shifts are averaged with their signs.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.measured.causes import causes, with_causes
from gonio.measured.distinct import distinct, distinct_rows

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
POLARISATION = "polarisation"
DECIMALS = 6  # of a degree, to which equal directions agree


def labels_of(flat: xr.Dataset) -> tuple[list[str], Places]:
    """The distinct labels of polarisation of a flat scan, and each point's place among them."""
    labels, place = distinct(np.broadcast_to(flat[POLARISATION].values.astype(str), flat.sizes["direction"]))
    return labels.tolist(), place


@dataclass(frozen=True, eq=False)
class Readings:
    """The readings of a flat scan by direction and state.

    flat: the scan. rows: of each state the rows that count, and `at` the place of the direction of every row. first:
    the first row of each direction. whole: the directions that have a reading of every state. masked (whole,): the mask
    of each, 0 where a reading of every state is in use.
    """

    flat: xr.Dataset
    rows: Mapping[str, Places]
    at: Places
    first: Places
    whole: Places
    masked: npt.NDArray[np.int8]

    @classmethod
    def of(cls, flat: xr.Dataset, wanted: Collection[str], state: npt.NDArray[np.str_]) -> "Readings":
        """Of some states; state (points,): of each reading. Values that are missing (NaN) are no readings."""
        names = [n for n in (*dataset.DIRECTIONS, *dataset.SETS) if n in flat.coords and n != POLARISATION]
        columns = [flat[n].values for n in names]
        first, at = distinct_rows([np.round(c, DECIMALS) if c.dtype.kind == "f" else c for c in columns])
        order = np.argsort(first)  # of the scan
        at = np.argsort(order)[at]
        first = first[order]
        there = np.isfinite(flat["brdf"].values)
        mask = flat["mask"].values if "mask" in flat else np.zeros(len(at), dtype=np.int8)
        rows: dict[str, Places] = {}
        whole, masked = np.ones(len(first), dtype=bool), np.zeros(len(first), dtype=np.int8)
        for one in wanted:
            mine = there & (state == one)
            used = np.bincount(at[mine & (mask == 0)], minlength=len(first)) > 0
            rows[one] = np.flatnonzero(mine & ((mask == 0) | ~used[at]))  # masked ones where all are
            whole &= np.bincount(at[mine], minlength=len(first)) > 0
            np.maximum.at(masked, at[rows[one]], mask[rows[one]])
        places = np.flatnonzero(whole)
        return cls(flat, rows, at, first, places, masked[places])

    @property
    def lacking(self) -> int:
        """How many directions lack a state."""
        return len(self.first) - len(self.whole)

    @property
    def first_lacking(self) -> str:
        """The first of them in words."""
        row = self.first[np.setdiff1d(np.arange(len(self.first)), self.whole)[0]]
        return ", ".join(f"{self.flat[n].values[row]:g}" for n in dataset.DIRECTIONS if n in self.flat.coords)

    def value(self, state: str) -> Values:
        """The mean (whole,) of the readings of a state."""
        return self._mean(state, self.flat["brdf"].values)

    def uncertainty(self, state: str) -> Values:
        """The standard uncertainty (whole,) of that mean; NaN where neither scatter nor statement tells it."""
        rows, count = self.rows[state], self._count(state)
        at = self.at[rows]
        off = self.flat["brdf"].values[rows] - self._sums(state, self.flat["brdf"].values)[at] / count[at]
        known = np.full(len(count), np.nan)
        if "uncertainty" in self.flat:
            known = np.sqrt(np.bincount(at, self.flat["uncertainty"].values[rows] ** 2, len(count)))
        with np.errstate(invalid="ignore", divide="ignore"):
            scatter = np.sqrt(np.bincount(at, off**2, len(count)) / np.where(count > 1, (count - 1) * count, np.nan))
            return np.asarray(np.fmax(known / count, scatter)[self.whole])

    def shifts(self, state: str) -> dict[str, Values]:
        """The mean shift (whole,) of the readings of a state by every cause of systematic uncertainty."""
        return {name: self._mean(state, values) for name, values in causes(self.flat).items()}

    def scan(self, value: Values, uncertainty: Values, shifts: Mapping[str, Values], unit: str = "") -> xr.Dataset:
        """One value (whole,) for each direction that has every state, without its polarisation.

        unit: of the values where it is another than that of the readings.
        """
        attrs = dict(self.flat["brdf"].attrs) | ({"units": unit} if unit else {})
        kept = self.flat[["brdf"]].isel(direction=self.first[self.whole]).drop_vars(POLARISATION)
        out = kept.assign(brdf=("direction", value, attrs))
        if np.isfinite(uncertainty).any():
            out["uncertainty"] = ("direction", uncertainty, {"units": attrs.get("units", "1")})
        if self.masked.any():
            out["mask"] = ("direction", self.masked, self.flat["mask"].attrs)
        return with_causes(out, shifts)

    def _count(self, state: str) -> Places:
        return np.bincount(self.at[self.rows[state]], minlength=len(self.first))

    def _sums(self, state: str, column: Values) -> Values:
        rows = self.rows[state]
        return np.asarray(np.bincount(self.at[rows], column[rows], minlength=len(self.first)), dtype=float)

    def _mean(self, state: str, column: Values) -> Values:
        return np.asarray(self._sums(state, column)[self.whole] / self._count(state)[self.whole])
