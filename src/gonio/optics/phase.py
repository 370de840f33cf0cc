"""The phase angle, 2 beta between the two directions, and functions of it for models with a hot spot."""

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry


def cos_phase(g: Geometry) -> Array:
    """Cosine of the angle between the two directions."""
    return g.x_i * g.x_r + g.y_i * g.y_r + g.z_i * g.z_r


def sin_half_phase(g: Geometry) -> Array:
    """Sine of half the phase angle, from the difference of the directions: it keeps its digits towards opposition."""
    x, y, z = g.x_i - g.x_r, g.y_i - g.y_r, g.z_i - g.z_r
    return guarded_root(x * x + y * y + z * z) / 2


def tangent_distance_squared(g: Geometry) -> Array:
    """Squared distance of the two directions in the plane of tangents: 0 in the hot spot."""
    x, y = g.x_i / g.cos_i - g.x_r / g.cos_r, g.y_i / g.cos_i - g.y_r / g.cos_r
    return x * x + y * y


def guarded_root(squared: Array) -> Array:
    """Square root whose value and gradient are 0 at 0 and below."""
    xp = namespace(squared)
    nothing = squared <= 0
    return xp.where(nothing, 0.0, xp.sqrt(xp.where(nothing, 1.0, squared)))
