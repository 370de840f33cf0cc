"""Distributions by which slopes of facets and angles are drawn, with the densities that are not in facets.py.

Numbers u and v are uniform in 0..1, 1 excluded. A squared slope or angle s is drawn by the inverse of its distribution
function, s = F^-1(u), and v gives the azimuth 2 pi v. Where a formula is singular at a parameter's special value (0/0),
the parameter is kept so far from it that the result still has ten digits.
"""

import math

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry

Slopes = tuple[Array, Array]  # along the surface's x and y axes

QUARTER = (math.pi / 2) ** 2  # squared angle from the normal to the horizon [rad^2]
NEAR = 1e-6  # how near a parameter may come to a value at which its formula is singular: ten digits are left there
LARGEST_LOG = 60.0  # squared slopes stay below e^60, because single precision ends at e^88


def draw_gaussian(u: Array, v: Array, sigma: Array) -> Slopes:
    """Gaussian slopes of rms `sigma` per axis: facets.gaussian_slopes."""
    return draw_elliptical(u, v, math.sqrt(2) * sigma, math.sqrt(2) * sigma)


def draw_beckmann(u: Array, v: Array, m: Array) -> Slopes:
    """Gaussian slopes of total rms `m`: facets.beckmann_slopes."""
    return draw_elliptical(u, v, m, m)


def draw_elliptical(u: Array, v: Array, along: Array, across: Array) -> Slopes:
    """Gaussian slopes of rms along/sqrt(2) and across/sqrt(2) along the surface's x and y axes."""
    xp = namespace(u)
    x, y = turned(xp.sqrt(-xp.log1p(-u)), v)
    return along * x, across * y


def draw_student(u: Array, v: Array, width: Array, c: Array) -> Slopes:
    """Slopes by Student's t of exponent `c` > 1: facets.student_slopes."""
    xp = namespace(u)
    exponent = xp.log1p(-u) / (1 - c)
    squared = (c - 1) * xp.expm1(xp.where(exponent > LARGEST_LOG, LARGEST_LOG, exponent))
    return turned(width * xp.sqrt(squared), v)


def draw_elliptical_student(u: Array, v: Array, along: Array, c: Array, across: Array) -> Slopes:
    """The same with a width along each of the surface's axes."""
    x, y = draw_student(u, v, 1.0, c)
    return along * x, across * y


def draw_ggx(u: Array, v: Array, width: Array) -> Slopes:
    """Slopes by GGX: facets.ggx_slopes."""
    return draw_student(u, v, width, 2.0)


def draw_cosine_power(u: Array, v: Array, n: Array) -> Slopes:
    """Slopes of normals by Blinn's power of the cosine (blinn1977), n > -2: facets.cosine_power_normals."""
    xp = namespace(u)
    return turned(xp.sqrt(xp.expm1(-2 * xp.log1p(-u) / (n + 2))), v)


def draw_gtr(u: Array, v: Array, width: Array, c: Array) -> Slopes:
    """Slopes by generalised Trowbridge and Reitz of exponent `c` >= 1 (burley2012): facets.gtr_normals."""
    xp = namespace(u)
    power = 1 - c - 0 * u  # an array, whatever `c` is
    power = xp.where(power > -NEAR, -NEAR, power)
    squared = xp.where(xp.abs(width - 1) < NEAR, 1 - NEAR, width) ** 2
    log_squared = xp.log(squared)
    log_ratio = xp.log1p(u * xp.expm1(-power * log_squared)) / power
    return turned(xp.sqrt(-squared * xp.expm1(log_ratio) / xp.expm1(log_squared + log_ratio)), v)


def draw_elliptical_gtr(u: Array, v: Array, width: Array, c: Array, ratio: Array) -> Slopes:
    """The same, stretched along the surface's x axis by sqrt(ratio) and along y by its inverse."""
    x, y = draw_gtr(u, v, width, c)
    stretch = ratio**0.5
    return x * stretch, y / stretch


def power_normals(g: Geometry, B: Array, C: Array) -> Array:
    """Normals whose density per solid angle falls as (1 + B (1 - cos alpha))^-C; here per projected solid angle."""
    tilt = g.tan_alpha_squared * g.cos_alpha**2 / (1 + g.cos_alpha)
    return distance_density(tilt, 1.0, B, C) / (2 * math.pi * g.cos_alpha)


