"""Every term's LaTeX is what its code computes, and all that it takes to compute it."""

import math

import numpy as np
import pytest

from gonio import Geometry, catalogue
from gonio.literature.equations import complete, equations, factors, markdown, symbol
from gonio.model import declarations
from gonio.models.harvey2007 import renormalised
from gonio.optics.fresnel import unpolarised
from gonio.optics.kirchhoff import diffracted
from mathematics import Definition, Scope, definitions, key, names, parsed, width

TERMS = {t: (name, weight) for name, model in catalogue.items() for weight, t in model.terms.items()}
# Its integral over the hemisphere has a test of its own.
EVALUATED = [term for term in TERMS if term.__name__ != "renormalised"]
every_term = pytest.mark.parametrize("term", TERMS, ids=lambda term: term.__name__)

# Off the poles, in plane and out of it, forward and backward.
PAIRS = [(30.0, 50.0, 180.0), (40.0, 20.0, 180.0), (50.0, 35.0, 120.0), (60.0, 25.0, 30.0), (45.0, 70.0, 150.0)]
AZIMUTH_I = 25.0


def known(term) -> list[Definition]:
    """The definitions of a term and of the functions that it names."""
    return [
        definition
        for function in (term, *factors(term))
        for block in equations(function)
        for definition in definitions(block, "angles are in degrees" in (function.__doc__ or ""))
    ]


def values(geometry, shape):
    """Angles of a pair of directions [rad], its unit vectors, and the parameters by their letters."""
    angles = {
        "θ_i": geometry.theta_i_deg,
        "θ_r": geometry.theta_r_deg,
        "φ": math.degrees(math.atan2(geometry.y_r, geometry.x_r)) - AZIMUTH_I,
        "α": math.degrees(math.atan(math.sqrt(geometry.tan_alpha_squared))),
        "β": math.degrees(math.acos(geometry.cos_beta)),
    }
    vectors = {f"{c}_{end}": float(getattr(geometry, f"{c}_{end}")) for c in "xyz" for end in "ir"}
    slopes = {"s_x": float(geometry.slope_x), "s_y": float(geometry.slope_y)}
    parameters = {key(parsed(symbol(name))): float(value) for name, value in shape.items()}
    return {name: math.radians(angle) for name, angle in angles.items()} | vectors | slopes | parameters


def shapes(term):
    """The defaults, and values a quarter of the way from there to the upper bounds, by a factor where it can be."""
    declared = declarations(term)
    yield {name: p.default for name, p in declared.items()}
    yield {
        name: p.default * (p.upper / p.default) ** 0.25 if p.default > 0 else p.default + 0.05 * (p.upper - p.default)
        for name, p in declared.items()
    }


@pytest.mark.parametrize("term", EVALUATED, ids=lambda term: term.__name__)
def test_latex_equals_code(term):
    """At five pairs of directions and two sets of parameters, by a reader that knows nothing of the code."""
    written = known(term)
    pairs = PAIRS[:2] if any("∫" in one.text for one in written) else PAIRS  # an integral takes a second
    for shape in shapes(term):
        for theta_i, theta_r, phi in pairs:
            geometry = Geometry.from_degrees(theta_i, theta_r, phi, AZIMUTH_I)
            scope = Scope(values(geometry, shape), {one.name: one for one in written})
            found = scope.defined(written[0].name, None)
            computed = term(geometry, **{name: np.asarray(value) for name, value in shape.items()})
            # quadrature on both sides reaches 1e-9, and a narrow lobe's tail turns 1e-16 of the tilt into 1e-10
            # and the arc cosine of a Mueller matrix's rotations turns 1e-16 into 1e-8 in plane
            floor = 1e-7 * np.max(computed) if np.ndim(computed) else 1e-300
            np.testing.assert_allclose(computed, found, rtol=1e-8, atol=floor)


def test_renormalised_scatters_what_the_mirror_direction_loses():
    """The integral of its LaTeX, by quadrature over the hemisphere that is not the code's."""
    sigma, length, wavelength, theta_i = 0.1, 1.5, 0.6328, 40.0
    nodes, weights = np.polynomial.legendre.leggauss(160)
    theta, phi = (nodes + 1) * 45, (nodes + 1) * 90
    g = Geometry.from_degrees(theta_i, theta[:, None], phi)
    kernel = diffracted(g, *map(np.asarray, (sigma, length, wavelength)))
    solid_angle = np.radians(45) * weights[:, None] * np.sin(np.radians(theta))[:, None] * np.radians(90) * 2 * weights
    scattered = np.sum(kernel * np.cos(np.radians(theta))[:, None] * solid_angle)
    lost = 1 - math.exp(-((4 * math.pi * sigma * math.cos(math.radians(theta_i)) / wavelength) ** 2))
    found = renormalised(g, *map(np.asarray, (sigma, length, 1.5, 0.0, wavelength)))
    fresnel = unpolarised(g.cos_beta, np.asarray(1.5), np.asarray(0.0))
    np.testing.assert_allclose(
        found, fresnel * lost / scattered * kernel, rtol=1e-6
    )  # the code's Bessel function: 3e-7


@every_term
def test_every_parameter_is_in_the_equations(term):
    """And no letter stands for two things: what a parameter is called, no factor defines."""
    written = set().union(*(names(block) for block in complete(term)))
    letters = {name: key(parsed(symbol(name))) for name in declarations(term)}
    assert {name: letter for name, letter in letters.items() if letter not in written} == {}
    assert len(set(letters.values())) == len(letters)
    defined = {one.name: one.text for one in known(term)}
    assert not set(letters.values()) & set(defined)
    for one in known(term):
        assert defined[one.name] == one.text, one.name


@every_term
def test_equations_fit_a_phone(term):
    """Each line has at most 36 characters side by side, which is what 360 pixels hold at the size of the text."""
    for function in (term, *factors(term)):
        assert equations(function), function.__name__
        for block in equations(function):
            assert width(block) <= 36, block


@every_term
def test_markdown_is_what_github_and_myst_read(term):
    """Dollars on lines of their own, none left open, and no role of reStructuredText."""
    for function in (term, *factors(term)):
        text = markdown(function)
        assert text.count("\n$$\n") + text.startswith("$$\n") + text.endswith("\n$$") == 2 * len(equations(function))
        assert text.replace("$$", "").count("$") % 2 == 0
        assert not [role for role in (":math:", ":func:", ".. math::") if role in text]
