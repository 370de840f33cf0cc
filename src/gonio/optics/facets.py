"""Distributions of facet normals and the facet terms that models share (formulas 2).

Every distribution is normalised to projected area: its integral times cos(alpha) over the hemisphere is 1, so that
`reflected` has the energy of the light that arrives. Equal ones share one implementation: GGX and the hyper-Cauchy
are Student's t, the Gaussian is Beckmann's with m = sqrt(2) sigma. A second width `across` makes one elliptical.
"""

import math
from typing import Annotated

from gonio.arrays import Array, namespace, special
from gonio.geometry import Geometry
from gonio.model import Parameter, PerSteradian, drawn_by
from gonio.optics.distributions import draw_gaussian
from gonio.optics.masking import v_groove
from gonio.optics.sampling import FacetNormals

MIRROR = 1e-30  # squared slope, in units of the width, below which a facet is not tilted

Slope = Annotated[float, Parameter(0.2, 0.01, 1.0, "rms slope of the facets, per axis")]
TotalSlope = Annotated[float, Parameter(0.3, 0.01, 1.4, "rms slope of the facets, total")]
Width = Annotated[float, Parameter(0.3, 0.01, 1.0, "width of the distribution of facet slopes")]


def beckmann_slopes(g: Geometry, m: Array, across: Array | None = None) -> Array:
    r"""Beckmann's Gaussian: `m` is the total rms slope.

    .. math::

        D = \frac{1}{\pi m^2\cos^4\alpha} \exp\left(-\frac{\tan^2\alpha}{m^2}\right)
    """
    squared, per_slope = _slopes(g, m, across)
    return per_slope * namespace(squared).exp(-squared)


def gaussian_slopes(g: Geometry, sigma: Array) -> Array:
    """The same from the rms slope per axis."""
    return beckmann_slopes(g, math.sqrt(2) * sigma)


def student_slopes(g: Geometry, width: Array, c: Array, across: Array | None = None) -> Array:
    r"""Student's t of exponent `c` > 1: heavier tails than Gaussian, GGX at c = 2, Beckmann as c grows.

    .. math::

        D = \frac{1}{\pi w^2\cos^4\alpha} \left(1 + \frac{\tan^2\alpha}{(c - 1)\,w^2}\right)^{-c}
    """
    squared, per_slope = _slopes(g, width, across)
    return per_slope * (1 + squared / (c - 1)) ** (-c)


def ggx_slopes(g: Geometry, width: Array, across: Array | None = None) -> Array:
    r"""Trowbridge and Reitz's distribution, called GGX (walter2007).

    .. math::

        D = \frac{w^2}{\pi\cos^4\alpha\,(w^2 + \tan^2\alpha)^2}
    """
    squared, per_slope = _slopes(g, width, across)
    return per_slope * (1 / (1 + squared) ** 2)


def exponential_power_slopes(g: Geometry, width: Array, p: Array) -> Array:
    r"""The exponential of a power of the slope: Beckmann at p = 1, exponential at 1/2 (holzschuch2017).

    .. math::

        D = \frac{p}{\pi w^2\,\Gamma(1/p)\,\cos^4\alpha} \exp\left(-\left(\frac{\tan^2\alpha}{w^2}\right)^p\right)

    where :math:`\Gamma` is the gamma function.
    """
    squared, per_slope = _slopes(g, width, None)
    xp = namespace(squared)
    # the mirror direction has no logarithm, and a power below 1 no slope there
    power = xp.where(squared < MIRROR, MIRROR, squared) ** p
    return per_slope * p * xp.exp(-power - special("gammaln", 1 / p))


def hyper_cauchy_slopes(g: Geometry, s: Array, q: Array) -> Array:
    r"""The hyper-Cauchy distribution (wellems2006) is Student's t of width s sqrt(2/(q - 1)).

    .. math::

        D = \frac{(q - 1)\,2^{q - 1}}{\pi s^2\cos^4\alpha\,(2 + \tan^2\alpha/s^2)^q}
    """
    return student_slopes(g, s * (2 / (q - 1)) ** 0.5, q)


