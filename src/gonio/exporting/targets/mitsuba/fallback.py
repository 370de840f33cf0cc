"""A sampler for a term that declares none: the best of some lobes of constant width, for the values that are written.

A term keeps its exact value; the lobe only says where light is looked for.
"""

import functools
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from gonio.arrays import Array
from gonio.model import Model, Sampler, Term
from gonio.optics.distributions import draw_student
from gonio.optics.facets import student_slopes
from gonio.optics.sampling import COSINE, FacetNormals, ShiftedPower
from gonio.sampling import Samples, sample

ANGLES = (10.0, 45.0, 75.0)  # deg, at the worst of which a lobe is judged
DIRECTIONS = 2_000  # at each of them
SHARES = (0.3, 0.6, 0.9)  # of the directions that the lobe draws, the cosine the others
WIDTHS = np.geomspace(1e-3, 1.0, 19)  # of facet slopes
SHARPNESSES = np.geomspace(1.0, 1e8, 17)  # B of the power law (1 + B distance^2)^-C
FALLS = (0.6, 0.8, 1.0, 1.5, 2.5)  # its C


@dataclass(frozen=True)
class Found:
    """A lobe, its share of the directions, and the standard deviation of one sample over the mean, at the worst angle.

    No lobe is better than the cosine where the share is 0.
    """

    sampler: Sampler
    share: float
    noise: float


def fallback(term: Term, shape: Mapping[str, float]) -> Found:
    """The lobe that leaves least noise of a term, by directions that gonio draws from a table of it."""
    model = Model("term", terms={"weight": term})
    drawn = [sample(model, {"weight": 1.0} | dict(shape), theta, DIRECTIONS) for theta in ANGLES]
    by_cosine = [np.asarray(COSINE.density(s.geometry)) for s in drawn]
    best = Found(COSINE, 0.0, _noise(drawn, by_cosine))
    for sampler in _candidates():
        density = [np.asarray(sampler.density(s.geometry)) for s in drawn]
        for share in SHARES:
            noise = _noise(drawn, [share * a + (1 - share) * b for a, b in zip(density, by_cosine, strict=True)])
            if noise < best.noise:
                best = Found(sampler, share, noise)
    return best


def _noise(drawn: list[Samples], densities: list[np.ndarray]) -> float:
    """Standard deviation of f cos(theta_r)/density over its mean, at the worst angle, by directions of another law."""
    worst = 0.0
    for samples, density in zip(drawn, densities, strict=True):
        weights = np.abs(samples.weights)
        light = np.abs(samples.value) * np.maximum(samples.geometry.z_r, 0.0)
        squared = np.mean(weights * light / np.maximum(density, 1e-300))
        mean = np.mean(weights)
        worst = max(worst, float(np.sqrt(max(squared / mean**2 - 1, 0.0))) if mean > 0 else 0.0)
    return worst


def _candidates() -> Iterator[Sampler]:
    for width in WIDTHS:
        yield FacetNormals(student_slopes, draw_student, of=functools.partial(_constants, (float(width), 2.0)))
    for sharpness in SHARPNESSES:
        for fall in FALLS:
            yield ShiftedPower(of=functools.partial(_constants, (float(sharpness), fall)))


def _constants(numbers: tuple[float, ...], **shape: Array) -> tuple[Array, ...]:  # noqa: ARG001
    return tuple(np.asarray(number) for number in numbers)
