"""Values at the very directions that were measured, found by a key of each direction.

Interpolation averages repeated readings of a direction, and over triangles it meets a measured value only up to
rounding. Looking directions up first makes a scan that is resampled onto its own directions come back to the last bit.

A direction's key is its angles in whole steps of GRID. Keys are sorted once (np.unique), and every wanted direction is
found among them by binary search. Nothing is interpolated here: resample.py asks for that where no direction agrees.
"""

from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.dataset import flatten
from gonio.resampling.interpolation import Targets, targets_of

Values = npt.NDArray[np.float64]
GRID = 1e-7  # deg; angles that round to the same multiple of this are the same


class Measured:
    """The values of one set at the very directions that were measured.

    Repeats of a direction are averaged, unless as many are wanted: then each is its own, in the order of the scan. At
    the normal all azimuths are one direction: what was not measured at the azimuth wanted is the mean of the others.

    flat: the set's finite values on one dimension; a missing value counts as not measured.
    turned: whether the scan states phi_i, and so whether phi_i belongs to a key.
    distinct: the distinct keys (m,), ascending.
    group: for each flat value, the place of its key in `distinct` (n,).
    counts: how often each distinct direction was measured (m,).
    order, first: the flat rows sorted by key, those of one key in the order of the scan (n,), and where in them each
        key begins (m,).
    """

    def __init__(self, part: xr.Dataset) -> None:
        flat = flatten(part)
        self.flat = flat.isel(direction=np.flatnonzero(np.isfinite(flat["brdf"].values)))
        self.turned = "phi_i" in self.flat.coords
        self.distinct, group = np.unique(self._keys(targets_of(self.flat)), return_inverse=True)
        self.group, self.counts = group.ravel(), np.bincount(group.ravel())
        self.order = np.argsort(self.group, kind="stable")  # stable: repeats stay in the order of the scan
        self.first = np.cumsum(self.counts) - self.counts

    def _keys(self, targets: Targets) -> npt.NDArray[Any]:
        """One comparable key a direction.

        The integers of a direction are seen as one structured element, which NumPy sorts and compares field by field.
        phi_i takes part only where the scan states it: an isotropic surface has the same value at every turn.
        """
        turns = [targets.phi, targets.phi_i] if self.turned else [targets.phi]
        # Half a step is added before the modulo and taken off after it, so that 360 deg less rounding becomes 0, too.
        columns = [targets.theta_i, targets.theta_r, *((t + GRID / 2) % 360.0 - GRID / 2 for t in turns)]
        rounded = np.ascontiguousarray(np.round(np.column_stack(columns) / GRID).astype(np.int64))
        return rounded.view([("", np.int64)] * rounded.shape[1]).ravel()

    def at(self, wanted: Targets, name: str) -> tuple[Values, npt.NDArray[np.bool_]]:
        """Values (n,) of the variable `name` at n wanted directions, and which of these were measured.

        NaN and False where a direction was not measured, everywhere if the set has no finite value.
        """
        out = np.full(len(wanted), np.nan)
        if not len(self.distinct):
            return out, np.zeros(len(wanted), dtype=bool)
        keys = self._keys(wanted)
        # A key beyond the last has no place among them: it is compared with the last one, and differs from it.
        place = np.minimum(np.searchsorted(self.distinct, keys), len(self.distinct) - 1)
        exact = self.distinct[place] == keys
        values = self.flat[name].values.astype(float)
        place = place[exact]
        # The rank of a wanted direction is how many before it ask for the same key: the k-th gets the k-th repeat.
        requests = np.bincount(place, minlength=len(self.distinct))
        rank = np.empty(len(place), dtype=np.intp)
        by_place = np.argsort(place, kind="stable")
        rank[by_place] = np.arange(len(place)) - np.repeat(np.cumsum(requests) - requests, requests)
        one_each = requests[place] == self.counts[place]
        single = values[self.order[self.first[place] + np.where(one_each, rank, 0)]]
        mean = (np.bincount(self.group, values) / self.counts)[place]
        out[exact] = np.where(one_each | (self.counts[place] == 1), single, mean)
        at_normal = np.flatnonzero(~exact & (wanted.theta_r < GRID))
        if len(at_normal):
            out[at_normal] = self._along_the_normal(wanted.part(at_normal), values)
            exact[at_normal] = np.isfinite(out[at_normal])
        return out, exact

    def _along_the_normal(self, wanted: Targets, values: Values) -> Values:
        """Means over all azimuths of theta_r = 0, NaN where none was measured."""
        measured = targets_of(self.flat)
        rows = np.flatnonzero(measured.theta_r < GRID)
        out = np.full(len(wanted), np.nan)
        if len(rows):
            # With phi and theta_r set to 0 on both sides, keys differ in the incidence alone.
            zeros = np.zeros(len(rows))
            keys = self._keys(Targets(measured.theta_i[rows], zeros, zeros, measured.phi_i[rows]))
            distinct, group = np.unique(keys, return_inverse=True)
            mean = np.bincount(group.ravel(), values[rows]) / np.bincount(group.ravel())
            zero = np.zeros(len(wanted))
            wanted_keys = self._keys(Targets(wanted.theta_i, zero, zero, wanted.phi_i))
            place = np.minimum(np.searchsorted(distinct, wanted_keys), len(distinct) - 1)
            exact = distinct[place] == wanted_keys
            out[exact] = mean[place[exact]]
        return out
