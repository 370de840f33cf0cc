"""Facet distributions and masking: printed values, normalisation, exact equivalences."""

import itertools
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import gamma, hyp2f1

from gonio import Geometry
from gonio.optics import facets
from gonio.optics.masking import (
    beckmann_lambda,
    exponential_power_lambda,
    ggx_lambda,
    ggx_visibility,
    smith,
    smith_uncorrelated,
    student_lambda,
    van_ginneken,
)

TABLE = tomllib.loads(Path(__file__).with_name("facets.toml").read_text(encoding="utf-8"))
PLACES = np.array([[30, 30, 180], [40, 20, 180], [50, 35, 120], [60, 60, 0], [45, 70, 150]], dtype=float).T
GEOMETRY = Geometry.from_degrees(*PLACES)
ANGLES = np.array([1e-4, 0.01, 0.3, 0.8, 1.3, 1.5])


@pytest.mark.parametrize("row", TABLE["normals"], ids=lambda row: row["what"])
def test_printed_distributions(row):
    found = getattr(facets, row["distribution"])(GEOMETRY, *map(np.asarray, row["arguments"]))
    np.testing.assert_allclose(found, row["values"], rtol=5e-6)


@pytest.mark.parametrize("c", ["1.6", "2.0", "3.0"])
def test_printed_lambda(c):
    found = student_lambda(np.cos(TABLE["smith"]["at"]), np.asarray(TABLE["smith"]["width"]), np.asarray(float(c)))
    np.testing.assert_allclose(found, TABLE["smith"]["values"][c], rtol=0, atol=0.51e-6)


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("gaussian_slopes", (0.142,)),
        ("beckmann_slopes", (0.3,)),
        ("ggx_slopes", (0.3,)),
        ("student_slopes", (0.3, 1.7)),
        ("hyper_cauchy_slopes", (0.2, 1.8)),
        ("cosine_power_normals", (50.0,)),
        ("exponential_power_slopes", (0.25, 0.4)),
        ("exponential_power_slopes", (0.25, 1.5)),
        ("gtr_normals", (0.25, 1.5)),
        ("gtr_normals", (0.1, 1.0)),
        ("gtr_normals", (0.1, 0.999999)),
        ("gtr_normals", (1.0, 3.0)),
    ],
)
def test_normalised_to_projected_area(name, arguments):
    """The integral of D cos(alpha) over all facet normals is 1; at retro the half vector is the direction itself."""
    x, w = np.polynomial.legendre.leggauss(400)
    root = (x + 1) / 2  # of the angle, because some distributions have a cusp at the normal
    alpha, w = math.pi / 2 * root**3, w / 2 * 1.5 * math.pi * root**2
    retro = Geometry.from_degrees(np.degrees(alpha), np.degrees(alpha), 0.0)
    d = getattr(facets, name)(retro, *map(np.asarray, arguments))
    assert np.sum(w * 2 * math.pi * d * np.cos(alpha) * np.sin(alpha)) == pytest.approx(1, rel=1e-6)


@pytest.mark.parametrize(
    ("name", "arguments"),
    [("beckmann_slopes", (0.4, 0.2)), ("ggx_slopes", (0.3, 0.1)), ("student_slopes", (0.2, 1.7, 0.4))],
)
def test_elliptical_ones_are_normalised_too(name, arguments):
    """As above, with a mean over the azimuth of the facet; the trapezium rule is exact for what is periodic."""
    x, w = np.polynomial.legendre.leggauss(400)
    alpha = np.degrees((x + 1) * math.pi / 4)[:, None]
    retro = Geometry.from_degrees(alpha, alpha, 0.0, np.arange(0, 360, 2.0))
    mean = getattr(facets, name)(retro, *arguments).mean(axis=1)
    alpha = np.radians(alpha[:, 0])
    total = np.sum(w * math.pi / 4 * 2 * math.pi * mean * np.cos(alpha) * np.sin(alpha))
    assert total == pytest.approx(1, rel=1e-6)