def cosine_power_normals(g: Geometry, n: Array) -> Array:
    r"""Blinn's power of the cosine of the tilt (blinn1977).

    .. math::

        D = \frac{n + 2}{2\pi}\cos^n\alpha
    """
    return (n + 2) / (2 * math.pi) * g.cos_alpha**n


def gtr_normals(g: Geometry, width: Array, c: Array) -> Array:
    r"""Generalised Trowbridge and Reitz: GGX at c = 2, longer tails at 1, where it has a logarithm (burley2012).

    The constant is a quotient of (exp(u) - 1)/u, of which neither c = 1 nor a width of 1 is a special case.

    .. math::

        \begin{aligned}
        D &= \frac{K}{(w^2\cos^2\alpha + \sin^2\alpha)^c} \\
        K &= \frac{(c - 1)(1 - w^2)}{\pi\,(w^{2 - 2c} - 1)}
        \end{aligned}

    where :math:`K = (w^2 - 1)/(\pi\ln w^2)` at :math:`c = 1` and :math:`K = 1/\pi` at :math:`w = 1`.
    """
    # g^2 cos^2 + sin^2 in a form that keeps its digits where the tilt is small and g is a thousandth
    return _gtr_constant(width, c) / (math.pi * (g.cos_alpha**2 * (width**2 + g.tan_alpha_squared)) ** c)


def elliptical_gtr_normals(g: Geometry, width: Array, c: Array, ratio: Array) -> Array:
    """The same with slopes stretched along the x axis by sqrt(ratio) and along y by its inverse: as many normals."""
    squared = g.slope_x**2 / ratio + g.slope_y**2 * ratio  # before the stretch
    of_stretched = ((1 + g.tan_alpha_squared) / (1 + squared)) ** 2
    isotropic = _gtr_constant(width, c) / math.pi * ((1 + squared) / (width**2 + squared)) ** c
    return isotropic * of_stretched


def _gtr_constant(width: Array, c: Array) -> Array:
    logarithm = namespace(width).log(width**2)
    return _mean_exponential(logarithm) / _mean_exponential((1 - c) * logarithm)


def reflected(g: Geometry, normals: Array, masking: Array) -> Array:
    """Single reflection from facets: D G/(4 cos theta_i cos theta_r) (formulas 2.0)."""
    return normals * masking / (4 * g.cos_i * g.cos_r)


@drawn_by(FacetNormals(gaussian_slopes, draw_gaussian, of=lambda sigma, **_: (sigma,)))
def gaussian_facets(g: Geometry, sigma: Slope) -> PerSteradian:
    r"""Single reflection from Gaussian facets in V-grooves, without Fresnel factor (guo2023, eqs 3 and 4).

    .. math::

        \begin{aligned}
        f_s &= \frac{D\,G}{4\cos\theta_i\cos\theta_r} \\
        D &= \frac{1}{2\pi\sigma^2\cos^4\alpha} \exp\left(-\frac{\tan^2\alpha}{2\sigma^2}\right)
        \end{aligned}

    where G is the masking and shadowing by V-grooves (:func:`.v_groove`).
    """
    return reflected(g, gaussian_slopes(g, sigma), v_groove(g))


def _slopes(g: Geometry, along: Array, across: Array | None) -> tuple[Array, Array]:
    """Squared slope in units of the width, and 1/(pi width^2 cos^4), which turns a density of slopes into normals.

    With a second width the distribution is elliptical: `along` is that of slopes along the surface's x axis.
    """
    tan2 = g.tan_alpha_squared
    squared = tan2 * (1 / along**2) if across is None else (g.slope_x / along) ** 2 + (g.slope_y / across) ** 2
    return squared, (1 + tan2) ** 2 / (math.pi * along * (along if across is None else across))


def _mean_exponential(u: Array) -> Array:
    """Mean of exp between 0 and u, (exp(u) - 1)/u."""
    half = u / 2
    xp = namespace(half)
    small = xp.abs(half) < 1e-5
    return xp.exp(half) * xp.where(small, 1 + half**2 / 6, xp.sinh(half) / xp.where(small, 1.0, half))
