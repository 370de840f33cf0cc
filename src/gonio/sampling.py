"""Reflected directions drawn in proportion to what a model reflects, and hemispherical reflectance by Monte Carlo.

Every weighted term is drawn by the sampler that it declares, or from a table of its own where it declares none; the
model is the mixture of them (importance sampling). The density is exactly that of the directions drawn, so that
f cos(theta_r)/density averages to the reflectance whatever the shape of the lobes.
"""

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from gonio.geometry import Geometry
from gonio.model import Model, Sampler, Term, declarations, sampler_of
from gonio.optics.sampling import COSINE

Values = npt.NDArray[np.float64]
Incidence = tuple[Values, Values, Values]

PILOT = 1_000  # directions from which the reflectance of a term is estimated
LEAST_SHARE = 0.01  # of the directions that every weighted term gets, because the estimate may be too low
DEFENSIVE = 0.05  # share of a table that is drawn by the cosine, so that no lobe is missed (owen2000)
COARSEST, FINEST = 3, 24  # halvings of the side of a table's square
SEEN = 18  # halvings up to which cells at the mirror direction and the beam are always split: finds lobes of 1e-5
NODES = 4  # a cell is evaluated at NODES x NODES directions
UNEVEN = 5e-4  # largest range over a cell, times its solid angle, as a share of the reflectance


@dataclass(frozen=True)
class Samples:
    """Reflected directions, their probability density [1/sr] and the BRDF there.

    Directions below the horizon are light that is lost: they count, with value and density 0.
    """

    geometry: Geometry
    density: Values
    value: Values

    @property
    def weights(self) -> Values:
        """Value times cos(theta_r) over density, whose mean estimates the reflectance; 0 for light that is lost."""
        lost = self.density == 0
        weights: Values = self.value * self.geometry.z_r / np.where(lost, 1.0, self.density)
        return np.where(lost, 0.0, weights)


@dataclass(frozen=True)
class Estimate:
    """A mean and the standard error of it."""

    value: float
    standard_error: float


# Only denominators overflow here: in the far tail of a steep distribution, which is 0 then.
@np.errstate(over="ignore")
def sample(
    model: Model, values: Mapping[str, float], theta_i: float, n: int, seed: int = 0, phi_i: float = 0.0
) -> Samples:
    """`n` reflected directions for one incidence at theta_i, phi_i [deg], by the terms that `values` give a weight.

    Raises ValueError for names that the model does not have, if no weight differs from 0, for incidence below the
    horizon, and for n < 1.
    """
    if n < 1:
        raise ValueError(f"n must be at least 1, not {n}")
    incidence = _incidence(theta_i, phi_i)
    mixture = _mixture(model, values, incidence)
    g = _towards(incidence, *mixture.draw(np.random.default_rng(seed), n))
    return Samples(g, np.where(g.below, 0.0, mixture.density(g)), np.asarray(model(g, values)))


@np.errstate(over="ignore")
def density(model: Model, values: Mapping[str, float], geometry: Geometry) -> Values:
    """Probability density [1/sr] with which `sample` draws the reflected directions of `geometry`.

    Raises ValueError as `sample` does.
    """
    light = np.stack(np.broadcast_arrays(*(np.asarray(c, dtype=float) for c in geometry[:3])))
    directions = np.stack(np.broadcast_arrays(light[2], *(np.asarray(c, dtype=float) for c in geometry[3:])))[1:]
    shape = directions.shape[1:]
    # One mixture for each distinct incidence. Rounded: one angle computed at two azimuths may differ in the last digit.
    flat = light.reshape(3, -1)
    _, first, group = np.unique(np.round(flat, 12), axis=1, return_index=True, return_inverse=True)
    group = np.broadcast_to(np.reshape(group, light.shape[1:]), shape)
    densities = np.zeros(shape)
    for k, (x, y, z) in enumerate(flat[:, first].T):
        if z <= 0:
            raise ValueError("the incident light is below the horizon")
        incidence = (np.array([x]), np.array([y]), np.array([z]))
        g = _towards(incidence, *directions[:, group == k])
        densities[group == k] = np.where(g.below, 0.0, _mixture(model, values, incidence).density(g))
    return densities