def draw_power(u: Array, v: Array, B: Array, C: Array) -> Slopes:
    """Slopes of normals by `power_normals`: 1 - cos alpha is drawn, in 0..1."""
    tilt = draw_distance(u, 1.0, B, C)
    xp = namespace(tilt)
    cos = 1 - tilt
    return turned(xp.sqrt(tilt * (2 - tilt)) / xp.where(cos < 1e-12, 1e-12, cos), v)


def angle_normals(g: Geometry, width: Array) -> Array:
    """Normals whose squared tilt angle has the density `gaussian_angle`, `width` in rad; per projected solid angle."""
    tan2 = g.tan_alpha_squared
    xp = namespace(tan2)
    flat = tan2 < 1e-24
    alpha = xp.where(flat, 0.0, xp.atan(xp.sqrt(xp.where(flat, 1.0, tan2))))
    return gaussian_angle(alpha**2, width) / (math.pi * sine_over_angle(alpha) * g.cos_alpha)


def draw_angle(u: Array, v: Array, width: Array) -> Slopes:
    """Slopes of normals by `angle_normals`."""
    xp = namespace(u)
    return turned(xp.tan(xp.sqrt(draw_gaussian_angle(u, width))), v)


def gaussian_angle(squared: Array, width: Array) -> Array:
    """Density [1/rad^2] of a squared angle: exp(-squared/(2 width^2)), `width` in rad, normalised up to the horizon."""
    xp = namespace(squared)
    twice = 2 * width**2
    return -xp.exp(-squared / twice) / (twice * xp.expm1(-QUARTER / twice))


def draw_gaussian_angle(u: Array, width: Array) -> Array:
    """Squared angle [rad^2] by `gaussian_angle`."""
    xp = namespace(u)
    twice = 2 * width**2
    return -twice * xp.log1p(u * xp.expm1(-QUARTER / twice))


def lorentz_angle(squared: Array, width: Array) -> Array:
    """Density [1/rad^2] of a squared angle: 1/(squared + width^2), `width` in rad, normalised up to the horizon."""
    return 1 / ((squared + width**2) * namespace(squared).log1p(QUARTER / width**2))


def draw_lorentz_angle(u: Array, width: Array) -> Array:
    """Squared angle [rad^2] by `lorentz_angle`."""
    xp = namespace(u)
    return width**2 * xp.expm1(u * xp.log1p(QUARTER / width**2))


def distance_density(s: Array, end: float, B: Array, C: Array) -> Array:
    """Density of s in 0..end that falls as (1 + B s)^-C, B >= 0."""
    B, power, integral = _power_law(end, B, C)
    return (1 + B * s) ** (power - 1) * B * power / integral


def draw_distance(u: Array, end: float, B: Array, C: Array) -> Array:
    """The s in 0..end drawn by `distance_density`: ((1 + u ((1 + B end)^(1 - C) - 1))^(1/(1 - C)) - 1)/B."""
    xp = namespace(u)
    B, power, integral = _power_law(end, B, C)
    return xp.expm1(xp.log1p(u * integral) / power) / B


def _power_law(end: float, B: Array, C: Array) -> tuple[Array, Array, Array]:
    """B, 1 - C and (1 + B end)^(1 - C) - 1, with B and C kept off the values B = 0 and C = 1 that give 0/0."""
    (B,) = at_least(1e-9, B)
    xp = namespace(B)
    power = xp.where(xp.abs(1 - C) < NEAR, NEAR, 1 - C)
    return B, power, xp.expm1(power * xp.log1p(B * end))


def at_least(least: float, *values: Array) -> tuple[Array, ...]:
    """The values, those below `least` replaced by it; a NaN stays."""
    return tuple(namespace(value).where(value < least, least, value) for value in values)


def turned(radius: Array, v: Array) -> Slopes:
    """The components of a vector of length `radius` at the azimuth 2 pi v."""
    xp = namespace(v)
    return radius * xp.cos(2 * math.pi * v), radius * xp.sin(2 * math.pi * v)


def sine_over_angle(angle: Array) -> Array:
    """sin(angle)/angle of angles >= 0 [rad], 1 at 0."""
    xp = namespace(angle)
    small = angle < 1e-6
    return xp.where(small, 1.0, xp.sin(angle) / xp.where(small, 1.0, angle))
