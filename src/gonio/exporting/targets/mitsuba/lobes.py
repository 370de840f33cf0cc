"""Which lobes of a model the plugin draws, and in what share of the cases."""

from dataclasses import dataclass

import numpy as np

from gonio.exporting.subject import Subject
from gonio.exporting.targets.mitsuba.fallback import fallback
from gonio.geometry import Geometry
from gonio.model import declarations, sampler_of
from gonio.optics.sampling import COSINE
from gonio.sampling import hemispherical_reflectance
from gonio.symbols.formula import Formula, density_of, draw_of

LEAST_COSINE = 0.1  # of the directions, so that light is found wherever the model reflects any
INCIDENCE = 45.0  # deg, at which the reflectance of the terms is compared
DIRECTIONS = 4_000  # for one reflectance: a share need not be exact
MOST_SETS = 8  # of which the shares are a mean


@dataclass(frozen=True)
class Lobe:
    """A sampler with the weights of the terms that it draws, and its share of the directions."""

    weights: tuple[str, ...]
    share: float
    draw: Formula
    density: Formula


def lobes(subject: Subject) -> tuple[list[Lobe], float, dict[str, float]]:
    """The lobes, the share of the cosine, and the noise of terms that declare no sampler, by weight.

    Terms that one sampler draws alike make one lobe. A term without weight is not drawn.
    """
    light = _light(subject)
    total = sum(light.values())
    shares: dict[tuple[object, ...], tuple[Formula, Formula, dict[str, float]]] = {}
    noise = {}
    for weight, term in subject.model.terms.items():
        if not light[weight]:
            continue
        sampler, part = sampler_of(term), 1.0
        if sampler is None:
            found = fallback(term, {name: _mean(subject, name) for name in declarations(term)})
            sampler, part, noise[weight] = found.sampler, found.share, found.noise
        if sampler is COSINE:
            continue
        draw, density = draw_of(sampler, term), density_of(sampler, term)
        key = tuple(draw.outputs.values())  # equal expressions are one node
        shares.setdefault(key, (draw, density, {}))[2][weight] = part * light[weight] / total
    drawn = [
        Lobe(tuple(s), (1 - LEAST_COSINE) * sum(s.values()), draw, density) for draw, density, s in shares.values()
    ]
    return drawn, 1 - sum(lobe.share for lobe in drawn), noise


def _mean(subject: Subject, name: str) -> float:
    """A value as a mean over the sets, by which the plugin draws too."""
    return float(np.mean([values[name] for values in subject.sets.values()]))


def _light(subject: Subject) -> dict[str, float]:
    """What each term reflects of light at INCIDENCE, its weight included, as a mean over the sets."""
    labels = list(subject.sets)
    chosen = [labels[k] for k in np.unique(np.linspace(0, len(labels) - 1, MOST_SETS).round().astype(int))]
    weights = subject.model.weights
    if len(weights) == 1:
        return {weights[0]: 1.0}
    light = dict.fromkeys(weights, 0.0)
    for label in chosen:
        values = subject.sets[label]
        shape = {name: values[name] for name in subject.model.shape}
        for weight in weights:
            if values[weight]:
                alone = {weight: abs(values[weight])} | shape
                light[weight] += abs(hemispherical_reflectance(subject.model, alone, INCIDENCE, DIRECTIONS).value)
    return light if any(light.values()) else dict.fromkeys(weights, 1.0)


def anisotropic(subject: Subject) -> bool:
    """Whether the value changes when the surface is turned under both directions."""
    pairs = [
        Geometry.from_degrees([20.0, 40.0, 60.0], [50.0, 30.0, 60.0], [180.0, 120.0, 70.0], a) for a in (0.0, 37.0)
    ]
    for label in subject.sets:
        still, turned = (np.asarray(subject.brdf(g, label)) for g in pairs)
        if np.any(np.abs(turned - still) > 1e-9 * np.abs(still)):
            return True
    return False
