"""Values at the very directions that were measured."""

from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.dataset import flatten
from gonio.resampling.interpolation import Targets, targets_of

Values = npt.NDArray[np.float64]
GRID = 1e-7  # deg; directions that agree to this are the same


class Measured:
    """The values of one set at the very directions that were measured.

    Repeats of a direction are averaged, unless as many are wanted: then each is its own, in the order of the scan. At
    the normal all azimuths are one direction: what was not measured at the azimuth wanted is the mean of the others.
    """

    def __init__(self, part: xr.Dataset) -> None:
        flat = flatten(part)
        self.flat = flat.isel(direction=np.flatnonzero(np.isfinite(flat["brdf"].values)))
        self.turned = "phi_i" in self.flat.coords
        self.distinct, group = np.unique(self._keys(targets_of(self.flat)), return_inverse=True)
        self.group, self.counts = group.ravel(), np.bincount(group.ravel())
        self.order = np.argsort(self.group, kind="stable")
        self.first = np.cumsum(self.counts) - self.counts

    def _keys(self, targets: Targets) -> npt.NDArray[Any]:
        """One comparable key a direction."""
        turns = [targets.phi, targets.phi_i] if self.turned else [targets.phi]
        columns = [targets.theta_i, targets.theta_r, *((t + GRID / 2) % 360.0 - GRID / 2 for t in turns)]
        rounded = np.ascontiguousarray(np.round(np.column_stack(columns) / GRID).astype(np.int64))
        return rounded.view([("", np.int64)] * rounded.shape[1]).ravel()

    def at(self, wanted: Targets, name: str) -> tuple[Values, npt.NDArray[np.bool_]]:
        """Values at the directions wanted, NaN and False where none was measured."""
        out = np.full(len(wanted), np.nan)
        if not len(self.distinct):
            return out, np.zeros(len(wanted), dtype=bool)
        keys = self._keys(wanted)
        place = np.minimum(np.searchsorted(self.distinct, keys), len(self.distinct) - 1)
        exact = self.distinct[place] == keys
        values = self.flat[name].values.astype(float)
        place = place[exact]
        asked = np.bincount(place, minlength=len(self.distinct))
        rank = np.empty(len(place), dtype=np.intp)
        by_place = np.argsort(place, kind="stable")
        rank[by_place] = np.arange(len(place)) - np.repeat(np.cumsum(asked) - asked, asked)
        own = asked[place] == self.counts[place]
        single = values[self.order[self.first[place] + np.where(own, rank, 0)]]
        mean = (np.bincount(self.group, values) / self.counts)[place]
        out[exact] = np.where(own | (self.counts[place] == 1), single, mean)
        beside = np.flatnonzero(~exact & (wanted.theta_r < GRID))
        if len(beside):
            out[beside] = self._along_the_normal(wanted.part(beside), values)
            exact[beside] = np.isfinite(out[beside])
        return out, exact

    def _along_the_normal(self, wanted: Targets, values: Values) -> Values:
        """Means over all azimuths of theta_r = 0, NaN where none was measured."""
        here = targets_of(self.flat)
        rows = np.flatnonzero(here.theta_r < GRID)
        out = np.full(len(wanted), np.nan)
        if len(rows):
            none = np.zeros(len(rows))
            keys = self._keys(Targets(here.theta_i[rows], none, none, here.phi_i[rows]))
            distinct, group = np.unique(keys, return_inverse=True)
            mean = np.bincount(group.ravel(), values[rows]) / np.bincount(group.ravel())
            zero = np.zeros(len(wanted))
            asked = self._keys(Targets(wanted.theta_i, zero, zero, wanted.phi_i))
            place = np.minimum(np.searchsorted(distinct, asked), len(distinct) - 1)
            found = distinct[place] == asked
            out[found] = mean[place[found]]
        return out
