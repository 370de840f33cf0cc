"""Mueller matrices of facets: printed values, an independent derivation in complex numbers, and what light can do."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gonio import Geometry, catalogue
from gonio.optics.fresnel import reflectances, unpolarised
from gonio.optics.mueller import reflection
from gonio.plausibility import hemispherical_reflectance
from gonio.polarisation import (
    angle_of_linear_polarisation,
    degree_of_linear_polarisation,
    emissivity,
    reflected,
    stokes,
)

TABLE = tomllib.loads(Path(__file__).with_name("polarisation.toml").read_text(encoding="utf-8"))
POLARISED = [model for model in catalogue.values() if model.polarised]
every_polarised = pytest.mark.parametrize("model", POLARISED, ids=lambda m: m.name)

# Q of formulas 6.5: what exchanging source and detector does to the third Stokes parameter
EXCHANGE = np.diag([1.0, 1.0, -1.0, 1.0])
PAULI = np.array([[1, 0, 0, 1], [1, 0, 0, -1], [0, 1, 1, 0], [0, 1j, -1j, 0]])


def mueller_of(jones):
    """U (T kron T*) U^-1 acts on (EsEs*, EsEp*, EpEs*, EpEp*): the specification's reference form (6.5)."""
    return (PAULI @ np.kron(jones, np.conj(jones)) @ np.linalg.inv(PAULI)).real


@pytest.mark.parametrize("row", TABLE["facet"], ids=lambda row: str(row["direction"]))
def test_printed_matrices(row):
    g = Geometry.from_degrees(*map(float, row["direction"]))
    found = reflection(g, np.float64(TABLE["n"]), np.float64(TABLE["k"]))
    np.testing.assert_allclose(found, row["mueller"], rtol=0, atol=0.51e-6)
    ss, ps, sp, pp = (complex(*pair) for pair in row["jones"])
    # the amplitudes are printed to six decimals, and an element sums four products of them
    np.testing.assert_allclose(found, mueller_of(np.array([[ss, ps], [sp, pp]])), rtol=0, atol=4e-6)


def closed_form(theta_i, theta_r, phi, m):
    """Jones matrix without rotations: the closed form of formulas 6.5, in complex arithmetic."""
    ti, tr, p = np.radians(theta_i), np.radians(theta_r), np.radians(phi) - np.pi
    cos2b = np.cos(ti) * np.cos(tr) - np.sin(ti) * np.sin(tr) * np.cos(p)
    b = np.arccos(cos2b) / 2
    q = np.sqrt(m**2 - np.sin(b) ** 2)
    r_s, r_p = (np.cos(b) - q) / (np.cos(b) + q), (m**2 * np.cos(b) - q) / (m**2 * np.cos(b) + q)
    a1 = np.sin(2 * b) ** 2
    a2 = np.cos(ti) * np.sin(tr) + np.sin(ti) * np.cos(tr) * np.cos(p)
    a3 = np.sin(ti) * np.cos(tr) + np.cos(ti) * np.sin(tr) * np.cos(p)
    both = np.sin(ti) * np.sin(tr) * np.sin(p) ** 2
    t_pp, t_ss = (both * r_s + a2 * a3 * r_p) / a1, (a2 * a3 * r_s + both * r_p) / a1
    t_ps = -np.sin(p) * (np.sin(tr) * a2 * r_s - np.sin(ti) * a3 * r_p) / a1
    t_sp = -np.sin(p) * (np.sin(ti) * a3 * r_s - np.sin(tr) * a2 * r_p) / a1
    return np.array([[t_ss, t_ps], [t_sp, t_pp]])


def test_rotations_against_the_closed_form():
    random = np.random.default_rng(11)
    for theta_i, theta_r, phi in zip(*random.uniform(1, [[88], [88], [359]], (3, 500)), strict=True):
        n, k = random.uniform(0.2, 4), random.uniform(0, 6)
        expected = mueller_of(closed_form(theta_i, theta_r, phi, n + 1j * k))
        found = reflection(Geometry.from_degrees(theta_i, theta_r, phi), np.float64(n), np.float64(k))
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


def test_a_mirror_at_normal_incidence_and_opposition():
    """Opposition: s and p both come back, p turned round; the rotations have a limit there and it is reached."""
    n, k = np.float64(1.37), np.float64(7.62)
    r = float(unpolarised(np.float64(1.0), n, k))
    for theta in (0.0, 40.0, 80.0):
        found = reflection(Geometry.from_degrees(theta, theta, 0.0), n, k)
        np.testing.assert_allclose(found, r * np.diag([1, 1, -1, -1]), atol=1e-9)
        for offset in (1e-3, 1e-5):
            near = reflection(Geometry.from_degrees(theta, theta + offset, 0.0), n, k)
            np.testing.assert_allclose(near, found, atol=1e-3 * offset**2 + 1e-9)


def test_brewsters_angle():
    """In the mirror direction of a dielectric at Brewster's angle all light leaves in s; arriving p light is gone."""
    theta = np.degrees(np.arctan(1.5))
    matrix = reflection(Geometry.from_degrees(theta, theta, 180.0), np.float64(1.5), np.float64(0.0))
    light = reflected(matrix)
    assert degree_of_linear_polarisation(light) == pytest.approx(1.0, abs=1e-12)
    assert angle_of_linear_polarisation(light) == pytest.approx(0.0, abs=1e-9)
    np.testing.assert_allclose(reflected(matrix, (1, -1, 0, 0)), 0.0, atol=1e-15)


