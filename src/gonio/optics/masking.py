"""Masking and shadowing of facets by their neighbours (formulas 3)."""

import math

from gonio.arrays import Array, namespace, special
from gonio.geometry import Geometry
from gonio.optics.quadrature import once_each, unit_interval
from gonio.units import to_degrees


def v_groove(g: Geometry) -> Array:
    r"""Torrance and Sparrow's V-grooves (guo2023, eq 4): 1, or the unblocked part of the narrower direction.

    .. math::

        G = \min\left(1, \frac{2\cos\alpha\cos\theta_r}{\cos\beta}, \frac{2\cos\alpha\cos\theta_i}{\cos\beta}\right)
    """
    xp = namespace(g.cos_i)
    unblocked = 2 * xp.where(g.cos_i < g.cos_r, g.cos_i, g.cos_r) * g.cos_ratio
    return xp.where(unblocked > 1.0, 1.0, unblocked)


def smith(lambda_i: Array, lambda_r: Array) -> Array:
    r"""Smith's height-correlated masking and shadowing from the two Lambda functions (formulas 3.2).

    .. math::

        G = \frac{1}{1 + \Lambda(\theta_i) + \Lambda(\theta_r)}
    """
    return 1 / (1 + lambda_i + lambda_r)


def smith_uncorrelated(lambda_i: Array, lambda_r: Array) -> Array:
    """The product of Smith's masking of each direction alone: too low where both directions reach the same facets."""
    return 1 / ((1 + lambda_i) * (1 + lambda_r))


def van_ginneken(g: Geometry, lambda_i: Array, lambda_r: Array) -> Array:
    r"""Smith's masking and shadowing, correlated by the azimuth between the directions (vanginneken1998).

    Where the azimuths agree, every lit facet is visible, and only the larger Lambda counts. At opposite azimuths it is
    nearly `smith`, whose only correlation is that of the heights.

    .. math::

        \begin{aligned}
        G &= \frac{1}{1 + \max(\Lambda_i, \Lambda_r) + \eta\min(\Lambda_i, \Lambda_r)} \\
        \Lambda_i &= \Lambda(\theta_i) \\
        \Lambda_r &= \Lambda(\theta_r) \\
        \eta &= \frac{4.41\,\varphi}{4.41\,\varphi + 1}
        \end{aligned}

    where :math:`\varphi` is the angle between the azimuths, 0 to :math:`\pi` [rad].
    """
    xp = namespace(lambda_i)
    correlation = 4.41 * _azimuth(g)
    both = correlation / (correlation + 1)
    steeper_i = lambda_i > lambda_r
    larger = xp.where(steeper_i, lambda_i, lambda_r)
    return 1 / (1 + larger + both * xp.where(steeper_i, lambda_r, lambda_i))


def shadowing_and_obscuration(g: Geometry, tau: Array, omega: Array) -> Array:
    r"""Maxwell and Beard's shadowing and obscuration; `tau` and `omega` in degrees (formulas 3.4).

    .. math::

        S = \frac{1 + (\alpha/\Omega)\exp(-2\beta/\tau)}{1 + \alpha/\Omega}

    where all angles are in degrees.
    """
    xp = namespace(g.z_i)
    x, y, z = g.x_i + g.x_r, g.y_i + g.y_r, g.z_i + g.z_r
    across = _length(g.x_i - g.x_r, g.y_i - g.y_r, g.z_i - g.z_r)
    alpha = to_degrees(xp.atan2(_length(x, y, 0 * z), z))
    beta = to_degrees(xp.atan2(across, _length(x, y, z)))
    return (1 + alpha / omega * xp.exp(-2 * beta / tau)) / (1 + alpha / omega)


def beckmann_lambda(cos: Array, m: Array) -> Array:
    r"""Smith's Lambda of Gaussian slopes of total rms m, for a direction of this cosine.

    .. math::

        \begin{aligned}
        \Lambda(\theta) &= \frac{\operatorname{erf}(x) - 1}{2} + \frac{\exp(-x^2)}{2x\sqrt{\pi}} \\
        x &= \frac{\cot\theta}{m}
        \end{aligned}
    """
    return _beckmann_at(cos / (m * _sine(cos)))


