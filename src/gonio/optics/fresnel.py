"""Fresnel reflectance of a smooth facet (formulas 1), and terms multiplied by it."""

import functools
import inspect
import math
from typing import Annotated, get_type_hints

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Parameter, Term, declarations

TINY = 1e-30  # below every squared modulus that matters, and above what single precision rounds to zero

Index = Annotated[float, Parameter(1.5, 0.05, 10.0, "refractive index, real part")]
Extinction = Annotated[float, Parameter(0.0, 0.0, 20.0, "refractive index, imaginary part")]

CONSTANTS = ("index", "extinction")
GLASS = dict(zip(CONSTANTS, (1.5, 0.0), strict=True))  # at which a Fresnel factor is taken out: it is nowhere zero


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


def transmittance(cos: Array, n: Array) -> Array:
    r"""What the boundary of a transparent medium of index n_b > 1 lets through, with the digits that 1 - F loses.

    .. math::

        T(\theta) = 1 - F(\theta)

    where F is Fresnel's reflectance (:func:`.dielectric`).
    """
    inside = namespace(cos).sqrt(n**2 - 1 + cos**2)
    return 2 * cos * inside * (1 / (cos + inside) ** 2 + (n / (n**2 * cos + inside)) ** 2)


def with_fresnel(term: Term, n: float, k: float) -> Term:
    """`term` times the Fresnel reflectance of index n + i k: the F of guo2023's eq 3, which the paper has in ks."""

    @functools.wraps(term)
    def product(g: Geometry, **shape: Array) -> Array:
        return unpolarised(g.cos_beta, n, k) * term(g, **shape)

    return product


def over_facets(term: Term, factor: Term) -> Term:
    """The term of facets with another reflectance in the place of its Fresnel factor: a film, a coat.

    Parameters
    ----------
    term : Term
        Facets, of any distribution and masking, with a Fresnel factor of `index` and `extinction` or with none.
    factor : Term
        The reflectance of a Geometry and shape parameters, such as `film_of` and `coat_of` of `layers.film`.

    Returns
    -------
    Term
        With the parameters of the factor beside the other ones of the term. It is drawn as the term is.

    Raises
    ------
    ValueError
        The term depends on its index in another way than by a Fresnel factor, so that none can be taken out.

    """
    own, added = declarations(term), declarations(factor)
    replaced = GLASS if set(CONSTANTS) <= set(own) else {}
    if replaced and not _is_proportional(term):
        raise ValueError(f"{term.__name__} is not proportional to a Fresnel factor: no other can take its place")
    kept = [name for name in own if name not in replaced]

    @functools.wraps(term)
    def product(g: Geometry, **shape: Array) -> Array:
        bare = term(g, **{name: shape[name] for name in kept}, **replaced)
        own_factor = unpolarised(g.cos_beta, *GLASS.values()) if replaced else 1.0
        return factor(g, **{name: shape[name] for name in added}) * (bare / own_factor)

    hints = get_type_hints(term, include_extras=True) | get_type_hints(factor, include_extras=True)
    names = dict.fromkeys([*kept, *added])
    product.__annotations__ = {name: hints[name] for name in names}
    product.__annotations__["return"] = get_type_hints(term, include_extras=True)["return"]
    by_name = inspect.Parameter.KEYWORD_ONLY
    first = inspect.Parameter("g", inspect.Parameter.POSITIONAL_ONLY)
    product.__signature__ = inspect.Signature([first, *(inspect.Parameter(name, by_name) for name in names)])  # type: ignore[attr-defined]
    product.__doc__ = f"The facets of {term.__name__} with the reflectance {factor.__name__}."
    return product


def _is_proportional(term: Term) -> bool:
    """Whether a term depends on its index as a Fresnel factor does, seen at a few pairs of directions."""
    shape = {name: p.default for name, p in declarations(term).items()}
    for pair in ((10.0, 25.0, 180.0), (50.0, 30.0, 60.0), (65.0, 75.0, 170.0)):
        g = Geometry.from_degrees(*pair)
        constants = (tuple(GLASS.values()), (1.37, 7.62))
        found = [term(g, **shape | dict(zip(CONSTANTS, pair_of, strict=True))) for pair_of in constants]
        factors = [unpolarised(g.cos_beta, *pair_of) for pair_of in constants]
        if getattr(found[0], "ndim", 0) or not math.isclose(found[0] * factors[1], found[1] * factors[0], rel_tol=1e-9):
            return False
    return True


def schlick(cos_beta: Array, f0: Array) -> Array:
    r"""Schlick's approximation from the reflectance at normal incidence.

    .. math::

        F = F_0 + (1 - F_0)(1 - \cos\beta)^5
    """
    return f0 + (1 - f0) * (1 - cos_beta) ** 5
