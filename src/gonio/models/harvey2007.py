"""Modified Beckmann-Kirchhoff: scatter renormalised to carry what roughness takes from the mirror direction."""

import math
from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import GRAZING, Geometry
from gonio.model import Model, Parameter, PerSteradian, drawn_by
from gonio.optics.fresnel import Extinction, Index, unpolarised
from gonio.optics.kirchhoff import DIFFRACTED, CorrelationLength, Wavelength, diffracted, poisson_mean
from gonio.optics.quadrature import for_each, once_each, unit_interval
from gonio.units import to_radians

RmsHeight = Annotated[float, Parameter(0.05, 0.001, 10.0, "rms height of the surface", "um")]


@drawn_by(DIFFRACTED)
def renormalised(
    g: Geometry,
    sigma: RmsHeight,
    length: CorrelationLength,
    index: Index,
    extinction: Extinction,
    wavelength: Wavelength,
) -> PerSteradian:
    r"""Scatter of any roughness and angle, without the light in the mirror direction (harvey2007; formulas 7.7).

    It reflects 1 - exp(-g) of the light times the reflectance, where that changes little over the lobe.

    .. math::

        \begin{aligned}
        f_s &= F(\beta)\,\frac{1 - \mathrm{e}^{-g_0}}{E}\,K \\
        E &= \int K\cos\theta_r\,\mathrm{d}\omega_r \\
        g_0 &= \left(\frac{4\pi\sigma\cos\theta_i}{\lambda}\right)^2
        \end{aligned}

    where F is Fresnel's reflectance (:func:`.unpolarised`) and K the light diffracted by heights of rms sigma and
    correlation length :math:`\ell` (:func:`.diffracted`), integrated over the hemisphere of :math:`\omega_r`.
    """
    theta = to_radians(g.theta_i_deg)
    gain = for_each(lambda *shape: renormalisation(theta, *shape), sigma, length, wavelength)
    return unpolarised(g.cos_beta, index, extinction) * gain * diffracted(g, sigma, length, wavelength)


@once_each
def renormalisation(theta: Array, sigma: Array, length: Array, wavelength: Array) -> Array:
    """What the mirror direction loses over what the kernel scatters, for light that arrives at `theta` [rad].

    By quadrature over theta_r, the azimuth being a Bessel function; good to 3e-7 at every height and length.

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
    lobe = poisson_mean(_order, (k * (cos + cos_r)) ** 2, (a * shift) ** 2, 2 * a**2 * sin * sin_r)
    density = lobe * sin_r * cos_r
    scattered = 2 * a**2 * xp.sum((end - start) * weights * width * xp.cosh(s) * density, axis=-1, keepdims=True)
    lost = xp.tanh(mirror / 2) * (1 + xp.exp(-mirror))  # 1 - exp(-g), with its digits where smooth
    return (lost / scattered)[..., 0]


def _order(m: Array, tail: Array, around: Array) -> Array:
    """The light diffracted into one order at any azimuth, over its probability."""
    return namespace(m).exp(-tail / m) * _bessel(around / m) / m


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