def elliptical_beckmann_lambda(x: Array, y: Array, z: Array, along: Array, across: Array) -> Array:
    """Smith's Lambda of Gaussian slopes, sqrt(2) times their rms `along` and `across` the x axis (heitz2014smith)."""
    return _beckmann_at(z / _reach(x, y, along, across))


def _beckmann_at(x: Array) -> Array:
    """Lambda at a cotangent in units of the width."""
    xp = namespace(x)
    return (special("erf", x) - 1) / 2 + xp.exp(-(x**2)) / (2 * math.sqrt(math.pi) * x)


def ggx_lambda(cos: Array, width: Array) -> Array:
    """Smith's Lambda of GGX slopes."""
    xp = namespace(cos)
    return (xp.sqrt(1 + width**2 * (1 - cos**2) / cos**2) - 1) / 2


def elliptical_ggx_lambda(x: Array, y: Array, z: Array, along: Array, across: Array) -> Array:
    """Smith's Lambda of GGX slopes of width `along` and `across` the x axis, for a direction (x, y, z).

    A direction meets the slopes along its own azimuth alone, of squared width (along^2 x^2 + across^2 y^2)/(x^2 + y^2)
    (burley2012, smithG_GGX_aniso).
    """
    return (namespace(z).sqrt(1 + ((along * x) ** 2 + (across * y) ** 2) / z**2) - 1) / 2


def ggx_visibility(g: Geometry, width: Array) -> Array:
    r"""G/(4 cos theta_i cos theta_r), G being Smith's height-correlated masking of GGX slopes (formulas 3.2).

    (1 + 2 Lambda) cos is a root that no cosine divides: finite at grazing, and a fifth of the work.

    .. math::

        \begin{aligned}
        G &= \frac{2\cos\theta_i\cos\theta_r}{R(\theta_i)\cos\theta_r + R(\theta_r)\cos\theta_i} \\
        R(\theta) &= \sqrt{\cos^2\theta + w^2\sin^2\theta}
        \end{aligned}
    """
    return 0.5 / (g.cos_r * _ggx_root(g.cos_i, width) + g.cos_i * _ggx_root(g.cos_r, width))


def _ggx_root(cos: Array, width: Array) -> Array:
    return namespace(cos).sqrt(cos**2 + width**2 * (1 - cos**2))


def _reach(x: Array, y: Array, along: Array, across: Array) -> Array:
    """Sine of the polar angle times the width at the azimuth of (x, y), kept above zero as `_sine` is."""
    squared = (along * x) ** 2 + (across * y) ** 2
    xp = namespace(squared)
    return xp.sqrt(xp.where(squared < 1e-18, 1e-18, squared))


def _sine(cos: Array) -> Array:
    """Sine of the polar angle, kept above zero so that the normal direction has a finite, vanishing Lambda."""
    xp = namespace(cos)
    squared = 1 - cos**2
    return xp.sqrt(xp.where(squared < 1e-12, 1e-12, squared))


@once_each
def student_lambda(cos: Array, width: Array, c: Array) -> Array:
    r"""Smith's Lambda of Student's t slopes, c > 1.5: the exact form, its hypergeometric part by quadrature.

    x 2F1(1/2, c - 1/2; 3/2; -x^2/(c - 1)) is the integral of (1 + u^2/(c - 1))^(1/2 - c) from 0 to x; after
    u = sqrt(c - 1) sinh(s) the integrand is smooth in s and traces in any array library.

    .. math::

        \begin{aligned}
        \Lambda(\theta) &= E\left(\frac{(c - 1)^c}{2c - 3}\,S_1 + \sqrt{c - 1}\,S_2\right) - \frac{1}{2} \\
        E &= \frac{\Gamma(c - 1/2)}{\Gamma(c)\,\sqrt{\pi}} \\
        S_1 &= \frac{(c - 1 + x^2)^{3/2 - c}}{x} \\
        S_2 &= \int_0^x \left(1 + \frac{u^2}{c - 1}\right)^{1/2 - c}\,\mathrm{d}u \\
        x &= \frac{\cot\theta}{w}
        \end{aligned}

    where :math:`\Gamma` is the gamma function.
    """
    return _student_at(cos / (width * _sine(cos)), c)