def test_reflectances_are_consistent():
    """|r_s r_p*|^2 = R_s R_p, and its real part is -R at normal incidence in this basis."""
    random = np.random.default_rng(5)
    cos, n, k = random.uniform(0, 1, 300), random.uniform(0.1, 5, 300), random.uniform(0, 8, 300)
    r_s, r_p, real, imaginary = reflectances(cos, n, k)
    np.testing.assert_allclose(real**2 + imaginary**2, r_s * r_p, rtol=1e-10, atol=1e-15)
    m2 = (n + 1j * k) ** 2
    q = np.sqrt(m2 - (1 - cos**2))
    product = (cos - q) / (cos + q) * np.conj((m2 * cos - q) / (m2 * cos + q))
    np.testing.assert_allclose(real + 1j * imaginary, product, rtol=1e-9, atol=1e-12)


angle = st.floats(0, 89.9)


@every_polarised
@given(angle, angle, st.floats(0, 360), st.data())
def test_what_light_can_do(model, theta_i, theta_r, phi, data):
    """Reciprocity in Q-form, no more polarisation than light, and facets that depolarise nothing (formulas 6.5)."""
    shape = {name: data.draw(st.floats(p.lower, p.upper)) for name, p in model.shape.items()}
    there = Geometry.from_degrees(theta_i, theta_r, phi)
    matrix = model.mueller(there, {"ks": 1.0, **shape})
    scale = matrix[0, 0]
    if scale < 1e-200:
        return
    m = matrix / scale
    back = model.mueller(Geometry(*there[3:], *there[:3]), {"ks": 1.0, **shape}) / scale
    np.testing.assert_allclose(back, EXCHANGE @ m.T @ EXCHANGE, atol=1e-5)
    assert np.trace(m.T @ m) == pytest.approx(4.0, abs=1e-9)
    for light in ((1, 0, 0, 0), (1, 1, 0, 0), (1, -0.6, 0.8, 0), (1, 0, 0, 1)):
        leaving = reflected(matrix, light)
        assert np.linalg.norm(leaving[1:]) <= leaving[0] * (1 + 1e-9) + 1e-12 * scale


@every_polarised
def test_ideal_diffuse_light_is_unpolarised(model):
    g = Geometry.from_degrees(np.array([20.0, 60.0]), np.array([50.0, 10.0]), 120.0)
    expected = np.zeros((2, 4, 4))
    expected[:, 0, 0] = 1 / np.pi
    np.testing.assert_allclose(model.mueller(g, {"kd": 1.0}), expected, rtol=1e-15)
    both = model.mueller(g, {"ks": 2.0, "kd": 0.5})
    np.testing.assert_allclose(both[:, 0, 0], model(g, {"ks": 2.0, "kd": 0.5}), rtol=1e-14)


def test_the_unpolarised_element_is_the_scalar_model():
    g = Geometry.from_degrees(*np.random.default_rng(1).uniform(0, [[88], [88], [360]], (3, 200)))
    shape = {"sigma": 0.3, "index": 1.37, "extinction": 7.62}
    scalar = catalogue["priest"].basis(g, shape)["ks"]
    np.testing.assert_allclose(catalogue["priest-mueller"].basis(g, shape)["ks"], scalar, rtol=1e-13)
    with pytest.raises(ValueError, match="no Mueller terms"):
        catalogue["priest"].mueller(g, {"ks": 1.0})


def test_emissivity_by_kirchhoff():
    """What is not reflected is emitted: 1 - DHR by reciprocity, p-polarised towards grazing, 1 - rho for Lambert."""
    model = catalogue["wellems"]
    values = {"ks": 1.0, "index": 1.37, "extinction": 7.62, "s": 0.15, "q": 3.0}
    found = emissivity(model, values, 60.0)
    expected = 1 - hemispherical_reflectance(lambda g: model(g, values), 60.0)
    assert found[0] == pytest.approx(expected, rel=1e-6)
    assert found[1] < -0.01  # less p than s is reflected, so more p is emitted
    np.testing.assert_allclose(found[2:], 0.0, atol=1e-9)
    np.testing.assert_allclose(emissivity(model, {"kd": 0.3}, 20.0), [0.7, 0, 0, 0], atol=1e-6)
    with pytest.raises(ValueError, match="leaves nothing to emit"):
        emissivity(model, {"kd": 1.3}, 20.0)
    with pytest.raises(ValueError, match="too narrow"):
        emissivity(model, {"ks": 1.0, "s": 0.001, "q": 20.0}, 20.0)


def test_emissivity_of_a_polished_surface_is_fresnels():
    """Facets of slope 0.05 at 55 deg: within 0.01 the emissivities of a smooth dielectric in s and p."""
    theta, n = 55.0, np.float64(1.5)
    r_s, r_p, _, _ = reflectances(np.cos(np.radians(theta)), n, np.float64(0.0))
    values = {"ks": 1.0, "index": 1.5, "extinction": 0.0, "s": 0.15, "q": 20.0}
    e = emissivity(catalogue["wellems"], values, theta)
    assert e[0] + e[1] == pytest.approx(1 - r_s, abs=0.01)
    assert e[0] - e[1] == pytest.approx(1 - r_p, abs=0.01)


def test_light_that_cannot_be_is_refused():
    for impossible in ((1, 1, 1, 0), (-1, 0, 0, 0), (1, 0, 0), (np.nan, 0, 0, 0)):
        with pytest.raises(ValueError, match="Stokes parameters"):
            stokes(impossible)
