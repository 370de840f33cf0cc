"""Scalar diffraction from Gaussian rough surfaces, and the variables that scatter models share (formulas 7.6, 7.7).

The specular delta, which keeps exp(-g) of the light, is part of no function here: it has no finite BRDF.
"""

import math
from typing import Annotated

from gonio.arrays import Array, constants, namespace
from gonio.geometry import Geometry
from gonio.model import Parameter

Wavelength = Annotated[float, Parameter(0.6328, 0.1, 20.0, "wavelength", "um")]
CorrelationLength = Annotated[float, Parameter(2.0, 0.1, 100.0, "1/e length of the height autocorrelation", "um")]

_ROUGH = 40.0  # g from which the terms of the series are sampled
_INTEGERS = [float(m) for m in range(1, 129)]
_LOG_FACTORIALS = [math.lgamma(m + 1.0) for m in _INTEGERS]
_SPREAD = [-6.0 + 20.0 * k / 127 for k in range(128)]  # reaches from term 2 to term 128 at g = 40
_STEP = 20.0 / 127


def shift_squared(g: Geometry) -> Array:
    """Squared distance to the mirror direction in direction cosines: (2 cos beta sin alpha)^2 (formulas 0)."""
    x, y = g.x_i + g.x_r, g.y_i + g.y_r
    return x * x + y * y


def phase_variance(g: Geometry, rms_height: Array, wavelength: Array) -> Array:
    """The g of scatter theory: variance of the optical phase that the heights give [rad^2] (formulas 7.7)."""
    return (2 * math.pi * rms_height / wavelength * (g.cos_i + g.cos_r)) ** 2


def diffracted(g: Geometry, rms_height: Array, length: Array, wavelength: Array) -> Array:
    """The kernel K [1/sr] of heights with Gaussian autocorrelation, for any roughness (formulas 7.7)."""
    variance = phase_variance(g, rms_height, wavelength)
    tail = (math.pi * length / wavelength) ** 2 * shift_squared(g)
    return math.pi * (length / wavelength) ** 2 * _poisson_mean(variance, tail)


def kirchhoff_obliquity(g: Geometry) -> Array:
    """Square of the Kirchhoff obliquity over both cosines: cos^2 b/(cos^2 a cos theta_i cos theta_r)."""
    return (g.cos_beta / g.cos_alpha) ** 2 / (g.cos_i * g.cos_r)


def _poisson_mean(variance: Array, tail: Array) -> Array:
    """Mean of exp(-tail/m)/m, m > 0, over Poisson numbers of this variance: e^-g sum_m g^m/(m! m) exp(-tail/m).

    All terms up to g = 40. Beyond, as many samples of the sum at spacings of a sixth of its standard deviation: the
    trapezium rule is then exact to rounding, so both branches meet without a step and no roughness is too large.
    """
    xp = namespace(variance)
    v, t = variance[..., None], tail[..., None]
    integers, log_factorials = constants(_INTEGERS, variance), constants(_LOG_FACTORIALS, variance)
    rough = v > _ROUGH
    wide = xp.where(rough, v, _ROUGH)
    m = wide + xp.sqrt(wide) * constants(_SPREAD, variance)
    stirling = m - wide + m * xp.log(wide / m) - xp.log(2 * math.pi * m) / 2 - 1 / (12 * m) + 1 / (360 * m**3)
    exact = integers * xp.log(v) - v - log_factorials
    order = xp.where(rough, m, integers)
    spacing = xp.where(rough, _STEP * xp.sqrt(wide), 1.0)
    return xp.sum(spacing * xp.exp(xp.where(rough, stirling, exact) - t / order) / order, axis=-1)