@once_each
def elliptical_student_lambda(x: Array, y: Array, z: Array, along: Array, across: Array, c: Array) -> Array:
    """Smith's Lambda of Student's t slopes of width `along` and `across` the x axis (heitz2014smith), as above."""
    return _student_at(z / _reach(x, y, along, across), c)


def _student_at(x: Array, c: Array) -> Array:
    """Lambda at a cotangent in units of the width."""
    xp = namespace(x)
    root = (c - 1) ** 0.5
    end = xp.asinh(x / root)
    nodes, weights = unit_interval(96, x)
    s = end[..., None] * nodes
    cosh_power = xp.exp((2 - 2 * c)[..., None] * xp.log(xp.cosh(s)))
    second = root * end * xp.sum(weights * cosh_power, axis=-1)
    first = (c - 1 + x**2) ** (1.5 - c) / x
    scale = xp.exp(special("gammaln", c - 0.5) - special("gammaln", c)) / math.sqrt(math.pi)
    smith_lambda = scale * ((c - 1) ** c / (2 * c - 3) * first + root * second) - 0.5
    return xp.where(smith_lambda < 0.0, 0.0, smith_lambda)


@once_each
def exponential_power_lambda(cos: Array, width: Array, p: Array) -> Array:
    r"""Smith's Lambda of exponential-power slopes, by quadrature, good to 1e-9 for p from 0.2 to 1.5.

    For isotropic slopes of density P(r) it is 2 int (h - atan h) P(r) r dr over r > cot(theta), h = tan(acos(cot/r)).
    After h = sinh(s) the integrand is smooth up to grazing, where it spans orders of magnitude of r.

    .. math::

        \begin{aligned}
        \Lambda(\theta) &= E\int_x^{\infty} (h - \arctan h)\,\exp(-r^{2p})\,r\,\mathrm{d}r \\
        E &= \frac{2p}{\pi\,\Gamma(1/p)} \\
        h &= \sqrt{r^2/x^2 - 1} \\
        x &= \frac{\cot\theta}{w}
        \end{aligned}

    where r is the slope in units of the width.
    """
    xp = namespace(cos)
    x = cos / (width * _sine(cos))
    nearest = x ** (
        2 * p
    )  # exponent of the least slope that hides the direction; steeper ones count over the next 40 or so
    reach = (40 + 4 / p) / xp.where(nearest > 1e3, 1e3, nearest)
    end = xp.asinh(xp.sqrt((1 + reach) ** (1 / p) - 1))
    start = xp.where(end > 14.0, end - 14, 0.0)  # the integrand grows as e^(3 s)
    nodes, weights = unit_interval(64, x)
    s = start[..., None] + (end - start)[..., None] * nodes
    h, cosh = xp.sinh(s), xp.cosh(s)
    density = xp.exp(-nearest[..., None] * xp.exp(2 * p[..., None] * xp.log(cosh)))
    integral = (end - start) * xp.sum(weights * density * h * cosh * (h - xp.atan(h)), axis=-1)
    return 2 * p * x**2 / math.pi * xp.exp(-special("gammaln", 1 / p)) * integral


def _azimuth(g: Geometry) -> Array:
    """Angle between the azimuths of the directions, 0 to pi [rad]; 0 where one is the normal and has none."""
    xp = namespace(g.z_i)
    along, across = g.x_i * g.x_r + g.y_i * g.y_r, xp.abs(g.x_i * g.y_r - g.y_i * g.x_r)
    at_pole = along**2 + across**2 < 1e-36
    return xp.where(at_pole, 0.0, xp.atan2(across, xp.where(at_pole, 1.0, along)))


def _length(x: Array, y: Array, z: Array) -> Array:
    """Length of a vector, with gradient 0 where it vanishes."""
    xp = namespace(x)
    squared = x * x + y * y + z * z
    nothing = squared == 0
    return xp.where(nothing, 0.0, xp.sqrt(xp.where(nothing, 1.0, squared)))