def hemispherical_reflectance(
    model: Model, values: Mapping[str, float], theta_i: float, n: int = 20_000, seed: int = 0
) -> Estimate:
    """Directional-hemispherical reflectance at theta_i [deg] by Monte Carlo, for lobes of any width.

    Raises ValueError as `sample` does, and for n < 2.
    """
    if n < 2:
        raise ValueError(f"a standard error needs n of at least 2, not {n}")
    weights = sample(model, values, theta_i, n, seed).weights
    return Estimate(float(np.mean(weights)), float(np.std(weights, ddof=1)) / math.sqrt(n))


class _Part(Protocol):
    """One term for one incidence."""

    def draw(self, u: Values, v: Values) -> Incidence:
        """Components of the directions drawn by the uniform numbers u and v."""

    def density(self, g: Geometry) -> Values:
        """Probability density [1/sr] of reflected directions."""


@dataclass(frozen=True)
class _Declared:
    """A term whose sampler is declared beside it."""

    sampler: Sampler
    shape: Mapping[str, Values]
    incidence: Incidence

    def draw(self, u: Values, v: Values) -> Incidence:
        return self.sampler.draw(*self.incidence, u, v, **self.shape)

    def density(self, g: Geometry) -> Values:
        return np.asarray(self.sampler.density(g, **self.shape))


@dataclass(frozen=True)
class _Table:
    """Cells of constant density, small where a term is uneven, with a share of the cosine law everywhere.

    The cells are squares in Lambert's equal-area map of the hemisphere, which has no singularity at the pole; their
    parts outside the unit disc are below the horizon. Cells are in the order of their `first` Morton number.
    """

    incidence: Incidence
    left: Values  # lower edge along the x axis of the map
    bottom: Values  # lower edge along the y axis
    side: Values
    first: npt.NDArray[np.int64]  # Morton number of the cell's first part on the finest level
    probability: Values

    def draw(self, u: Values, v: Values) -> Incidence:
        is_cosine = u < DEFENSIVE
        by_cosine = COSINE.draw(*self.incidence, np.where(is_cosine, u / DEFENSIVE, 0.0), v)
        end = np.cumsum(self.probability)
        cumulative = np.where(is_cosine, 0.0, (u - DEFENSIVE) / (1 - DEFENSIVE)) * end[-1]
        # Rounding may carry the last number past the end: it stays in the last cell that has a probability.
        cell = np.minimum(np.searchsorted(end, cumulative, side="right"), np.flatnonzero(self.probability)[-1])
        # The place of u within its cell's probability is uniform again, and serves as the second coordinate.
        fraction = np.clip(1 - (end[cell] - cumulative) / self.probability[cell], 0.0, 1.0)
        by_cell = _unmapped(self.left[cell] + self.side[cell] * fraction, self.bottom[cell] + self.side[cell] * v)
        x, y, z = (np.where(is_cosine, a, b) for a, b in zip(by_cosine, by_cell, strict=True))
        return x, y, z

    def density(self, g: Geometry) -> Values:
        reach = np.sqrt(1 + np.maximum(g.z_r, 0.0))
        x, y = g.x_r / reach, g.y_r / reach
        cells = 1 << FINEST  # along the square's side, on the finest level
        column, row = (np.clip((c + 1) / 2 * cells, 0, cells - 1).astype(np.int64) for c in (x, y))
        cell = np.searchsorted(self.first, _morton(column, row), side="right") - 1
        tabulated = self.probability[cell] / (2 * self.side[cell] ** 2)
        return (1 - DEFENSIVE) * tabulated + DEFENSIVE * np.asarray(COSINE.density(g))


