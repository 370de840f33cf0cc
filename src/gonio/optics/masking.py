"""Masking and shadowing of facets by their neighbours (formulas 3)."""

import math

from gonio.arrays import Array, namespace, special
from gonio.geometry import Geometry
from gonio.optics.quadrature import unit_interval


def v_groove(g: Geometry) -> Array:
    """Torrance and Sparrow's V-grooves (guo2023, eq 4): 1, or the unblocked part of the narrower direction."""
    xp = namespace(g.cos_i)
    unblocked = 2 * g.cos_alpha * xp.where(g.cos_i < g.cos_r, g.cos_i, g.cos_r) / g.cos_beta
    return xp.where(unblocked > 1.0, 1.0, unblocked)


def smith(lambda_i: Array, lambda_r: Array) -> Array:
    """Smith's height-correlated masking and shadowing from the two Lambda functions (formulas 3.2)."""
    return 1 / (1 + lambda_i + lambda_r)


def beckmann_lambda(cos: Array, m: Array) -> Array:
    """Smith's Lambda of Gaussian slopes of total rms m, for a direction of this cosine."""
    xp = namespace(cos)
    x = cos / (m * _sine(cos))
    return (special("erf", x) - 1) / 2 + xp.exp(-(x**2)) / (2 * math.sqrt(math.pi) * x)


def ggx_lambda(cos: Array, width: Array) -> Array:
    """Smith's Lambda of GGX slopes."""
    xp = namespace(cos)
    return (xp.sqrt(1 + width**2 * (1 - cos**2) / cos**2) - 1) / 2


def _sine(cos: Array) -> Array:
    """Sine of the polar angle, kept above zero so that the normal direction has a finite, vanishing Lambda."""
    xp = namespace(cos)
    squared = 1 - cos**2
    return xp.sqrt(xp.where(squared < 1e-12, 1e-12, squared))


def student_lambda(cos: Array, width: Array, c: Array) -> Array:
    """Smith's Lambda of Student's t slopes, c > 1.5: the exact form, its hypergeometric part by quadrature.

    x 2F1(1/2, c - 1/2; 3/2; -x^2/(c - 1)) is the integral of (1 + u^2/(c - 1))^(1/2 - c) from 0 to x; after
    u = sqrt(c - 1) sinh(s) the integrand is smooth in s and traces in any array library.
    """
    xp = namespace(cos)
    x = cos / (width * _sine(cos))
    root = (c - 1) ** 0.5
    end = xp.asinh(x / root)
    nodes, weights = unit_interval(96, x)
    s = end[..., None] * nodes
    cosh_power = xp.exp((2 - 2 * c)[..., None] * xp.log(xp.cosh(s)))
    second = root * end * xp.sum(weights * cosh_power, axis=-1)
    first = (c - 1 + x**2) ** (1.5 - c) / x
    scale = xp.exp(special("gammaln", c - 0.5) - special("gammaln", c)) / math.sqrt(math.pi)
    found = scale * ((c - 1) ** c / (2 * c - 3) * first + root * second) - 0.5
    return xp.where(found < 0.0, 0.0, found)
