"""A correction of a fit: learned from the residuals of some directions, and given at any others."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.completion import prior
from gonio.completion.coordinates import coordinates
from gonio.completion.process import Several, Where
from gonio.measured import dataset

Values = npt.NDArray[np.float64]

FEWEST = 10  # positive values that a correction is learned from
LEVEL = 1.959963984540054  # standard deviations of a normal distribution on each side of 95 %
BEFORE, GROWTH = 20.0, 2.5  # deg, and what the uncertainty grows by over so much: chosen on the 19 shared scans
FARTHEST = 2.0  # times BEFORE, where it has grown most


@dataclass(frozen=True, kw_only=True)
class Correction:
    """How a correction is learned.

    prior: with the residuals of public materials. without: names of materials that are left out of them, as a scan of
    one of them must be judged without it.
    """

    prior: bool = True
    without: Sequence[str] = ()

    def __post_init__(self) -> None:
        prior.refuse_unknown(self.without)
        if self.without and not self.prior:
            raise ValueError(
                "a material is left out of a prior that is not used: leave out one of --without, --no-prior"
            )

    def learned(self, points: xr.Dataset, modelled: Values) -> "Learned":
        """From the values of a flat scan and what a model gives for them (points,).

        Values that are not positive have no logarithm and are left out.
        Raises ValueError where fewer than FEWEST are left.
        """
        measured = points["brdf"].values.astype(float)
        used = np.flatnonzero((measured > 0) & (modelled > 0) & np.isfinite(modelled))
        if len(used) < FEWEST:
            raise ValueError(
                f"a correction is learned from at least {FEWEST} values above zero, and the scan has {len(used)}: "
                "use the model alone"
            )
        points = points.isel(direction=used)
        names = tuple(name for name in dataset.SETS if name in points.coords)
        sets, labels = _numbered(points, names)
        curves, _ = _numbered(points, ("theta_i", *names))
        where = Where(coordinates(points), sets, curves, self._materials(points))
        residual = np.log10(measured[used] / modelled[used])
        return Learned(self, Several.learned(where, residual), names, labels, _steepness(points).max(), len(used))

    def _materials(self, points: xr.Dataset) -> Values:
        if not self.prior:
            return np.zeros((points.sizes["direction"], 0))
        return prior.residuals(points, self.without)


@dataclass(frozen=True)
class Learned:
    """A correction: its process, the sets that it knows, the steepest pair of directions, and of how many values."""

    how: Correction
    process: Several
    names: tuple[str, ...]
    labels: tuple[tuple[str, ...], ...]
    steepest: float
    points: int

    def at(self, points: xr.Dataset) -> tuple[Values, Values, Values]:
        """Lg of the surface over the model (n,), its standard uncertainty, and how much of it was learned, 0 to 1.

        The uncertainty is of one measured value there: that of the correction, and the noise of the scan with what was
        wrong in single curves, both times `beyond`.
        Raises ValueError for a set that was not learned.
        """
        mean, deviation, before = self.process.at(self._where(points))
        learned = 1 - (deviation / np.maximum(before, np.finfo(float).tiny)) ** 2
        return mean, np.hypot(deviation, self.process.noise) * self.beyond(points), learned

    def shift(self, points: xr.Dataset) -> Values:
        """The first of these alone (n,), which takes a fraction of the time."""
        return self.process.mean_at(self._where(points))

    def _where(self, points: xr.Dataset) -> Where:
        sets = self._sets(points)
        curves = np.full(len(sets), -1, dtype=np.intp)
        return Where(coordinates(points), sets, curves, self.how._materials(points))

    def beyond(self, points: xr.Dataset) -> Values:
        """By how much the uncertainty is larger (n,) than the process says, 1 or more.

        Models go wrong where source and detector are both low. How low a pair is, is the smaller of theta_i and
        theta_r, which exchange leaves alone. The factor is 1 up to 20 deg below the lowest pair of the scan, 3.5 at
        that, and 6 from 20 deg beyond it on.
        """
        part: Values = (_steepness(points) - self.steepest + BEFORE) / BEFORE
        return 1 + GROWTH * np.clip(part, 0.0, FARTHEST)

    def _sets(self, points: xr.Dataset) -> npt.NDArray[np.intp]:
        for k, name in enumerate(self.names):
            if name in points.coords:
                continue
            value, *others = {label[k] for label in self.labels}
            if others:
                raise ValueError(f"the scan has several {name}, and the directions have no {name}: add it")
            points = points.assign_coords({name: ("direction", np.full(points.sizes["direction"], value))})
        own, labels = _numbered(points, self.names)
        if unknown := sorted(set(labels) - set(self.labels)):
            have = ", ".join(" ".join(label) for label in self.labels)
            raise ValueError(f"the scan has no {' '.join(unknown[0])}: it has {have}")
        place = np.array([self.labels.index(label) for label in labels], dtype=np.intp)
        return np.asarray(place[own])


def _numbered(points: xr.Dataset, names: Sequence[str]) -> tuple[npt.NDArray[np.intp], tuple[tuple[str, ...], ...]]:
    """For each direction the number of its combination of coordinates, and these as texts; one without coordinates."""
    count = points.sizes["direction"]
    texts = [[f"{v:.6g}" if isinstance(v, float) else str(v) for v in points[name].values.tolist()] for name in names]
    rows = list(zip(*texts, strict=True)) if texts else [()] * count
    labels = {label: k for k, label in enumerate(dict.fromkeys(rows))}
    return np.array([labels[row] for row in rows], dtype=np.intp), tuple(labels)


def _steepness(points: xr.Dataset) -> Values:
    return np.minimum(points["theta_i"].values, points["theta_r"].values).astype(float)


def holds(points: xr.Dataset, lg_predicted: Values, uncertainty: Values) -> npt.NDArray[np.bool_]:
    """Whether the 95 % interval of lg of a value (n,) holds the measured one, which must be positive."""
    return np.asarray(np.abs(np.log10(points["brdf"].values) - lg_predicted) <= LEVEL * uncertainty)


RELATIVE = math.log(10)  # standard uncertainty of a value, as a part of it, over that of its lg
