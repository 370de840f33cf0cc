"""How a renderer draws the light that a model reflects: its own samplers in shares, and the cosine law.

The cosine law draws every direction, so that none is missed, also for terms that declare no sampler.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gonio.exporting.subject import Subject, Values
from gonio.geometry import Geometry
from gonio.model import Model, Sampler, Term, declarations, sampler_of
from gonio.optics.sampling import COSINE
from gonio.sampling import hemispherical_reflectance

ANGLE = 45.0  # incidence [deg] at which the terms are weighed against each other
LEAST_COSINE = 0.1
LEAST_LOBE = 0.05  # Fresnel's reflectance is some twenty times as great at grazing as at ANGLE
DRAWS = 4_000  # reflectance to about a percent, which changes no mean, only its noise


@dataclass(frozen=True)
class Lobe:
    """A term that is drawn by its own sampler, and in which share of the cases."""

    weight: str
    sampler: Sampler
    term: Term
    share: float


@dataclass(frozen=True)
class Mixture:
    """Lobes whose shares add up to 1 with `cosine`, which is at least LEAST_COSINE.

    Attributes
    ----------
    lobes : tuple
        Terms with a sampler of their own, the largest share first.
    cosine : float
        Share of directions in proportion to cos(theta_r).
    values : mapping
        Shape parameters of the samplers by name: the means over the sets where there are several.
    unsampled : tuple
        Weights of the terms that the cosine law draws because they declare no sampler: a narrow lobe of them is noisy.

    """

    lobes: tuple[Lobe, ...]
    cosine: float
    values: Values
    unsampled: tuple[str, ...] = ()

    def shape(self, lobe: Lobe) -> dict[str, float]:
        """The shape parameters of a lobe, in the order of its term."""
        return {name: self.values[name] for name in declarations(lobe.term)}

    def density(self, g: Geometry) -> npt.NDArray[np.float64]:
        """Probability density [1/sr] of reflected directions, 0 below the horizon: what a program has to compute."""
        found = self.cosine * np.asarray(COSINE.density(g))
        for lobe in self.lobes:
            found = found + lobe.share * np.asarray(lobe.sampler.density(g, **self.shape(lobe)))
        return np.where(g.below, 0.0, found)


def mixture(subject: Subject) -> Mixture:
    """The shares of a model's terms in proportion to weight times reflectance at ANGLE, for the mean of its sets.

    A lobe gets LEAST_LOBE at least before all are scaled to leave LEAST_COSINE.
    """
    values = means(subject)
    found = {w: abs(values[w]) * _reflectance(subject.model, w, values) for w in subject.model.weights if values[w]}
    total = sum(found.values()) or 1.0
    samplers = {weight: sampler_of(subject.model.terms[weight]) for weight in found}
    own = {
        w: max(size / total, LEAST_LOBE) for w, size in found.items() if samplers[w] not in (None, COSINE) and size > 0
    }
    most = min(1.0, (1 - LEAST_COSINE) / (sum(own.values()) or 1.0))  # 1 where the other terms leave the cosine enough
    lobes = [
        Lobe(weight, sampler, subject.model.terms[weight], share * most)
        for weight, share in sorted(own.items(), key=lambda item: -item[1])
        if (sampler := samplers[weight]) is not None
    ]
    unsampled = tuple(weight for weight, sampler in samplers.items() if sampler is None)
    return Mixture(tuple(lobes), 1.0 - sum(lobe.share for lobe in lobes), values, unsampled)


def means(subject: Subject) -> Values:
    """The mean of every parameter over the sets; of weights their sizes, as one set may have none of a term."""
    sets = list(subject.sets.values())

    def size(name: str, values: Mapping[str, float]) -> float:
        return abs(values[name]) if name in subject.model.weights else values[name]

    return {name: sum(size(name, values) for values in sets) / len(sets) for name in subject.model.parameters}


def _reflectance(model: Model, weight: str, values: Values) -> float:
    """What one term of weight 1 reflects at ANGLE."""
    term = model.terms[weight]
    single = Model(model.name, terms={weight: term})
    shape = {name: values[name] for name in declarations(term)}
    return hemispherical_reflectance(single, {weight: 1.0, **shape}, ANGLE, n=DRAWS).value
