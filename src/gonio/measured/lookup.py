"""Values at the very directions that were measured."""

from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.dataset import flatten
from gonio.measured.interpolation import Targets, targets_of

Values = npt.NDArray[np.float64]
GRID = 1e-7  # deg; directions that agree to this are the same


class Measured:
    """The values at the very directions that were measured; repeats are averaged."""

    def __init__(self, part: xr.Dataset) -> None:
        self.flat = flatten(part)
        self.turned = "phi_i" in self.flat.coords
        keys = self._keys(targets_of(self.flat))
        self.distinct, group = np.unique(keys, return_inverse=True)
        self.group, self.counts = group.ravel(), np.bincount(group.ravel())

    def _keys(self, targets: Targets) -> npt.NDArray[Any]:
        """One comparable key a direction; azimuths mean nothing at the normal."""
        phi = np.where((targets.theta_i < GRID) | (targets.theta_r < GRID), 0.0, targets.phi % 360.0)
        columns = [
            targets.theta_i,
            targets.theta_r,
            phi % (360.0 - GRID / 2),
            *([targets.phi_i] if self.turned else []),
        ]
        rounded = np.ascontiguousarray(np.round(np.column_stack(columns) / GRID).astype(np.int64))
        return rounded.view([("", np.int64)] * rounded.shape[1]).ravel()

    def at(self, wanted: Targets, name: str) -> tuple[Values, npt.NDArray[np.bool_]]:
        """Values at the directions wanted, NaN and False where none was measured."""
        out = np.full(len(wanted), np.nan)
        keys = self._keys(wanted)
        place = np.minimum(np.searchsorted(self.distinct, keys), len(self.distinct) - 1)
        exact = self.distinct[place] == keys if len(self.distinct) else np.zeros(len(wanted), dtype=bool)
        mean = np.bincount(self.group, self.flat[name].values.astype(float)) / self.counts
        out[exact] = mean[place[exact]]
        return out, exact
