"""Distributions of facet normals and the facet terms that models share (formulas 2).

Every distribution is normalised to projected area: its integral times cos(alpha) over the hemisphere is 1, so that
`reflected` has the energy of the light that arrives. Equal ones share one implementation: GGX and the hyper-Cauchy
are Student's t, Beckmann's is the Gaussian with m = sqrt(2) sigma.
"""

import math
from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Parameter, PerSteradian
from gonio.optics.masking import v_groove

Slope = Annotated[float, Parameter(0.2, 0.01, 1.0, "rms slope of the facets, per axis")]
TotalSlope = Annotated[float, Parameter(0.3, 0.01, 1.4, "rms slope of the facets, total")]
Width = Annotated[float, Parameter(0.3, 0.01, 1.0, "width of the distribution of facet slopes")]


def gaussian_slopes(g: Geometry, sigma: Array) -> Array:
    """Gaussian slopes of rms `sigma` per axis."""
    tan2 = g.tan_alpha_squared
    xp = namespace(tan2)
    return xp.exp(-tan2 / (2 * sigma**2)) * (1 + tan2) ** 2 / (2 * math.pi * sigma**2)


def beckmann_slopes(g: Geometry, m: Array) -> Array:
    """Beckmann's form of the same: `m` is the total rms slope."""
    return gaussian_slopes(g, m / math.sqrt(2))


def student_slopes(g: Geometry, width: Array, c: Array) -> Array:
    """Student's t of exponent `c` > 1: heavier tails than Gaussian, GGX at c = 2, Beckmann as c grows."""
    tan2 = g.tan_alpha_squared
    return (1 + tan2) ** 2 / (math.pi * width**2 * (1 + tan2 / ((c - 1) * width**2)) ** c)


def ggx_slopes(g: Geometry, width: Array) -> Array:
    """Trowbridge and Reitz's distribution, called GGX (walter2007)."""
    return student_slopes(g, width, 2.0)


def hyper_cauchy_slopes(g: Geometry, s: Array, q: Array) -> Array:
    """The hyper-Cauchy distribution (wellems2006) is Student's t of width s sqrt(2/(q - 1))."""
    return student_slopes(g, s * (2 / (q - 1)) ** 0.5, q)


def cosine_power_normals(g: Geometry, n: Array) -> Array:
    """Blinn's power of the cosine of the tilt (blinn1977)."""
    return (n + 2) / (2 * math.pi) * g.cos_alpha**n


def reflected(g: Geometry, normals: Array, masking: Array) -> Array:
    """Single reflection from facets: D G/(4 cos theta_i cos theta_r) (formulas 2.0)."""
    return normals * masking / (4 * g.cos_i * g.cos_r)


def gaussian_facets(g: Geometry, sigma: Slope) -> PerSteradian:
    """Single reflection from Gaussian facets in V-grooves, without Fresnel factor (guo2023, eqs 3 and 4)."""
    return reflected(g, gaussian_slopes(g, sigma), v_groove(g))