def test_elliptical_ones_have_their_axes():
    """Equal widths are the isotropic form; facets tilted along x know the first width, those across the second."""
    g = GEOMETRY
    for name, first, rest in [("beckmann_slopes", 0.3, ()), ("ggx_slopes", 0.3, ()), ("student_slopes", 0.3, (1.7,))]:
        distribution = getattr(facets, name)
        np.testing.assert_allclose(distribution(g, first, *rest, 0.3), distribution(g, first, *rest), rtol=1e-12)
    along, across = (Geometry.from_degrees(50.0, 20.0, 180.0, phi_i) for phi_i in (0.0, 90.0))
    scale = 0.4 / 0.2  # of the constant, 1/(pi g_x g_y)
    np.testing.assert_allclose(
        facets.beckmann_slopes(along, 0.4, 0.2), facets.beckmann_slopes(along, 0.4) * scale, rtol=1e-12
    )
    np.testing.assert_allclose(
        facets.beckmann_slopes(across, 0.4, 0.2), facets.beckmann_slopes(across, 0.2) / scale, rtol=1e-12
    )


def test_exact_equivalences():
    """Hyper-Cauchy, GGX and Beckmann are members of the Student family (formulas 2)."""
    g = GEOMETRY
    s, q = 0.2, 1.8
    np.testing.assert_allclose(
        facets.hyper_cauchy_slopes(g, s, q),
        (q - 1) * 2 ** (q - 1) / (math.pi * s**2 * g.cos_alpha**4 * (2 + g.tan_alpha_squared / s**2) ** q),
        rtol=1e-12,
    )
    w = 0.3
    direct = w**2 / (math.pi * g.cos_alpha**4 * (w**2 + g.tan_alpha_squared) ** 2)
    np.testing.assert_allclose(facets.ggx_slopes(g, w), direct, rtol=1e-12)
    np.testing.assert_allclose(facets.hyper_cauchy_slopes(g, w / math.sqrt(2), 2.0), direct, rtol=1e-12)
    np.testing.assert_allclose(
        facets.exponential_power_slopes(g, w, np.asarray(1.0)), facets.beckmann_slopes(g, w), rtol=1e-12
    )
    s_t = 0.4  # total rms slope of the exponential distribution
    exponential = 3 / (math.pi * s_t**2 * g.cos_alpha**4) * np.exp(-np.sqrt(6 * g.tan_alpha_squared) / s_t)
    np.testing.assert_allclose(
        facets.exponential_power_slopes(g, s_t / math.sqrt(6), np.asarray(0.5)), exponential, rtol=1e-7
    )
    np.testing.assert_allclose(facets.gtr_normals(g, w, 2.0), direct, rtol=1e-12)
    for narrow in (0.001, 0.1):  # burley2012's form at c = 1
        tilt = narrow**2 * g.cos_alpha**2 + g.cos_alpha**2 * g.tan_alpha_squared
        clearcoat = (narrow**2 - 1) / (math.pi * math.log(narrow**2) * tilt)
        np.testing.assert_allclose(facets.gtr_normals(g, narrow, 1.0), clearcoat, rtol=1e-12)
        np.testing.assert_allclose(facets.gtr_normals(g, narrow, 1 + 1e-9), clearcoat, rtol=1e-7)
    # at c = 1e6 the Student tail has reached the Gaussian but for tan^4 alpha/(2 c m^4), 1e-4 in the tail of these rows
    near = g.tan_alpha_squared < 0.3
    np.testing.assert_allclose(facets.student_slopes(g, w, 1e6)[near], facets.beckmann_slopes(g, w)[near], rtol=1e-4)


@pytest.mark.parametrize("c", [1.6, 2.0, 3.0, 10.0, 40.0])
def test_student_lambda_against_the_hypergeometric_form(c):
    x = 1 / (0.3 * np.tan(ANGLES[1:]))
    s1 = (c - 1 + x**2) ** (1.5 - c) / x
    s2 = x * hyp2f1(0.5, c - 0.5, 1.5, -(x**2) / (c - 1))
    scale = gamma(c - 0.5) / (gamma(c) * math.sqrt(math.pi))
    exact = scale * ((c - 1) ** c / (2 * c - 3) * s1 + math.sqrt(c - 1) * s2) - 0.5
    found = student_lambda(np.cos(ANGLES[1:]), np.asarray(0.3), np.asarray(c))
    np.testing.assert_allclose(found, exact, rtol=1e-9, atol=1e-12)


