"""What the conventions say where angles end: at grazing, at the normal, and whichever way the surface is turned."""

import math

import numpy as np
import pytest

from gonio import Geometry, catalogue

LEAST = 1e-6  # formulas 0: cosines are kept above this
EVERYWHERE = np.random.default_rng(5).uniform(0, [[85], [85], [360]], (3, 60))


@pytest.mark.parametrize("name", list(catalogue))
def test_only_the_angle_between_the_azimuths_counts(name):
    """At default shape every surface is isotropic: turned under the light, it looks the same."""
    model = catalogue[name]
    values = model.mueller_basis if model.polarised else model.basis
    expected = values(Geometry.from_degrees(*EVERYWHERE), {})
    turned = values(Geometry.from_degrees(*EVERYWHERE, 63.0), {})
    for weight in model.weights:
        size = np.max(np.abs(expected[weight]))
        np.testing.assert_allclose(turned[weight], expected[weight], rtol=1e-7, atol=1e-10 * size)


def test_cosines_at_grazing():
    """Both directions along the surface, from the same side and from opposite sides."""
    same, opposite = Geometry.from_degrees(90.0, 90.0, 0.0), Geometry.from_degrees(90.0, 90.0, 180.0)
    for g in (same, opposite):
        assert (float(g.cos_i), float(g.cos_r)) == (LEAST, LEAST)
        assert (float(g.theta_i_deg), float(g.theta_r_deg)) == (90.0, 90.0)
    # the tilt's tangent is the horizontal part over the sum of the two cosines, each at its least
    assert float(same.slope_x) == pytest.approx(2 / (2 * LEAST))
    assert float(same.cos_alpha) == pytest.approx(2 * LEAST / 2)
    assert float(Geometry.from_degrees(90.0, 90.0, 0.0, 90.0).slope_y) == pytest.approx(2 / (2 * LEAST))
    # the facet that mirrors grazing light forwards is seen at grazing: half the sum of the directions is at its least
    assert float(opposite.cos_beta) == pytest.approx(LEAST / 2)


def test_angles_at_the_normal():
    g = Geometry.from_degrees(0.0, 0.0, 0.0)
    assert (float(g.theta_i_deg), float(g.theta_r_deg)) == (0.0, 0.0)
    assert (float(g.cos_alpha), float(g.cos_beta), float(g.tan_alpha_squared)) == (1.0, 1.0, 0.0)
    assert float(Geometry.from_degrees(45.0, 0.0).slope_x) == pytest.approx(math.tan(math.pi / 8))
