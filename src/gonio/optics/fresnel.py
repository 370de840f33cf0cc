"""Fresnel reflectance of a smooth facet (formulas 1), and terms multiplied by it."""

import functools
from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Parameter, Term

TINY = 1e-30  # below every squared modulus that matters, and above what single precision rounds to zero

Index = Annotated[float, Parameter(1.5, 0.05, 10.0, "refractive index, real part")]
Extinction = Annotated[float, Parameter(0.0, 0.0, 20.0, "refractive index, imaginary part")]


def unpolarised(cos_beta: Array, n: Array, k: Array) -> Array:
    r"""Mean of the s and p reflectances of complex index n + i k at local incidence beta.

    .. math::

        \begin{aligned}
        F(\beta) &= \frac{\lvert r_s\rvert^2 + \lvert r_p\rvert^2}{2} \\
        r_s &= \frac{\cos\beta - \kappa}{\cos\beta + \kappa} \\
        r_p &= \frac{N^2\cos\beta - \kappa}{N^2\cos\beta + \kappa} \\
        \kappa &= \sqrt{N^2 - \sin^2\beta} \\
        N &= n + \mathrm{i}k
        \end{aligned}

    where n is the index, k the extinction and N the complex index.
    """
    r_s, r_p, _, _ = reflectances(cos_beta, n, k)
    return (r_s + r_p) / 2


def reflectances(cos_beta: Array, n: Array, k: Array) -> tuple[Array, Array, Array, Array]:
    """|r_s|^2, |r_p|^2 and the real and imaginary part of r_s r_p*, for complex index n + i k, in real arithmetic.

    The p amplitude is r_p = -r_s (q cos beta - sin^2 beta)/(q cos beta + sin^2 beta), with q of `refracted`.
    """
    sin2, (a, b) = 1 - cos_beta**2, refracted(cos_beta, n, k)
    r_s = ((a - cos_beta) ** 2 + b**2) * (1 / ((a + cos_beta) ** 2 + b**2))
    along, across = a * cos_beta, b * cos_beta
    p_over_s = r_s * (1 / ((along + sin2) ** 2 + across**2))
    r_p = p_over_s * ((along - sin2) ** 2 + across**2)
    real = -p_over_s * (along**2 + across**2 - sin2**2)
    return r_s, r_p, real, p_over_s * 2 * across * sin2


def refracted(cos_beta: Array, n: Array, k: Array) -> tuple[Array, Array]:
    """Real and imaginary part of q, the root of m^2 - sin^2 beta, m = n + i k (formulas 1).

    q is the index times the cosine of the refracted ray. The larger part is computed by a root and the other by
    division, so that nothing is singular at total reflection (k = 0, n < sin beta) and the reflectance at an index of 1
    is exactly 0.
    """
    xp = namespace(cos_beta)
    sin2 = 1 - cos_beta**2
    t, twice = n**2 - k**2 - sin2, 2 * n * k
    squared = t**2 + twice**2
    modulus = xp.sqrt(xp.where(squared < TINY, TINY, squared))
    larger = xp.sqrt((modulus + xp.abs(t)) / 2)
    smaller = twice / (2 * larger)
    return xp.where(t < 0, smaller, larger), xp.where(t < 0, larger, smaller)


def dielectric(cos: Array, n: Array) -> Array:
    r"""Mean of the s and p reflectances of a transparent medium of index n_b, at the incidence theta.

    .. math::

        \begin{aligned}
        F(\theta) &= \frac{F_s(\theta) + F_p(\theta)}{2} \\
        F_s(\theta) &= \left(\frac{\cos\theta - \kappa(\theta)}{\cos\theta + \kappa(\theta)}\right)^2 \\
        F_p(\theta) &= \left(\frac{n_b^2\cos\theta - \kappa(\theta)}{n_b^2\cos\theta + \kappa(\theta)}\right)^2 \\
        \kappa(\theta) &= \sqrt{n_b^2 - \sin^2\theta}
        \end{aligned}

    """
    return unpolarised(cos, n, 0.0)


def with_fresnel(term: Term, n: float, k: float) -> Term:
    """`term` times the Fresnel reflectance of index n + i k: the F of guo2023's eq 3, which the paper has in ks."""

    @functools.wraps(term)
    def product(g: Geometry, **shape: Array) -> Array:
        return unpolarised(g.cos_beta, n, k) * term(g, **shape)

    return product


def schlick(cos_beta: Array, f0: Array) -> Array:
    r"""Schlick's approximation from the reflectance at normal incidence.

    .. math::

        F = F_0 + (1 - F_0)(1 - \cos\beta)^5
    """
    return f0 + (1 - f0) * (1 - cos_beta) ** 5
