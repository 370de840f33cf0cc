"""Energy over the bounds of every model: what declares no violation keeps it, and a declared one is found."""

from functools import partial

import numpy as np
import pytest

from gonio import catalogue
from gonio.model import Model
from gonio.plausibility import hemispherical_reflectance
from gonio.sampling import hemispherical_reflectance as sampled_reflectance

EXCESS = 1e-3  # of a reflectance over 1 that counts: the quadrature is trusted to a tenth of it
SHAPES = 8
ANGLES = (0.0, 40.0, 75.0, 88.0, 89.5)
SURE = 6.0  # standard errors of a Monte-Carlo estimate, then confirmed with ten times the directions and another seed


def shapes(model: Model) -> list[dict[str, float]]:
    """The defaults, every bound by itself, and seeded draws that like the corners."""
    random = np.random.default_rng(2026)
    found: list[dict[str, float]] = [{}]
    for name, p in model.shape.items():
        found += [{name: p.lower}, {name: p.upper}]
    for _ in range(SHAPES if model.shape else 0):
        corner = random.integers(0, 2, len(model.shape))
        inside = random.uniform(0, 1, len(model.shape))
        at_bound = random.uniform(0, 1, len(model.shape)) < 0.5
        share = np.where(at_bound, corner, inside)
        found.append(
            {n: p.lower + float(s) * (p.upper - p.lower) for s, (n, p) in zip(share, model.shape.items(), strict=True)}
        )
    return found


def excess(model: Model, values: dict[str, float], theta_i: float) -> float:
    """Reflectance beyond 1: by quadrature where two node counts agree, else by Monte Carlo; 0 where neither is sure."""
    evaluate = partial(_evaluate, model, values)
    coarse, fine = (hemispherical_reflectance(evaluate, theta_i, nodes) for nodes in (48, 64))
    if abs(coarse - fine) < EXCESS / 10:
        return fine - 1
    for n, seed in ((2_000, 0), (20_000, 1)):
        estimate = sampled_reflectance(model, values, theta_i, n=n, seed=seed)
        if estimate.value - SURE * estimate.standard_error <= 1 + EXCESS:
            return 0.0
    return estimate.value - 1


def _evaluate(model, values, geometry):
    return model(geometry, values)


@pytest.mark.no_cover  # counting the lines of so many quadratures takes longer than they do
@pytest.mark.parametrize("model", list(catalogue.values()), ids=lambda m: m.name)
def test_energy_as_declared(model):
    """A weight of 1 reflects at most what arrives, over the bounds, unless the model says otherwise; then it does not.

    Terms in other units than 1/sr are not normalised: their weights are no reflectances, and no energy can be told.
    """
    normalised = [w for w in model.weights if model.term_unit(w) == "sr-1"]
    witnesses = (
        (weight, shape, theta_i, found)
        for weight in normalised
        for shape in shapes(model)
        for theta_i in ANGLES
        if (found := excess(model, {weight: 1.0, **shape}, theta_i)) > EXCESS
    )
    first = next(witnesses, None)
    if "energy" in model.violates:
        assert first or normalised != list(model.weights), "declared, and nowhere found"
    else:
        assert first is None, first
