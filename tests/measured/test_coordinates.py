"""Coordinate systems: there and back, and against directions worked out another way."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gonio.measured.coordinates import SYSTEMS, grid, system_of

polar = st.floats(0.5, 89.5)
azimuth = st.floats(0, 359.9)


@pytest.mark.parametrize("system", SYSTEMS.values(), ids=lambda s: s.name)
@given(theta_i=polar, theta_r=polar, phi=azimuth, phi_i=azimuth)
def test_there_and_back(system, theta_i, theta_r, phi, phi_i):
    """Within the rounding of an arc tangent near its pole, where an azimuth moves by 1e-16/sin(angle)."""
    given_ = tuple(np.array([v]) for v in (theta_i, theta_r, phi, phi_i))
    axes = system.axes_of(*given_)
    back = system.directions(*axes)
    small = min(math.sin(math.radians(float(axes[0][0]))), math.sin(math.radians(float(axes[1][0]))), 1)
    for found, expected in zip(back, given_, strict=True):
        away = np.abs(np.exp(1j * np.radians(found)) - np.exp(1j * np.radians(expected)))
        assert away < 1e-12 / max(small, 1e-9)


def test_specular_angles_are_those_of_a_rotated_frame():
    """Azimuth 0 leads from the mirror direction to the normal, 180 to the horizon."""
    system = SYSTEMS["specular"]
    _, theta_r, phi, _ = system.directions(np.full(4, 30.0), np.full(4, 20.0), np.array([0.0, 180, 90, 270]))
    np.testing.assert_allclose(theta_r[:2], [10, 50], atol=1e-12)
    np.testing.assert_allclose(phi[:2], 180)
    # By the spherical law of cosines: cos theta_r = cos 30 cos 20 where the arc is at right angles to the meridian.
    expected = math.degrees(math.acos(math.cos(math.radians(30)) * math.cos(math.radians(20))))
    np.testing.assert_allclose(theta_r[2:], expected)
    assert phi[2] < 180 < phi[3]
    assert phi[2] + phi[3] == pytest.approx(360)


@given(theta_i=polar, theta_r=polar, phi=azimuth)
def test_half_difference_angles_against_the_vectors(theta_i, theta_r, phi):
    """theta_h and theta_d are the angles of h with the normal and with w_i (rusinkiewicz1998)."""
    t_i, t_r, p = map(math.radians, (theta_i, theta_r, phi))
    w_i = np.array([math.sin(t_i), 0, math.cos(t_i)])
    w_r = np.array([math.sin(t_r) * math.cos(p), math.sin(t_r) * math.sin(p), math.cos(t_r)])
    half = (w_i + w_r) / np.linalg.norm(w_i + w_r)
    theta_h, theta_d, _, _ = SYSTEMS["half-difference"].axes_of(*(np.array(v) for v in (theta_i, theta_r, phi)))
    assert math.cos(math.radians(theta_h)) == pytest.approx(half[2], abs=1e-12)
    assert math.cos(math.radians(theta_d)) == pytest.approx(half @ w_i, abs=1e-12)


def test_exchanging_source_and_detector_turns_phi_d_by_half_a_circle():
    system = SYSTEMS["half-difference"]
    there = system.axes_of(*(np.array(v) for v in (35.0, 60.0, 130.0, 0.0)))
    back = system.axes_of(*(np.array(v) for v in (60.0, 35.0, -130.0, 130.0)))
    np.testing.assert_allclose(there[:2], back[:2])
    assert (there[2] + 180) % 360 == pytest.approx(back[2])


def test_a_grid_has_the_angles_of_every_node():
    found = grid("specular", theta_i=[10, 80], phi_s=[0, 90, 180], theta_s=[0, 30])
    assert found["theta_r"].dims == ("theta_i", "phi_s", "theta_s")
    assert found["theta_r"].sel(theta_i=80, phi_s=180, theta_s=30).item() == pytest.approx(110)  # below the horizon
    turned = grid("spherical", theta_i=[10, 80], theta_r=[0, 30], phi=[0, 90], phi_i=[0, 45])
    assert turned["phi_i"].dims == ("phi_i",)
    assert system_of(turned.assign(brdf=(tuple(turned.sizes), np.zeros((2, 2, 2, 2))))).name == "spherical"
