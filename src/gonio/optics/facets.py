"""Microfacet slope distributions and the facet term that models share (formulas 2)."""

import math
from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Parameter, PerSteradian
from gonio.optics.masking import v_groove

Slope = Annotated[float, Parameter(0.2, 0.01, 1.0, "rms slope of the facets, per axis")]


def gaussian_slopes(g: Geometry, sigma: Array) -> Array:
    """Distribution of facet normals with Gaussian slopes, normalised to projected area (formulas 2)."""
    tan2 = g.tan_alpha_squared
    xp = namespace(tan2)
    return xp.exp(-tan2 / (2 * sigma**2)) * (1 + tan2) ** 2 / (2 * math.pi * sigma**2)


def gaussian_facets(g: Geometry, sigma: Slope) -> PerSteradian:
    """Single reflection from Gaussian facets in V-grooves, without Fresnel factor (guo2023, eqs 3 and 4)."""
    return gaussian_slopes(g, sigma) * v_groove(g) / (4 * g.cos_i * g.cos_r)
