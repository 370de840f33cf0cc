"""Facet distributions and masking: printed values, normalisation, exact equivalences."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from scipy.special import gamma, hyp2f1

from gonio import Geometry
from gonio.optics import facets
from gonio.optics.masking import beckmann_lambda, ggx_lambda, student_lambda

TABLE = tomllib.loads(Path(__file__).with_name("facets.toml").read_text(encoding="utf-8"))
PLACES = np.array([[30, 30, 180], [40, 20, 180], [50, 35, 120], [60, 60, 0], [45, 70, 150]], dtype=float).T
GEOMETRY = Geometry.from_degrees(*PLACES)
ANGLES = np.array([1e-4, 0.01, 0.3, 0.8, 1.3, 1.5])


@pytest.mark.parametrize("row", TABLE["normals"], ids=lambda row: row["what"])
def test_printed_distributions(row):
    found = getattr(facets, row["distribution"])(GEOMETRY, *row["arguments"])
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
    ],
)
def test_normalised_to_projected_area(name, arguments):
    """The integral of D cos(alpha) over all facet normals is 1; at retro the half vector is the direction itself."""
    x, w = np.polynomial.legendre.leggauss(4000)
    alpha = (x + 1) * math.pi / 4
    retro = Geometry.from_degrees(np.degrees(alpha), np.degrees(alpha), 0.0)
    d = getattr(facets, name)(retro, *arguments)
    assert np.sum(w * math.pi / 4 * 2 * math.pi * d * np.cos(alpha) * np.sin(alpha)) == pytest.approx(1, rel=1e-6)


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
