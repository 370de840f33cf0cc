"""What a goniometer takes in at once: the finite solid angles of its source and detector, folded into a model.

With radiance L_i from the source's cone Omega_i, the detector's cone Omega_r gets the power

    P = A L_i  integral over Omega_r, Omega_i of  f cos(theta_i) cos(theta_r) dw_i dw_r

and the reduction, which knows the directions at the centres alone, makes of it

    P / (A L_i Omega_i cos(theta_i) Omega_r cos(theta_r)),

the mean of f cos(theta_i) cos(theta_r) over both cones, over the same cosines at their centres. The mean of a weighted
sum is the weighted sum of the means: a model stays linear in its weights.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, ClassVar

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.geometry import GRAZING, Geometry
from gonio.measured import dataset
from gonio.measured.polarimetry.ratio import RatioModel, refuse_scalar, whole
from gonio.measured.polarisers import Analysers, analysed, names_degrees
from gonio.model import Model
from gonio.optics.quadrature import gauss_legendre
from gonio.options import Option, Panel

Values = npt.NDArray[np.float64]
Vector = tuple[Values, Values, Values]
WIDEST = 30.0  # deg: no goniometer's optics take in more, and a mistyped angle should not cost an hour
FINEST = 0.01  # deg: a cone of one degree takes 20 000 directions
FEWEST = 2  # rings of directions in a cone: 12 directions, exact for polynomials up to the third degree
BLOCK = 50_000  # directions that are evaluated at once: more cost memory and no less time


@dataclass(frozen=True)
class Instrument:
    """The cones of directions that the source fills and the detector sees, as from a point of the surface.

    Every direction inside a cone counts alike; zero is a single direction, which is what a fit assumes of a scan
    unless told otherwise. Below the horizon there is no light, and the cone stays whole: what the surface hides is
    lost to a measurement too.

    Parameters
    ----------
    source_half_angle, detector_half_angle : float
        Half-angles [deg] of the cones, 0 to 30.
    step : float
        About how far apart [deg] the directions are whose mean stands for a cone, 0.01 to 30. For a Gaussian lobe
        whose standard deviation in theta_r is one step the mean is good to 2e-2 of the peak, for one of two steps to
        5e-4.

    Raises
    ------
    ValueError
        A half-angle or the step is outside of these ranges.

    """

    PANEL: ClassVar = Panel.MODEL
    source_half_angle: Annotated[
        float,
        Option(
            "half-angle of the cone of light from the source, over which the model is averaged",
            metavar="DEG",
            lowest=0,
            highest=WIDEST,
        ),
    ] = 0.0
    detector_half_angle: Annotated[
        float,
        Option(
            "half-angle of the cone that the detector takes in, over which the model is averaged",
            metavar="DEG",
            lowest=0,
            highest=WIDEST,
        ),
    ] = 0.0
    step: Annotated[
        float,
        Option(
            "spacing of the directions by which a cone is averaged",
            flag="--cone-step",
            metavar="DEG",
            lowest=FINEST,
            highest=WIDEST,
        ),
    ] = 0.5

    def __post_init__(self) -> None:
        for name in ("source_half_angle", "detector_half_angle"):
            if not 0 <= getattr(self, name) <= WIDEST:
                raise ValueError(f"{name} is {getattr(self, name):g}: give degrees from 0 to {WIDEST:g}")
        if not FINEST <= self.step <= WIDEST:
            raise ValueError(f"step is {self.step:g}: give degrees from {FINEST:g} to {WIDEST:g}")

    def __bool__(self) -> bool:
        """Whether it takes in more than one direction."""
        return max(self.source_half_angle, self.detector_half_angle) > 0

    def finer(self) -> "Instrument":
        """The same instrument by at least twice the rings, against which the mean of a fit can be tested."""
        widest = max(self.source_half_angle, self.detector_half_angle)
        return replace(self, step=max(min(self.step, widest / FEWEST or self.step) / 2, FINEST))


IDEAL = Instrument()


class Acceptance:
    """The directions that an instrument takes in about those of a scan, and the weight of each in what it reads.

    Raises ValueError where a direction lies on the horizon, because the reduction then divides by zero.
    """

    def __init__(self, instrument: Instrument, geometry: Geometry, analysed: Analysers | None = None) -> None:
        self._centre = geometry
        self._analysed = analysed  # what each reading takes of a Mueller matrix; None: of the BRDF alone
        self._blocks: list[tuple[Geometry, Values]] = []
        if not instrument:
            return
        _refuse_horizon(geometry)
        source = cone(geometry[:3], instrument.source_half_angle, instrument.step, turn=0.5)
        detector = cone(geometry[3:], instrument.detector_half_angle, instrument.step)
        pairs = np.stack(np.meshgrid(range(len(source[1])), range(len(detector[1])), indexing="ij"), -1).reshape(-1, 2)
        several = max(BLOCK // max(geometry.z_i.size, 1), 1)
        for start in range(0, len(pairs), several):
            i, r = pairs[start : start + several].T
            seen = Geometry(*(c[i] for c in source[0]), *(c[r] for c in detector[0]))
            cosines = np.maximum(seen.z_i, 0) * np.maximum(seen.z_r, 0) / (geometry.z_i * geometry.z_r)
            self._blocks.append((seen, (source[1][i] * detector[1][r])[:, None] * cosines))

    @classmethod
    def of(cls, instrument: Instrument, points: xr.Dataset, model: Model | None = None) -> "Acceptance":
        """Of the directions of a flat scan, for a model; a Mueller one through the polarisers that it names.

        Raises ValueError for degrees of polarisation of a model that knows none.
        """
        geometry = dataset.geometry(points)
        if model is None or whole(model).polarised:
            return cls(instrument, geometry, analysed(points))
        if names_degrees(points):
            refuse_scalar(model)
        return cls(instrument, geometry)

    @property
    def through_polarisers(self) -> bool:
        """Whether the readings take more of a Mueller matrix than its element 00."""
        return self._analysed is not None

    @property
    def of_degrees(self) -> bool:
        """Whether the readings are degrees of polarisation, which are no sum of terms."""
        return self._analysed is not None and self._analysed.parts is not None

    def basis(self, model: Model, shape: Mapping[str, Any]) -> dict[str, Values]:
        """Every term by weight as the instrument reads it, for shape parameters as `Model.basis` takes them.

        Raises ValueError for degrees of polarisation, unless the model is a RatioModel, whose one term they are.
        """
        if isinstance(model, RatioModel):
            return {model.scale: self.brdf(model.of, model.values(shape))}
        if self.of_degrees:
            raise ValueError("a degree of polarisation is a ratio, and no sum of terms: ask for the whole model")
        if not self._blocks:
            return self._terms(model, self._centre, shape)
        found = [(self._terms(model, seen, _beside_nodes(shape)), weights) for seen, weights in self._blocks]
        return {name: np.sum([_mean(basis[name], weights) for basis, weights in found], axis=0) for name in model.terms}

    def _terms(self, model: Model, directions: Geometry, shape: Mapping[str, Any]) -> dict[str, Values]:
        """Every term by weight: of a Mueller model what the polarisers let through, else the BRDF."""
        if self._analysed is None or not model.polarised:
            return model.basis(directions, shape)
        matrices = model.mueller_basis(directions, shape)
        return {name: _seen(matrix, self._analysed.intensity) for name, matrix in matrices.items()}

    def brdf(self, model: Model, values: Mapping[str, Any]) -> Values:
        """The BRDF as the instrument reads it, for weights and shape parameters as a Model takes them.

        Of degrees of polarisation the ratio of what it reads; 0 where there is no light, and so none that is polarised.
        Raises ValueError for degrees of polarisation of a model that knows none.
        """
        if self._analysed is not None and self._analysed.parts is not None:
            return self._degree(model, values, self._analysed)
        analysers = self._analysed
        if analysers is None or not model.polarised:
            return self._averaged(lambda g, v: np.asarray(model(g, v)), values)
        return self._averaged(lambda g, v: _seen(model.mueller(g, v), analysers.intensity), values)

    def _degree(self, model: Model, values: Mapping[str, Any], analysers: Analysers) -> Values:
        assert analysers.parts is not None
        assert analysers.signed is not None
        refuse_scalar(model)
        several = np.stack([analysers.intensity, *analysers.parts])  # (3, points, 4, 4)
        i, q, u = self._averaged(lambda g, v: np.stack([_seen(model.mueller(g, v), w) for w in several]), values)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(np.where(i > 0, np.where(analysers.signed, q, np.hypot(q, u)) / i, 0.0))

    def _averaged(self, read: Callable[[Geometry, Mapping[str, Any]], Values], values: Mapping[str, Any]) -> Values:
        """What is read at the centres, or its mean over the cones."""
        if not self._blocks:
            return read(self._centre, values)
        found = [_mean(read(seen, _beside_nodes(values)), weights) for seen, weights in self._blocks]
        return np.asarray(np.sum(found, axis=0))


def _seen(matrix: Any, weight: Values) -> Values:
    """What is read of Mueller matrices (..., points, 4, 4) with the weight (points, 4, 4) of each element."""
    seen: Values = np.einsum("...nij,nij->...n", matrix, weight)
    return seen


def _beside_nodes(values: Mapping[str, Any]) -> dict[str, Any]:
    """Values (..., n) of the directions of a scan, shaped to broadcast against the nodes about each (nodes, n)."""
    return {name: np.asarray(v)[..., None, :] if np.ndim(v) else v for name, v in values.items()}


def _mean(values: Values, weights: Values) -> Values:
    return np.einsum("...kn,kn->...n", values, weights)


def cone(centre: tuple[Any, ...], half_angle: float, step: float, turn: float = 0.0) -> tuple[Vector, Values]:
    """Directions (nodes, n) in a cone about each of n unit vectors, and their weights (nodes,), whose sum is 1.

    Gauss-Legendre in the solid angle times even steps of azimuth, exact for polynomials of 4 rings - 1 in the tangent
    plane. `turn`: of a step, so that the steps of two cones do not coincide.
    """
    x, y, z = (np.asarray(c, dtype=float)[None, :] for c in centre)
    if half_angle == 0:
        return (x, y, z), np.ones(1)
    rings = max(FEWEST, int(np.ceil(half_angle / step)))
    points, portions = gauss_legendre(rings)
    inside = (points + 1) / 2  # part of the solid angle inside each ring
    steps = np.ceil(4 * rings * np.sqrt(inside)).astype(int)
    azimuth = np.concatenate([(np.arange(n) + turn) * (2 * np.pi / n) for n in steps])[:, None]
    lost = np.repeat(inside, steps)[:, None] * 2 * np.sin(np.radians(half_angle) / 2) ** 2
    forward, sideways = 1 - lost, np.sqrt(lost * (2 - lost))
    a, b = sideways * np.cos(azimuth), sideways * np.sin(azimuth)
    # tangent vectors without a pole (duff2017)
    sign = np.where(z < 0, -1.0, 1.0)
    k = -1 / (sign + z)
    nodes = (
        forward * x + a * (1 + sign * x * x * k) + b * (x * y * k),
        forward * y + a * (sign * x * y * k) + b * (sign + y * y * k),
        forward * z - a * sign * x - b * y,
    )
    return nodes, np.repeat(portions / 2 / steps, steps)


def _refuse_horizon(geometry: Geometry) -> None:
    grazing = (geometry.z_i < GRAZING) | (geometry.z_r < GRAZING)
    if grazing.any():
        raise ValueError(
            f"{int(grazing.sum())} directions lie on the horizon, where a goniometer divides by zero: "
            "mask or delete the values at 90 deg before an instrument is folded in"
        )
