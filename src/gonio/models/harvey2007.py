"""Modified Beckmann-Kirchhoff: scatter renormalised to carry what roughness takes from the mirror direction."""

import math
from typing import Annotated

from gonio.arrays import Array, constants, is_traced_never, namespace
from gonio.geometry import GRAZING, Geometry
from gonio.model import Model, Parameter, PerSteradian
from gonio.optics.fresnel import Extinction, Index, unpolarised
from gonio.optics.kirchhoff import CorrelationLength, Wavelength, diffracted
from gonio.optics.quadrature import unit_interval
from gonio.units import to_radians

RmsHeight = Annotated[float, Parameter(0.05, 0.001, 10.0, "rms height of the surface", "um")]

_TERMS = 64
_ROUGH = 24.0  # phase variance from which the orders of diffraction are sampled
_ORDERS = [m + 1.0 for m in range(_TERMS)]
_LOG_FACTORIALS = [math.lgamma(m + 1) for m in _ORDERS]
_STEP = 6.5 / (_TERMS - 1)
_SPREAD = [-3.0 + k * _STEP for k in range(_TERMS)]  # the root of a Poisson number has a standard deviation of 1/2


def renormalised(
    g: Geometry,
    sigma: RmsHeight,
    length: CorrelationLength,
    index: Index,
    extinction: Extinction,
    wavelength: Wavelength,
) -> PerSteradian:
    """Scatter of any roughness and angle, without the light in the mirror direction (harvey2007; formulas 7.7).

    It reflects 1 - exp(-g) of the light times the reflectance, where that changes little over the lobe.
    """
    gain = renormalisation(to_radians(g.theta_i_deg), sigma, length, wavelength)
    return unpolarised(g.cos_beta, index, extinction) * gain * diffracted(g, sigma, length, wavelength)


def renormalisation(theta: Array, sigma: Array, length: Array, wavelength: Array) -> Array:
    """What the mirror direction loses over what the kernel scatters, for light that arrives at `theta` [rad]."""
    if not is_traced_never(theta):
        return _lost_over_scattered(theta, sigma, length, wavelength)
    # a scan has few angles of incidence, and only NumPy can tell how many
    xp = namespace(theta)
    given = xp.broadcast_arrays(theta, sigma, length, wavelength)
    distinct, where = xp.unique(xp.stack([xp.reshape(a, (-1,)) for a in given]), axis=1, return_inverse=True)
    return xp.reshape(_lost_over_scattered(*distinct)[where], given[0].shape)


def _lost_over_scattered(theta: Array, sigma: Array, length: Array, wavelength: Array) -> Array:
    """By quadrature over theta_r, the azimuth being a Bessel function; good to 3e-7 at every height and length.

    The nodes lie about the mirror angle, at distances that grow as a sinh from the width of the lobe on.
    """
    xp = namespace(theta)
    theta, a, k = (
        theta[..., None],
        (math.pi * length / wavelength)[..., None],
        (2 * math.pi * sigma / wavelength)[..., None],
    )
    sin, cos = xp.sin(theta), xp.cos(theta)
    cos = xp.where(cos < GRAZING, GRAZING, cos)
    mirror, most = (2 * k * cos) ** 2, (k * (1 + cos)) ** 2
    reach = 6 * xp.sqrt(most + 6 * xp.sqrt(most) + 8) / a  # direction cosines from the mirror to where nothing is left
    inner, outer = sin - reach, sin + reach
    least = xp.asin(xp.where(inner > 0, inner, 0.0))
    greatest = xp.where(outer < 1, xp.asin(xp.where(outer < 1, outer, 0.0)), math.pi / 2)
    width = xp.sqrt(1 + mirror) / a
    width = width / (cos + xp.sqrt(width))  # from direction cosines to angles, also at grazing
    width = width / (1 + width)
    start, end = xp.asinh((least - theta) / width), xp.asinh((greatest - theta) / width)
    nodes, weights = unit_interval(48, theta)
    s = start + (end - start) * nodes
    apart = width * xp.sinh(s)
    sin_r, cos_r = xp.sin(theta + apart), xp.cos(theta + apart)
    shift = 2 * xp.cos(theta + apart / 2) * xp.sin(apart / 2)  # sin_r - sin, with its digits near the mirror
    m, probability = _orders((k * (cos + cos_r)) ** 2)
    lobe = xp.exp(-((a * shift) ** 2)[..., None] / m) * _bessel((2 * a**2 * sin * sin_r)[..., None] / m)
    density = xp.sum(probability * lobe / m, axis=-1) * sin_r * cos_r
    scattered = 2 * a**2 * xp.sum((end - start) * weights * width * xp.cosh(s) * density, axis=-1, keepdims=True)
    lost = xp.tanh(mirror / 2) * (1 + xp.exp(-mirror))  # 1 - exp(-g), with its digits where smooth
    return (lost / scattered)[..., 0]


def _orders(variance: Array) -> tuple[Array, Array]:
    """Orders of diffraction m > 0 and their Poisson probabilities, for a mean over them.

    All orders where the surface is smooth; else samples at even spacings of sqrt(m), which is nearly Gaussian.
    """
    xp = namespace(variance)
    v = variance[..., None]
    rough = v > _ROUGH
    root, spread = xp.sqrt(xp.where(rough, v, _ROUGH)), constants(_SPREAD, variance)
    sampled = (root + spread) ** 2
    # Stirling's formula in terms of sqrt(m/v); log(1 + x) is 2 atanh(x/(2 + x))
    ratio = spread / root
    stirling = spread * (2 * root + spread) - 4 * sampled * xp.atanh(ratio / (2 + ratio))
    stirling = stirling - xp.log(2 * math.pi * sampled) / 2 - 1 / (12 * sampled) + 1 / (360 * sampled**3)
    integers = constants(_ORDERS, variance)
    exact = integers * xp.log(v) - v - constants(_LOG_FACTORIALS, variance)
    spacing = xp.where(rough, 2 * _STEP * (root + spread), 1.0)
    return xp.where(rough, sampled, integers), spacing * xp.exp(xp.where(rough, stirling, exact))


def _bessel(x: Array) -> Array:
    """exp(-x) I0(x) to 2e-7 (Abramowitz and Stegun 9.8.1 and 9.8.2), which not every array library has."""
    xp = namespace(x)
    near = x < 3.75
    t = (xp.where(near, x, 3.75) / 3.75) ** 2
    small = _polynomial(t, (1.0, 3.5156229, 3.0899424, 1.2067492, 0.2659732, 0.0360768, 0.0045813))
    far = xp.where(near, 3.75, x)
    large = _polynomial(
        3.75 / far,
        (
            0.39894228, 0.01328592, 0.00225319, -0.00157565, 0.00916281,
            -0.02057706, 0.02635537, -0.01647633, 0.00392377,
        ),
    )  # fmt: skip
    return xp.where(near, xp.exp(-xp.where(near, x, 0.0)) * small, large / xp.sqrt(far))


def _polynomial(t: Array, coefficients: tuple[float, ...]) -> Array:
    total = coefficients[-1] + 0 * t
    for c in coefficients[-2::-1]:
        total = total * t + c
    return total


modified_beckmann_kirchhoff = Model(
    name="modified-beckmann-kirchhoff",
    title="Modified Beckmann-Kirchhoff",
    cite="harvey2007",
    terms={"scale": renormalised},
    violates={"reciprocity": "the renormalisation depends on theta_i alone"},
    confidence="reconstructed",
)
