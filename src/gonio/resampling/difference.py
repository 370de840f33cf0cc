"""Two sets of data at common directions: how much they differ, weighted by solid angle.

With g the other's values and f the reference's at the same directions, and W the solid angle that each direction of
the reference stands for (solid_angle.py),

    rms = sqrt(sum W (g - f)^2 / sum W f^2),    bias = sum W (g - f) / sum W f,    largest = max |g - f| / |f|.

Weights by solid angle make these numbers integrals over the hemisphere: many directions close together, as about a
lobe, count no more than the few that cover the same angle elsewhere. The other is brought to the reference's directions
by resample.py, so an error includes that of interpolation; the reference is never interpolated. Uncertainties take no
part: whether a difference is significant is not said.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.measured.dataset import ANGLES, DIRECTIONS, SETS
from gonio.resampling.resample import MEASURED, Filling, is_on, resample
from gonio.resampling.solid_angle import solid_angles
from gonio.resampling.sources import sets_of

Values = npt.NDArray[np.float64]
FLOOR = 0.1  # of the least positive reference: what another value below it counts as, in a logarithm
STEEP = 85.0  # deg; beyond it from the normal a direction does not count for `rms_steep`


@dataclass(frozen=True)
class Difference:
    """One set of data against a reference, at the reference's directions.

    points: the reference's values that both have, flat; with `other`, the other's values there, `exact`, whether the
        other was measured at that very direction rather than interpolated, and `solid_angle` [sr].
    missing: how many of the reference's values the other has none for.
    """

    points: xr.Dataset
    missing: int

    @property
    def error(self) -> Values:
        """The other less the reference, at every common direction (n,), in the unit of both."""
        error: Values = self.points["other"].values - self.points["brdf"].values
        return error

    @property
    def weights(self) -> Values:
        """The solid angle [sr] that each common direction stands for (n,)."""
        weights: Values = self.points["solid_angle"].values
        return weights

    @property
    def rms(self) -> float:
        """Relative: the root of the solid-angle-weighted mean squared difference over that of the reference.

        NaN where the reference is zero everywhere or nothing is in common; so are the bias and the largest.
        """
        return self._rms(np.ones(self.count, dtype=bool))

    @property
    def rms_steep(self) -> float:
        """The same of directions within STEEP of the normal: towards the horizon a BRDF may grow without bound.

        A detector reads f cos(theta_r): divided by a small cosine, its noise grows as well.
        """
        return self._rms((self.points["theta_i"].values <= STEEP) & (self.points["theta_r"].values <= STEEP))

    def _rms(self, rows: npt.NDArray[np.bool_]) -> float:
        weights = self.weights[rows]
        reference, error = _of_order_one(self.points["brdf"].values[rows], self.error[rows])
        total = float(np.sum(weights * reference**2))
        return math.sqrt(float(np.sum(weights * error**2)) / total) if total else math.nan

    @property
    def bias(self) -> float:
        """The solid-angle-weighted sum of differences over that of the reference: positive if the other is higher."""
        reference, error = _of_order_one(self.points["brdf"].values, self.error)
        total = float(np.sum(self.weights * reference))
        return float(np.sum(self.weights * error)) / total if total else math.nan

    @property
    def largest(self) -> float:
        """The largest difference relative to the reference's own value, over values that are not zero."""
        ratio = self._ratio
        return float(ratio.max()) if np.isfinite(ratio).any() else math.nan

    @property
    def log10_rmse(self) -> float:
        """The rms difference of decimal logarithms, as `log10_rmse` takes it: every decade counts alike."""
        reference = self.points["brdf"].values
        return log10_rmse(reference, self.points["other"].values, least_logarithm(reference))

    @property
    def largest_absolute(self) -> float:
        """The largest difference (n,) in the unit of both, values that are zero in the reference included."""
        return float(np.abs(self.error).max()) if self.count else math.nan

    @property
    def where_absolute(self) -> dict[str, float]:
        """The direction of the largest difference, {} without a common direction [deg]."""
        row = int(np.argmax(np.abs(self.error))) if self.count else -1
        return {a: float(self.points[a].values[row]) for a in ANGLES} if row >= 0 else {}

    @property
    def without_ratio(self) -> int:
        """At how many directions the reference is zero and the other is not, so that no relative difference is."""
        return int(((self.points["brdf"].values == 0) & (self.error != 0)).sum())

    @property
    def where(self) -> dict[str, float]:
        """The direction of the largest relative difference, {} without a common direction [deg]."""
        row = int(np.argmax(self._ratio)) if self.points.sizes["direction"] else -1
        return {a: float(self.points[a].values[row]) for a in ANGLES} if row >= 0 else {}

    @property
    def _ratio(self) -> Values:
        """|g - f| / |f| (n,); minus infinity where the reference is zero, so that it is never the largest."""
        reference = np.abs(self.points["brdf"].values)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio: Values = np.where(reference > 0, np.abs(self.error) / reference, -np.inf)
        return ratio

    @property
    def count(self) -> int:
        """How many directions both have."""
        return int(self.points.sizes["direction"])

    @property
    def exact(self) -> int:
        """At how many of them the other was measured rather than interpolated."""
        return int(self.points["exact"].values.sum())


def least_logarithm(reference: Values) -> float:
    """The value below which another counts as this one in a logarithm; NaN without a positive reference."""
    positive = reference[reference > 0]
    return FLOOR * float(positive.min()) if positive.size else math.nan


def log10_rmse(reference: Values, other: Values, floor: float) -> float:
    """The rms of lg(other/reference) where the reference is positive, both taken as at least `floor`."""
    positive = reference > 0
    if not positive.any():
        return math.nan
    errors = np.log10(np.maximum(other[positive], floor) / np.maximum(reference[positive], floor))
    return float(np.sqrt(np.mean(errors**2)))