@dataclass(frozen=True)
class _Mixture:
    """Terms that are drawn in shares, which add up to 1."""

    parts: tuple[_Part, ...]
    shares: Values

    def draw(self, random: np.random.Generator, n: int) -> Incidence:
        choice = random.choice(len(self.parts), size=n, p=self.shares)
        u, v = random.random((2, n))
        directions = np.empty((3, n))
        for k, part in enumerate(self.parts):
            rows = choice == k
            directions[:, rows] = part.draw(u[rows], v[rows])
        x, y, z = directions
        return x, y, z

    def density(self, g: Geometry) -> Values:
        densities = (share * part.density(g) for share, part in zip(self.shares, self.parts, strict=True))
        return np.asarray(sum(densities))


def _mixture(model: Model, values: Mapping[str, float], incidence: Incidence) -> _Mixture:
    """Every term that has a weight, in proportion to an estimate of the light that it reflects."""
    model(_towards(incidence, *incidence), values)  # raises the model's own errors for unknown names
    weighted = {w: abs(float(values[w])) for w in model.weights if float(values.get(w, 0.0)) != 0}
    if not weighted:
        raise ValueError(f"{model.name} reflects nothing: give at least one weight other than 0")
    parts, estimates = [], []
    for weight, size in weighted.items():
        term = model.terms[weight]
        shape = {k: float(values.get(k, p.default)) for k, p in declarations(term).items()}
        part = _part(term, shape, incidence)
        parts.append(part)
        estimates.append(size * _pilot_reflectance(term, shape, part, incidence) if len(weighted) > 1 else 1.0)
    return _Mixture(tuple(parts), _shares(np.array(estimates)))


def _part(term: Term, shape: Mapping[str, float], incidence: Incidence) -> _Part:
    """How a term is drawn."""
    sampler = sampler_of(term)
    if sampler is None:
        x, y, z = (float(c[0]) for c in incidence)
        return _table(term, tuple(shape.items()), (x, y, z))
    return _Declared(sampler, {k: np.asarray(v) for k, v in shape.items()}, incidence)


def _pilot_reflectance(term: Term, shape: Mapping[str, float], part: _Part, incidence: Incidence) -> float:
    """A rough estimate of the light that a term reflects, from PILOT directions."""
    g = _towards(incidence, *part.draw(*np.random.default_rng(0).random((2, PILOT))))
    value = _reflected(term, shape, g)
    return float(np.mean(value / np.where(value > 0, part.density(g), 1.0)))


def _shares(estimates: Values) -> Values:
    """Shares in proportion to the estimates, at least LEAST_SHARE before they are normalised; equal if all are 0."""
    total = estimates.sum()
    shares = estimates / total if total > 0 else np.full(len(estimates), 1 / len(estimates))
    shares = np.maximum(shares, LEAST_SHARE)
    return np.asarray(shares / shares.sum())


@functools.lru_cache(maxsize=16)
def _table(term: Term, items: tuple[tuple[str, float], ...], towards: tuple[float, float, float]) -> _Table:
    """Split the square that holds the hemisphere until no cell is uneven by more than UNEVEN of the reflectance.

    The latest tables are cached: one takes up to a second where the term is a series.
    """
    shape = dict(items)
    incidence: Incidence = (np.array([towards[0]]), np.array([towards[1]]), np.array([towards[2]]))
    x, y = _mapped(*incidence)
    marks = [(-x, -y), (x, y)]
    column, row = (np.ravel(c) for c in np.indices((1 << COARSEST,) * 2))
    leaves: list[tuple[Any, ...]] = []
    settled = 0.0
    for level in range(COARSEST, FINEST + 1):
        side = 2.0 / (1 << level)
        left, bottom = (np.asarray(c * side - 1, dtype=np.float64) for c in (column, row))
        mean, spread = _light(term, shape, incidence, left, bottom, side)
        area = 2 * side**2
        total = settled + float(mean.sum()) * area
        split = spread * area > UNEVEN * total
        if level < SEEN:
            split |= _near(marks, left, bottom, side)
        split &= level < FINEST
        final = ~split
        number = _morton(column[final], row[final]) << 2 * (FINEST - level)
        leaves.append((left[final], bottom[final], np.full(final.sum(), side), number, mean[final] * area))
        settled += float(mean[final].sum()) * area
        column, row = _quarters(column[split]), _quarters(row[split], lower=True)
        if not len(column):
            break
    left, bottom, sides, first, light = (np.concatenate(levels) for levels in zip(*leaves, strict=True))
    order = np.argsort(first)
    total_light = light.sum()
    probability = light / total_light if total_light > 0 else sides**2 / np.sum(sides**2)
    return _Table(incidence, left[order], bottom[order], sides[order], first[order], probability[order])


