"""Directions, half vectors and conventions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gonio import Geometry

polar = st.floats(0, 89.9)
azimuth = st.floats(-360, 360)


def test_forward_is_the_specular_side():
    mirror = Geometry.from_degrees(40.0, 40.0, 180.0)
    assert mirror.cos_alpha == pytest.approx(1.0, abs=1e-15)
    assert mirror.cos_beta == pytest.approx(np.cos(np.radians(40)))
    retro = Geometry.from_degrees(40.0, 40.0, 0.0)
    assert retro.cos_beta == pytest.approx(1.0)
    assert retro.cos_alpha == pytest.approx(np.cos(np.radians(40)))


def test_signed_angle_is_positive_forward():
    np.testing.assert_allclose(Geometry.in_plane(40.0, 25.0), Geometry.from_degrees(40.0, 25.0, 180.0), atol=1e-15)
    np.testing.assert_allclose(Geometry.in_plane(40.0, -25.0), Geometry.from_degrees(40.0, 25.0, 0.0), atol=1e-15)


@given(polar, polar, azimuth, azimuth)
def test_identities(theta_i, theta_r, phi, phi_i):
    """The exact identities of the specification, section 0, whatever the surface's own azimuth."""
    g = Geometry.from_degrees(theta_i, theta_r, phi, phi_i)
    ti, tr, p = np.radians([theta_i, theta_r, phi])
    cos_2b = np.cos(ti) * np.cos(tr) + np.sin(ti) * np.sin(tr) * np.cos(p)
    assert 2 * g.cos_beta**2 - 1 == pytest.approx(cos_2b, abs=1e-12)
    assert np.cos(ti) + np.cos(tr) == pytest.approx(2 * g.cos_alpha * g.cos_beta, abs=1e-12)
    assert g.tan_alpha_squared == pytest.approx(1 / g.cos_alpha**2 - 1, rel=1e-6, abs=1e-9)
    assert g.theta_i_deg == pytest.approx(theta_i, abs=1e-12)
    assert g.theta_r_deg == pytest.approx(theta_r, abs=1e-12)
    assert g.theta_i_squared == pytest.approx(theta_i**2, rel=1e-12, abs=1e-300)
    assert g.theta_r_squared == pytest.approx(theta_r**2, rel=1e-12, abs=1e-300)
    assert g.cos_ratio == pytest.approx(g.cos_alpha / g.cos_beta, rel=1e-13)


def test_slope_keeps_its_digits_near_the_mirror_direction():
    offset = 1e-7
    g = Geometry.in_plane(30.0, 30.0 + offset)
    expected = np.radians(offset / 2) ** 2
    assert g.tan_alpha_squared == pytest.approx(expected, rel=1e-6)


def test_broadcasts_and_refuses_two_libraries():
    g = Geometry.from_degrees(np.array([[10.0], [20.0]]), np.array([5.0, 6.0, 7.0]))
    assert g.cos_beta.shape == (2, 3)
    import array_api_strict
    import jax.numpy as jnp

    with pytest.raises(TypeError, match="Multiple namespaces"):
        Geometry.from_degrees(array_api_strict.asarray([10.0]), jnp.asarray([20.0]))