def _of_order_one(reference: Values, error: Values) -> tuple[Values, Values]:
    """Both over the same power of two, so that squares neither overflow nor vanish; ratios keep every bit."""
    largest = max(float(np.abs(reference).max(initial=0.0)), float(np.abs(error).max(initial=0.0)))
    exponent = -math.frexp(largest)[1] if math.isfinite(largest) else 0
    return np.ldexp(reference, exponent), np.ldexp(error, exponent)


def difference(other: xr.Dataset, reference: xr.Dataset) -> Difference:
    """Compare two scans: `other` at the directions of `reference`, as measured where it has them, else interpolated.

    Values of the reference that are masked or missing take no part. Sets are matched by the coordinates that both name
    (wavelength, channel, ..); a coordinate that only one of the two names is ignored, but for the mode: what names
    none is of reflection, and is compared with the reflection of what has both.

    Parameters
    ----------
    other, reference : xarray.Dataset
        The scans, in the same unit.

    Returns
    -------
    Difference
        The common `points` with both values, how many are `missing`, and the figures of the difference: `rms`, `bias`
        and more.

    Raises
    ------
    ValueError
        Units differ, a set of the reference has no match or several, reflection stands against transmission, or the
        reference has no value.

    """
    if (unit := dataset.unit(reference)) != (other_unit := dataset.unit(other)):
        raise ValueError(
            f"one is in {unit} and the other in {other_unit}: relative data cannot be compared with absolute ones"
        )
    other, reference = _of_one_mode(other, reference), _of_one_mode(reference, other)
    if _on_one_grid(other, reference):
        dims = reference["brdf"].dims
        values = other["brdf"].transpose(*dims).values
        # Beside the reference's values, so that what `points` drops of these it drops of both.
        both = reference.assign(other=(dims, values), exact=(dims, np.isfinite(values)))
        joined = _with_solid_angles(dataset.points(both))
    else:
        joined = _with_other(other, _with_solid_angles(dataset.points(reference)))
    # Solid angles are those of all the reference's directions: what the other lacks does not add to its neighbours.
    finite = np.isfinite(joined["other"].values)
    return Difference(joined.isel(direction=np.flatnonzero(finite)), int((~finite).sum()))


def _of_one_mode(scan: xr.Dataset, against: xr.Dataset) -> xr.Dataset:
    """The reflection of a scan that says its mode, where the one that it is compared with says none."""
    if "mode" not in scan.coords or "mode" in against.coords:
        return scan
    if "reflection" not in set(scan["mode"].values.ravel().tolist()):
        raise ValueError("one is of transmission, and the other says no mode, which is reflection")
    return dataset.select(scan, {"mode": "reflection"})


def _on_one_grid(other: xr.Dataset, reference: xr.Dataset) -> bool:
    """Whether both are dense on the same nodes and hold the same sets, so that nothing need be looked up.

    A lookup would average or exchange nodes that are one direction, and large tables are not looked up at all. A mask
    of the other is not seen here, so a scan with one is resampled, which makes masked values gaps.
    """
    dims = set(reference["brdf"].dims)
    if "direction" in dims or dims != set(other["brdf"].dims) or "mask" in other or not is_on(other, reference):
        return False
    return all(np.array_equal(other[n].values, reference[n].values) for n in dims if n in SETS)


def _with_solid_angles(flat: xr.Dataset) -> xr.Dataset:
    """The flat scan with the variable `solid_angle` [sr]; ValueError where it has no value."""
    if not flat.sizes["direction"]:
        raise ValueError("the reference holds no value in use")
    return flat.assign(solid_angle=("direction", solid_angles(flat)))


def _with_other(other: xr.Dataset, flat: xr.Dataset) -> xr.Dataset:
    """The flat reference with the other's values beside its own, set by set."""
    candidates = [part for _, part in sets_of(other)]
    with_others = []
    for _, part in sets_of(flat):
        directions = part.drop_vars([str(n) for n in part.variables if n not in DIRECTIONS])
        # Filling() fills nothing: with it, resample says which values were measured.
        resampled = resample(_counterpart(part, candidates), directions, filling=Filling())
        exact = resampled["origin"].values == MEASURED
        with_others.append(part.assign(other=("direction", resampled["brdf"].values), exact=("direction", exact)))
    joined: xr.Dataset = (
        xr.concat(with_others, dim="direction", join="outer") if len(with_others) > 1 else with_others[0]
    )
    return joined


def _counterpart(part: xr.Dataset, candidates: list[xr.Dataset]) -> xr.Dataset:
    """The one set that has the same wavelength, channel, .. as `part`, as far as both state them."""
    labels = _labels(part)
    matching = [c for c in candidates if all(_agree(labels[n], v) for n, v in _labels(c).items() if n in labels)]
    if len(matching) == 1:
        return matching[0]
    named = ", ".join(f"{n} {v}" for n, v in labels.items()) or "the only set of the reference"
    if not matching:
        raise ValueError(f"the other has no set that matches {named}: select the ones to compare with --select")
    raise ValueError(f"the other has {len(matching)} sets that match {named}: select one with --select")


def _labels(part: xr.Dataset) -> dict[str, Any]:
    """The coordinates of SETS that a single set states, each one value."""
    return {n: part[n].values.ravel()[0].item() for n in SETS if n in part.coords and part[n].size}


def _agree(a: Any, b: Any) -> bool:
    """Whether two labels are equal, numbers to 1e-6 of each other: a wavelength in single precision is off by 6e-8."""
    both_numbers = isinstance(a, float | int) and isinstance(b, float | int)
    return math.isclose(a, b, rel_tol=1e-6) if both_numbers else str(a) == str(b)