def _light(
    term: Term, shape: Mapping[str, float], incidence: Incidence, left: Values, bottom: Values, side: float
) -> tuple[Values, Values]:
    """Mean and range over each cell of the term times cos(theta_r) [1/sr], from NODES x NODES directions."""
    nodes = (np.arange(NODES) + 0.5) / NODES * side
    x, y = np.broadcast_arrays((left[:, None] + nodes)[:, :, None], (bottom[:, None] + nodes)[:, None, :])
    light = _reflected(term, shape, _towards(incidence, *_unmapped(x, y))).reshape(len(left), NODES**2)
    return light.mean(axis=1), np.ptp(light, axis=1)


def _reflected(term: Term, shape: Mapping[str, float], g: Geometry) -> Values:
    """Size of a term times cos(theta_r), 0 below the horizon."""
    single = Model(name="term", title="", cite="", terms={"weight": term})
    (value,) = single.basis(g, shape).values()
    return np.asarray(np.abs(value) * np.maximum(g.z_r, 0.0))


def _near(marks: list[tuple[Values, Values]], left: Values, bottom: Values, side: float) -> npt.NDArray[np.bool_]:
    """Whether a cell holds one of the marks, or would if it were twice as wide."""
    near = np.zeros(len(left), dtype=bool)
    for x, y in marks:
        near |= (np.abs(x - left - side / 2) <= side) & (np.abs(y - bottom - side / 2) <= side)
    return near


def _quarters(index: npt.NDArray[np.int64], lower: bool = False) -> npt.NDArray[np.int64]:
    """Indices, one level finer, of the quarters of cells, for columns or, with `lower`, for rows."""
    offsets = np.array([0, 1, 0, 1] if lower else [0, 0, 1, 1])
    return np.ravel(2 * index[:, None] + offsets)


def _morton(column: npt.NDArray[np.int64], row: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """Morton numbers, the bits of both indices in turn: the cells within a cell have consecutive numbers."""
    return _spaced(column) << 1 | _spaced(row)


def _spaced(index: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """The lower 32 bits with a zero before each."""
    for shift, mask in ((16, 0x0000FFFF0000FFFF), (8, 0x00FF00FF00FF00FF), (4, 0x0F0F0F0F0F0F0F0F)):
        index = (index | index << shift) & mask
    index = (index | index << 2) & 0x3333333333333333
    return (index | index << 1) & 0x5555555555555555


def _mapped(x: Values, y: Values, z: Values) -> tuple[Values, Values]:
    """Lambert's equal-area map: the hemisphere becomes the unit disc, and an area there is half the solid angle."""
    reach = np.sqrt(1 + z)
    return x / reach, y / reach


def _unmapped(x: Values, y: Values) -> Incidence:
    """The direction of a point of the map; beyond the unit disc it lies below the horizon."""
    squared = x * x + y * y
    reach = np.sqrt(np.maximum(2 - squared, 0.0))
    return x * reach, y * reach, 1 - squared


def _incidence(theta_i: float, phi_i: float) -> Incidence:
    """The incident direction as components of one element each; ValueError at or below the horizon."""
    if not 0 <= theta_i < 90:
        raise ValueError(f"theta_i must be at least 0 and below 90 deg, not {theta_i:g}")
    g = Geometry.from_degrees(np.array([float(theta_i)]), np.array([0.0]), phi_i=float(phi_i))
    return g.x_i, g.y_i, g.z_i


def _towards(incidence: Incidence, x: Values, y: Values, z: Values) -> Geometry:
    return Geometry(*incidence, x, y, z)