def test_lambda_limits():
    """GGX is the Student form at c = 2; a large c approaches Beckmann; no direction near the normal is masked."""
    np.testing.assert_allclose(
        student_lambda(np.cos(ANGLES), np.asarray(0.3), np.asarray(2.0)),
        ggx_lambda(np.cos(ANGLES), 0.3),
        rtol=1e-8,
        atol=1e-10,
    )
    # the two tails differ by about 1/c
    np.testing.assert_allclose(
        student_lambda(np.cos(ANGLES[3:]), np.asarray(0.3), np.asarray(40.0)),
        beckmann_lambda(np.cos(ANGLES[3:]), np.asarray(0.3)),
        rtol=0.6,
        atol=1e-4,
    )
    for of_normal in (beckmann_lambda(np.asarray(1.0), np.asarray(0.3)), ggx_lambda(np.asarray(1.0), 0.3)):
        assert float(of_normal) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("width", [0.01, 0.3, 1.0])
def test_ggx_visibility_is_smiths_masking_over_the_cosines(width):
    """The form without quotients of cosines, up to the horizon, where those keep fewer digits."""
    theta = np.linspace(0, 90, 46)
    g = Geometry.from_degrees(theta[:, None], theta, 60.0)
    lambdas = ggx_lambda(g.cos_i, width), ggx_lambda(g.cos_r, width)
    np.testing.assert_allclose(
        ggx_visibility(g, width), 1 / (1 + lambdas[0] + lambdas[1]) / (4 * g.cos_i * g.cos_r), rtol=1e-12
    )


@pytest.mark.parametrize("p", [0.2, 0.5, 0.7, 1.0, 1.5])
@pytest.mark.parametrize("width", [0.001, 0.1, 1.0])
def test_exponential_power_lambda_against_marginal_slopes(width, p):
    """Lambda is (1/mu) times the integral of (q - mu) over the marginal density of slopes q > mu, by brute force."""
    constant = p / (math.pi * gamma(1 / p))  # slopes in units of the width
    end = 100 ** (1 / (2 * p))

    def marginal(q):
        edges = np.concatenate([[0], np.geomspace(1e-3, 1, 5) * end])
        density = (
            quad(lambda t: math.exp(-((q * q + t * t) ** p)), a, b, epsrel=1e-10)[0]
            for a, b in itertools.pairwise(edges)
        )
        return 2 * constant * sum(density)

    for theta in (45.0, 80.0, 89.5):
        mu = 1 / (width * math.tan(math.radians(theta)))
        if mu > end / 3:
            continue
        edges = mu + np.concatenate([[0], np.geomspace(1e-3, 1, 5) * (end - mu)])

        def above(q, mu=mu):
            return (q - mu) * marginal(q) / mu

        expected = sum(quad(above, a, b, epsrel=1e-9)[0] for a, b in itertools.pairwise(edges))
        found = exponential_power_lambda(*(np.asarray(v) for v in (math.cos(math.radians(theta)), width, p)))
        assert found == pytest.approx(expected, rel=1e-7)


def test_exponential_power_lambda_is_beckmanns_at_power_one():
    theta = np.radians([5, 20, 45, 60, 80, 89, 89.99])
    for width in (0.01, 0.3, 1.0):
        found = exponential_power_lambda(np.cos(theta), np.asarray(width), np.asarray(1.0))
        np.testing.assert_allclose(found, beckmann_lambda(np.cos(theta), width), rtol=1e-9, atol=1e-14)


def test_masking_between_its_limits():
    """Correlation by azimuth runs from all that is lit being seen towards that of the heights alone (formulas 3.3)."""
    l_i, l_r = np.asarray(0.4), np.asarray(1.3)
    azimuths = np.linspace(0, 180, 19)
    found = van_ginneken(Geometry.from_degrees(70.0, 80.0, azimuths), l_i, l_r)
    assert found[0] == pytest.approx(1 / (1 + 1.3), rel=1e-12)
    p = math.pi / 2
    assert found[9] == pytest.approx(1 / (1 + 1.3 + 0.4 * 4.41 * p / (4.41 * p + 1)), rel=1e-12)
    assert (np.diff(found) < 0).all()
    assert smith_uncorrelated(l_i, l_r) < smith(l_i, l_r) < found[-1] < 1.02 * smith(l_i, l_r)
    normal = van_ginneken(Geometry.from_degrees(0.0, 80.0, azimuths), 0 * l_i, l_r)
    np.testing.assert_allclose(normal, 1 / (1 + 1.3))
