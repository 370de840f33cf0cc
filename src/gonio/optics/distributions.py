"""Laws by which slopes of facets and angles are drawn, each with its probability density.

Numbers u and v lie in 0..1, 1 excluded. A law is drawn by its inverse distribution function, so that one u gives one
value. Where a formula has no limit at a parameter's special value, it is approached so far as ten digits allow.
"""

import math

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry

Slopes = tuple[Array, Array]

QUARTER = (math.pi / 2) ** 2  # squared angle from the normal to the horizon [rad^2]
NEAR = 1e-6  # a limit is approached so far where a formula has none, and still has ten digits
LARGEST_LOG = 60.0  # squared slopes stay below e^60, because single precision ends at e^88


def draw_gaussian(u: Array, v: Array, sigma: Array) -> Slopes:
    """Gaussian slopes of rms `sigma` per axis."""
    return draw_elliptical(u, v, math.sqrt(2) * sigma, math.sqrt(2) * sigma)


def draw_beckmann(u: Array, v: Array, m: Array) -> Slopes:
    """Gaussian slopes of total rms `m`."""
    return draw_elliptical(u, v, m, m)


def draw_elliptical(u: Array, v: Array, along: Array, across: Array) -> Slopes:
    """Gaussian slopes of rms along/sqrt(2) and across/sqrt(2)."""
    xp = namespace(u)
    x, y = turned(xp.sqrt(-xp.log1p(-u)), v)
    return along * x, across * y


def draw_student(u: Array, v: Array, width: Array, c: Array) -> Slopes:
    """Slopes by Student's t of exponent `c` > 1."""
    xp = namespace(u)
    exponent = xp.log1p(-u) / (1 - c)
    squared = (c - 1) * xp.expm1(xp.where(exponent > LARGEST_LOG, LARGEST_LOG, exponent))
    return turned(width * xp.sqrt(squared), v)


def draw_ggx(u: Array, v: Array, width: Array) -> Slopes:
    """Slopes by GGX."""
    return draw_student(u, v, width, 2.0)


def draw_cosine_power(u: Array, v: Array, n: Array) -> Slopes:
    """Slopes of normals by Blinn's power of the cosine (blinn1977), n > -2."""
    xp = namespace(u)
    return turned(xp.sqrt(xp.expm1(-2 * xp.log1p(-u) / (n + 2))), v)


def draw_gtr(u: Array, v: Array, width: Array, c: Array) -> Slopes:
    """Slopes by generalised Trowbridge and Reitz of exponent `c` >= 1 (burley2012)."""
    xp = namespace(u)
    fall = 1 - c - 0 * u  # an array, whatever `c` is
    fall = xp.where(fall > -NEAR, -NEAR, fall)
    squared = xp.where(xp.abs(width - 1) < NEAR, 1 - NEAR, width) ** 2
    least = xp.log(squared)
    risen = xp.log1p(u * xp.expm1(-fall * least)) / fall
    return turned(xp.sqrt(-squared * xp.expm1(risen) / xp.expm1(least + risen)), v)


def power_normals(g: Geometry, B: Array, C: Array) -> Array:
    """Normals by (1 + B (1 - cos alpha))^-C per solid angle."""
    tilt = g.tan_alpha_squared * g.cos_alpha**2 / (1 + g.cos_alpha)
    return distance_density(tilt, 1.0, B, C) / (2 * math.pi * g.cos_alpha)


def draw_power(u: Array, v: Array, B: Array, C: Array) -> Slopes:
    """Slopes by the same."""
    tilt = draw_distance(u, 1.0, B, C)
    xp = namespace(tilt)
    cos = 1 - tilt
    return turned(xp.sqrt(tilt * (2 - tilt)) / xp.where(cos < 1e-12, 1e-12, cos), v)


def angle_normals(g: Geometry, width: Array) -> Array:
    """Normals by a Gaussian of the tilt angle, `width` [rad], whose squared angle is what is drawn."""
    tan2 = g.tan_alpha_squared
    xp = namespace(tan2)
    flat = tan2 < 1e-24
    alpha = xp.where(flat, 0.0, xp.atan(xp.sqrt(xp.where(flat, 1.0, tan2))))
    return gaussian_angle(alpha**2, width) / (math.pi * sine_over_angle(alpha) * g.cos_alpha)


def draw_angle(u: Array, v: Array, width: Array) -> Slopes:
    """Slopes by the same."""
    xp = namespace(u)
    return turned(xp.tan(xp.sqrt(draw_gaussian_angle(u, width))), v)


def gaussian_angle(squared: Array, width: Array) -> Array:
    """Density of the squared angle [1/rad^2] of a Gaussian of `width` [rad] that ends at the horizon."""
    xp = namespace(squared)
    twice = 2 * width**2
    return -xp.exp(-squared / twice) / (twice * xp.expm1(-QUARTER / twice))


def draw_gaussian_angle(u: Array, width: Array) -> Array:
    """Squared angle [rad^2] by the same."""
    xp = namespace(u)
    twice = 2 * width**2
    return -twice * xp.log1p(u * xp.expm1(-QUARTER / twice))


def lorentz_angle(squared: Array, width: Array) -> Array:
    """Density of the squared angle [1/rad^2] of a Lorentzian of half width `width` [rad] that ends at the horizon."""
    return 1 / ((squared + width**2) * namespace(squared).log1p(QUARTER / width**2))


def draw_lorentz_angle(u: Array, width: Array) -> Array:
    """Squared angle [rad^2] by the same."""
    xp = namespace(u)
    return width**2 * xp.expm1(u * xp.log1p(QUARTER / width**2))


def distance_density(s: Array, end: float, B: Array, C: Array) -> Array:
    """Density of s in 0..end that falls as (1 + B s)^-C."""
    B, fall, whole = _power_law(end, B, C)
    return (1 + B * s) ** (fall - 1) * B * fall / whole


def draw_distance(u: Array, end: float, B: Array, C: Array) -> Array:
    xp = namespace(u)
    B, fall, whole = _power_law(end, B, C)
    return xp.expm1(xp.log1p(u * whole) / fall) / B


def _power_law(end: float, B: Array, C: Array) -> tuple[Array, Array, Array]:
    """B, 1 - C and (1 + B end)^(1 - C) - 1, kept off the limits B = 0 and C = 1, where the digits still suffice."""
    (B,) = at_least(1e-9, B)
    xp = namespace(B)
    fall = xp.where(xp.abs(1 - C) < NEAR, NEAR, 1 - C)
    return B, fall, xp.expm1(fall * xp.log1p(B * end))


def at_least(least: float, *values: Array) -> tuple[Array, ...]:
    return tuple(namespace(value).where(value < least, least, value) for value in values)


def turned(radius: Array, v: Array) -> Slopes:
    xp = namespace(v)
    return radius * xp.cos(2 * math.pi * v), radius * xp.sin(2 * math.pi * v)


def sine_over_angle(angle: Array) -> Array:
    xp = namespace(angle)
    small = angle < 1e-6
    return xp.where(small, 1.0, xp.sin(angle) / xp.where(small, 1.0, angle))
