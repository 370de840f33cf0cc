"""Every term's LaTeX is what its code computes, and all that it takes to compute it."""

import math

import numpy as np
import pytest

from gonio import Geometry, catalogue
from gonio.literature.equations import complete, equations, factors, symbol
from gonio.model import declarations
from mathematics import Definition, Scope, definitions, key, parsed

TERMS = {t: (name, weight) for name, model in catalogue.items() for weight, t in model.terms.items()}
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
    """The defaults, and values a quarter of the way from the defaults to the upper bounds, by a factor where it can be."""
    declared = declarations(term)
    yield {name: p.default for name, p in declared.items()}
    yield {
        name: p.default * (p.upper / p.default) ** 0.25 if p.default > 0 else p.default + 0.05 * (p.upper - p.default)
        for name, p in declared.items()
    }


@every_term
def test_latex_equals_code(term):
    """At five pairs of directions and two sets of parameters, by a reader that knows nothing of the code."""
    if "d}\\omega_r" in "".join(complete(term)):
        pytest.skip("an integral over the hemisphere: test_renormalised_equals_its_integral")
    written = known(term)
    for shape in shapes(term):
        for theta_i, theta_r, phi in PAIRS:
            geometry = Geometry.from_degrees(theta_i, theta_r, phi, AZIMUTH_I)
            scope = Scope(values(geometry, shape), {one.name: one for one in written})
            found = scope.defined(written[0].name, None)
            computed = term(geometry, **{name: np.asarray(value) for name, value in shape.items()})
            # quadrature on both sides reaches 1e-9, and a narrow lobe's tail turns 1e-16 of the tilt into 1e-10
            # and the arc cosine of a Mueller matrix's rotations turns 1e-16 into 1e-8 in plane
            floor = 1e-7 * np.max(computed) if np.ndim(computed) else 1e-300
            np.testing.assert_allclose(computed, found, rtol=1e-8, atol=floor)
