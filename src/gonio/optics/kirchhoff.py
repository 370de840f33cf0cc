"""Scalar diffraction from Gaussian rough surfaces, and the variables that scatter models share (formulas 7.6, 7.7).

The specular delta, with its share exp(-g) of the light, is in none of these functions: it has no finite BRDF.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

from gonio.arrays import Array, constants, is_traced_never, namespace
from gonio.geometry import Geometry
from gonio.model import Parameter
from gonio.optics.distributions import draw_student
from gonio.optics.facets import student_slopes
from gonio.optics.quadrature import for_each
from gonio.optics.sampling import Either, FacetNormals, ShiftedPower

Wavelength = Annotated[float, Parameter(0.6328, 0.1, 20.0, "wavelength", "um")]
CorrelationLength = Annotated[float, Parameter(2.0, 0.1, 100.0, "1/e length of the height autocorrelation", "um")]

_ROUGH = 40.0  # variance from which Poisson numbers are sampled
_NUMBERS = [float(m) for m in range(1, 129)]
_LOG_FACTORIALS = [math.lgamma(m + 1.0) for m in _NUMBERS]
_STEP = 0.25
_SPREAD = [_STEP * k - 4 for k in range(41)]  # the root of a Poisson number has a standard deviation of 1/2
_COUNTS = (16, 32, 64, 128)  # lengths of sums: each value gets the shortest that suffices
_PORTION = 2**15  # terms at once: they fit into a processor's cache


FALL = 3.0  # exponent of the power laws that are drawn: slower than any order, so that no light is missed
STEEPEST = 1.0  # slopes that are drawn, beyond which most facets mirror the light below the horizon


@dataclass(frozen=True)
class _AboutMirror:
    """A power law about the mirror direction as wide as the orders there, exp(-(pi length distance/wavelength)^2/m)."""

    def draw(
        self, x_i: Array, y_i: Array, z_i: Array, u: Array, v: Array, /, **shape: Array
    ) -> tuple[Array, Array, Array]:
        return self._law(z_i).draw(x_i, y_i, z_i, u, v, **shape)

    def density(self, g: Geometry, /, **shape: Array) -> Array:
        return self._law(g.z_i).density(g, **shape)

    def _law(self, cos_i: Array) -> ShiftedPower:
        def of(sigma: Array, length: Array, wavelength: Array, **_: Array) -> tuple[Array, Array]:
            orders = 1 + (4 * math.pi * sigma / wavelength * cos_i) ** 2
            return 2 / FALL * (math.pi * length / wavelength) ** 2 / orders, FALL + 0 * length

        return ShiftedPower(of=of)


def _rough_facets(sigma: Array, length: Array, wavelength: Array, **_: Array) -> tuple[Array, Array]:
    """Slopes of a rough surface, of total rms 2 sigma/length, but not narrower than the first order at the normal."""
    slope = ((2 * sigma / length) ** 2 + (wavelength / (2 * math.pi * length)) ** 2) ** 0.5
    return namespace(slope).where(slope > STEEPEST, STEEPEST, slope), FALL + 0 * slope


# Smooth surfaces diffract a lobe of one width in direction cosines, rough ones reflect as facets do.
DIFFRACTED = Either(_AboutMirror(), FacetNormals(student_slopes, draw_student, of=_rough_facets), share=0.5)


def shift_squared(g: Geometry) -> Array:
    r"""Squared distance to the mirror direction in direction cosines: (2 cos beta sin alpha)^2 (formulas 0).

    .. math::

        \Delta = 2\cos\beta\sin\alpha
    """
    x, y = g.x_i + g.x_r, g.y_i + g.y_r
    return x * x + y * y


def phase_variance(g: Geometry, rms_height: Array, wavelength: Array) -> Array:
    """The g of scatter theory: variance of the optical phase due to the heights [rad^2] (formulas 7.7)."""
    return (2 * math.pi * rms_height / wavelength * (g.cos_i + g.cos_r)) ** 2


def diffracted(g: Geometry, rms_height: Array, length: Array, wavelength: Array) -> Array:
    r"""The kernel K [1/sr] of heights with Gaussian autocorrelation, for any roughness (formulas 7.7).

    .. math::

        \begin{aligned}
        K &= \frac{\pi\ell^2}{\lambda^2}\,\mathrm{e}^{-g}\sum_{m=1}^{\infty} \frac{g^m}{m!\,m}
        \exp\left(-\frac{\pi^2\ell^2\Delta^2}{m\lambda^2}\right) \\
        g &= \left(\frac{2\pi\sigma}{\lambda}(\cos\theta_i + \cos\theta_r)\right)^2 \\
        \Delta &= 2\cos\beta\sin\alpha
        \end{aligned}

    where :math:`\ell` is the correlation length, g the variance of the optical phase and :math:`\Delta` the distance
    to the mirror direction in direction cosines.
    """

    def kernel(rms_height: Array, length: Array, wavelength: Array) -> Array:
        variance = phase_variance(g, rms_height, wavelength)
        tail = (math.pi * length / wavelength) ** 2 * shift_squared(g)
        return math.pi * (length / wavelength) ** 2 * poisson_mean(_order, variance, tail)

    return for_each(kernel, rms_height, length, wavelength)


def kirchhoff_obliquity(g: Geometry) -> Array:
    r"""Square of the Kirchhoff obliquity over both cosines: cos^2 b/(cos^2 a cos theta_i cos theta_r).

    .. math::

        O = \frac{\cos^2\beta}{\cos^2\alpha\cos\theta_i\cos\theta_r}
    """
    return (g.cos_beta / g.cos_alpha) ** 2 / (g.cos_i * g.cos_r)


def poisson_mean(function: Callable[..., Array], variance: Array, tail: Array, *more: Array) -> Array:
    """Mean of `function(m, tail, *more)` over the Poisson numbers m > 0 of this variance; it must fall as exp(-tail/m).

    Up to a variance of 40 it is the sum over all numbers among the first 128. Beyond, it is the trapezium rule over
    sqrt(m), which is nearly Gaussian, with Stirling's formula. That is good to 2e-11, so the two meet without a step,
    and no variance is too large.
    """
    xp = namespace(variance)
    rough = variance > _ROUGH
    numbers = constants([_NUMBERS, _LOG_FACTORIALS], variance)
    if not is_traced_never(variance):
        smooth = _summed(function, numbers, xp.where(rough, _ROUGH, variance), tail, *more)
        return xp.where(rough, _sampled(function, xp.where(rough, variance, _ROUGH), tail, *more), smooth)
    # Only with NumPy can the sum and its length be chosen for each value: terms beyond are below 1e-15 of the sum.
    full = xp.broadcast_arrays(variance, tail, *more)
    flat = [xp.reshape(array, (-1,)) for array in full]
    needed = flat[0] + 9 * xp.sqrt(flat[0]) + 7 + 1.3 * xp.sqrt(flat[1])
    kind = xp.where(flat[0] > _ROUGH, len(_COUNTS), xp.searchsorted(_COUNTS[:-1], needed))
    means = xp.empty_like(flat[0])
    for k, count in enumerate((*_COUNTS, len(_SPREAD))):
        indices, portion = xp.nonzero(kind == k)[0], _PORTION // count
        for start in range(0, len(indices), portion):
            rows = indices[start : start + portion]
            part = [array[rows] for array in flat]
            means[rows] = (
                _summed(function, numbers[:, :count], *part) if k < len(_COUNTS) else _sampled(function, *part)
            )
    return xp.reshape(means, full[0].shape)


def _order(m: Array, tail: Array) -> Array:
    """The light diffracted into the order m, over its Poisson probability: exp(-tail/m)/m."""
    return namespace(m).exp(-tail / m) / m


def _summed(function: Callable[..., Array], numbers: Array, variance: Array, *more: Array) -> Array:
    """The mean over numbers (2, m): m in the first row, ln m! in the second."""
    xp, v, m = namespace(variance), variance[..., None], numbers[0, :]
    probability = xp.exp(m * xp.log(v) - v - numbers[1, :])
    return xp.sum(probability * function(m, *(array[..., None] for array in more)), axis=-1)


def _sampled(function: Callable[..., Array], variance: Array, *more: Array) -> Array:
    """The mean by the trapezium rule over sqrt(m), with Stirling's formula in terms of sqrt(m/v)."""
    xp, root, spread = namespace(variance), variance[..., None] ** 0.5, constants(_SPREAD, variance)
    m, ratio = (root + spread) ** 2, spread / root
    # log(1 + x) is 2 atanh(x/(2 + x)), which keeps its digits
    logarithm = spread * (2 * root + spread) - 4 * m * xp.atanh(ratio / (2 + ratio))
    logarithm = logarithm - xp.log(2 * math.pi * m) / 2 - 1 / (12 * m) + 1 / (360 * m**3)
    probability = 2 * _STEP * (root + spread) * xp.exp(logarithm)
    return xp.sum(probability * function(m, *(array[..., None] for array in more)), axis=-1)
