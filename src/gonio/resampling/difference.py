"""Two sets of data at common directions: how far they are apart, weighted by solid angle."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.measured.dataset import ANGLES, DIRECTIONS, SETS
from gonio.measured.solid_angle import solid_angles
from gonio.resampling.resample import MEASURED, Filling, is_on, parts, resample

Values = npt.NDArray[np.float64]
STEEP = 85.0  # deg


@dataclass(frozen=True)
class Difference:
    """One set of data against a reference, at the reference's directions.

    points: the reference's values that both have, flat; with `other`, the other's values there, and `exact`, whether
        the other was measured at that very direction rather than interpolated.
    missing: the reference's values where the other has none.
    """

    points: xr.Dataset
    missing: int

    @property
    def error(self) -> Values:
        """The other less the reference, at every common direction."""
        found: Values = self.points["other"].values - self.points["brdf"].values
        return found

    @property
    def weights(self) -> Values:
        found: Values = self.points["solid_angle"].values
        return found

    @property
    def rms(self) -> float:
        """Relative: the root of the solid-angle-weighted mean squared difference over that of the reference."""
        return self._rms(np.ones(self.count, dtype=bool))

    @property
    def rms_steep(self) -> float:
        """The same of directions within STEEP of the normal: towards the horizon a BRDF may grow without bound."""
        return self._rms((self.points["theta_i"].values <= STEEP) & (self.points["theta_r"].values <= STEEP))

    def _rms(self, rows: npt.NDArray[np.bool_]) -> float:
        weights, reference = self.weights[rows], self.points["brdf"].values[rows]
        total = float(np.sum(weights * reference**2))
        return math.sqrt(float(np.sum(weights * self.error[rows] ** 2)) / total) if total else math.nan

    @property
    def bias(self) -> float:
        """The solid-angle-weighted sum of differences over that of the reference."""
        total = float(np.sum(self.weights * self.points["brdf"].values))
        return float(np.sum(self.weights * self.error)) / total if total else math.nan

    @property
    def largest(self) -> float:
        """The largest difference relative to the reference's own value, over values that are not zero."""
        ratio = self._ratio
        return float(ratio.max()) if np.isfinite(ratio).any() else math.nan

    @property
    def where(self) -> dict[str, float]:
        """The direction of the largest relative difference."""
        row = int(np.argmax(self._ratio)) if self.points.sizes["direction"] else -1
        return {a: float(self.points[a].values[row]) for a in ANGLES} if row >= 0 else {}

    @property
    def _ratio(self) -> Values:
        reference = np.abs(self.points["brdf"].values)
        with np.errstate(divide="ignore", invalid="ignore"):
            found: Values = np.where(reference > 0, np.abs(self.error) / reference, -np.inf)
        return found

    @property
    def count(self) -> int:
        return int(self.points.sizes["direction"])

    @property
    def exact(self) -> int:
        return int(self.points["exact"].values.sum())


def difference(other: xr.Dataset, reference: xr.Dataset) -> Difference:
    """`other` at the directions of `reference`: as measured where it has them, else interpolated.

    Sets are matched by their coordinates (wavelength, channel, ..); one that only one of the two names is no bar where
    both hold a single set. Raises ValueError for units that differ, and for sets that do not match.
    """
    if (mine := dataset.unit(reference)) != (theirs := dataset.unit(other)):
        raise ValueError(f"one is in {mine} and the other in {theirs}: relative data cannot be told from absolute ones")
    if _on_one_grid(other, reference):
        here = other["brdf"].transpose(*reference["brdf"].dims).values
        both = reference.assign(other=(reference["brdf"].dims, here), exact=(reference["brdf"].dims, np.isfinite(here)))
        joined = _weighed(dataset.points(both))
    else:
        joined = _at_its_directions(other, _weighed(dataset.points(reference)))
    known = np.isfinite(joined["other"].values)
    return Difference(joined.isel(direction=np.flatnonzero(known)), int((~known).sum()))


def _on_one_grid(other: xr.Dataset, reference: xr.Dataset) -> bool:
    """Whether both are dense on the same nodes and hold the same sets, so that nothing need be looked up."""
    dims = set(reference["brdf"].dims)
    if "direction" in dims or dims != set(other["brdf"].dims) or "mask" in other or not is_on(other, reference):
        return False
    return all(np.array_equal(other[n].values, reference[n].values) for n in dims if n in SETS)


def _weighed(flat: xr.Dataset) -> xr.Dataset:
    if not flat.sizes["direction"]:
        raise ValueError("the reference holds no value in use")
    return flat.assign(solid_angle=("direction", solid_angles(flat)))


def _at_its_directions(other: xr.Dataset, flat: xr.Dataset) -> xr.Dataset:
    """The flat reference with the other's values beside its own, set by set."""
    candidates = [part for _, part in parts(other)]
    columns = []
    for _, part in parts(flat):
        directions = part.drop_vars([str(n) for n in part.variables if n not in DIRECTIONS])
        found = resample(_counterpart(part, candidates), directions, filling=Filling())
        exact = found["origin"].values == MEASURED
        columns.append(part.assign(other=("direction", found["brdf"].values), exact=("direction", exact)))
    joined: xr.Dataset = xr.concat(columns, dim="direction", join="outer") if len(columns) > 1 else columns[0]
    return joined


def _counterpart(part: xr.Dataset, candidates: list[xr.Dataset]) -> xr.Dataset:
    """The one set that has the same wavelength, channel, .. as `part`, as far as both say."""
    mine = _labels(part)
    agreeing = [c for c in candidates if all(_same(mine[n], v) for n, v in _labels(c).items() if n in mine)]
    if len(agreeing) == 1:
        return agreeing[0]
    said = ", ".join(f"{n} {v}" for n, v in mine.items()) or "the only set"
    if not agreeing:
        raise ValueError(f"the other has no set like {said}: select the ones to compare with --select")
    raise ValueError(f"the other has {len(agreeing)} sets like {said}: select one with --select")


def _labels(part: xr.Dataset) -> dict[str, Any]:
    return {n: part[n].values.ravel()[0].item() for n in SETS if n in part.coords and part[n].size}


def _same(a: Any, b: Any) -> bool:
    both_numbers = isinstance(a, float | int) and isinstance(b, float | int)
    return math.isclose(a, b, rel_tol=1e-6) if both_numbers else str(a) == str(b)
