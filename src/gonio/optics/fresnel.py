"""Fresnel reflectance of a smooth facet (formulas 1), and how a term gains it."""

import functools
from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Parameter, Term

Index = Annotated[float, Parameter(1.5, 0.05, 10.0, "refractive index, real part")]
Extinction = Annotated[float, Parameter(0.0, 0.0, 20.0, "refractive index, imaginary part")]


def unpolarised(cos_beta: Array, n: float, k: float) -> Array:
    """Mean of the s and p reflectances of complex index n + i k at local incidence beta, in real arithmetic."""
    xp = namespace(cos_beta)
    cos2 = cos_beta**2
    sin2 = 1 - cos2
    t = n**2 - k**2 - sin2
    a2 = xp.sqrt(t**2 + 4 * n**2 * k**2)
    a = xp.sqrt((a2 + t) / 2)
    r_s = (a2 - 2 * a * cos_beta + cos2) / (a2 + 2 * a * cos_beta + cos2)
    r_p = r_s * (cos2 * a2 - 2 * a * cos_beta * sin2 + sin2**2) / (cos2 * a2 + 2 * a * cos_beta * sin2 + sin2**2)
    return (r_s + r_p) / 2


def with_fresnel(term: Term, n: float, k: float) -> Term:
    """`term` times the Fresnel reflectance of index n + i k: the F that guo2023 prints in eq 3 and leaves in ks."""

    @functools.wraps(term)
    def product(g: Geometry, **shape: Array) -> Array:
        return unpolarised(g.cos_beta, n, k) * term(g, **shape)

    return product


def schlick(cos_beta: Array, f0: Array) -> Array:
    """Schlick's approximation from the reflectance at normal incidence."""
    return f0 + (1 - f0) * (1 - cos_beta) ** 5
