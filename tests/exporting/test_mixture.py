"""Shares in which a renderer draws the terms of a model."""

import numpy as np
import pytest

from gonio import Geometry, catalogue
from gonio.exporting.mixture import LEAST_COSINE, LEAST_LOBE, mixture
from gonio.exporting.subject import Subject, of_model
from gonio.model import sampler_of
from gonio.optics.sampling import COSINE


@pytest.mark.parametrize("name", catalogue)
def test_shares_add_up_and_the_cosine_draws_every_direction(name):
    model = catalogue[name]
    found = mixture(of_model(model, dict.fromkeys(model.weights, 0.5)))
    assert sum(lobe.share for lobe in found.lobes) + found.cosine == pytest.approx(1)
    assert found.cosine >= LEAST_COSINE - 1e-12
    own = {w for w, term in model.terms.items() if sampler_of(term) not in (None, COSINE)}
    assert {lobe.weight for lobe in found.lobes} == own
    assert set(found.unsampled) == {w for w, term in model.terms.items() if sampler_of(term) is None}


def test_shares_follow_what_the_terms_reflect():
    phong = catalogue["phong"]
    weak, strong = (mixture(of_model(phong, {"kd": 0.5, "ks": ks, "n": 40.0})).lobes[0].share for ks in (0.2, 2.0))
    assert LEAST_LOBE < weak < strong


def test_a_weight_of_0_draws_nothing():
    found = mixture(of_model(catalogue["phong"], {"kd": 0.5}))
    assert (found.lobes, found.cosine) == ((), 1.0)


def test_sets_share_one_mixture_of_their_means():
    model = catalogue["harvey-shack"]
    sets = {"R": {"b0": 0.0, "L": 0.1, "S": -2.0}, "G": {"b0": 2.0, "L": 0.3, "S": -1.0}}
    found = mixture(Subject(model, sets, by="channel"))
    (lobe,) = found.lobes
    assert found.shape(lobe) == {"L": pytest.approx(0.2), "S": pytest.approx(-1.5)}
    assert lobe.share == pytest.approx(0.9)


@pytest.mark.parametrize("name", ["ggx", "gonio-best", "phong"])
def test_the_density_adds_up_to_what_is_not_lost(name):
    """By the midpoint rule over the hemisphere; what is missing to 1 is drawn below the horizon."""
    model = catalogue[name]
    found = mixture(of_model(model, dict.fromkeys(model.weights, 0.5)))
    z, azimuth = np.meshgrid((np.arange(400) + 0.5) / 400, (np.arange(720) + 0.5) / 720 * 360, indexing="ij")
    g = Geometry.from_degrees(30.0, np.degrees(np.arccos(z)), azimuth)
    total = float(np.mean(found.density(g)) * 2 * np.pi)
    assert 0.9 < total < 1.001  # of the rule
    assert found.density(Geometry(0.0, 0.0, 1.0, 0.6, 0.0, -0.8)) == 0
