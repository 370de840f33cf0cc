"""How reflected directions are drawn in proportion to a term times cos(theta_r), or nearly so.

Every class here is a `gonio.model.Sampler`, whose methods have their documentation there. Numbers u and v are uniform
in 0..1, 1 excluded. `of` turns the shape parameters of the term, by name, into those of the distribution that is drawn,
in order, and ignores the others. A direction below the horizon stands for light that is lost; where a point of a
distribution is no direction at all, it is the downward normal.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

from gonio.arrays import Array, namespace, special
from gonio.geometry import Geometry
from gonio.model import Sampler
from gonio.optics.distributions import Slopes, at_least, distance_density, draw_distance, sine_over_angle, turned
from gonio.optics.phase import guarded_root

Directed = tuple[Array, Array, Array]
Law = Callable[..., tuple[Array, ...]]

FARTHEST = 4.0  # largest squared distance of two directions in direction cosines
BISECTIONS, NEWTON_STEPS = 8, 16  # bisection brackets the slope to about 1/20, Newton's method then converges
BEYOND = 7.0  # Gaussian slopes over sqrt(2) sigma beyond this have probability 1e-22


@dataclass(frozen=True)
class CosineLobe:
    """Power of the cosine about the axis (c x_i, c y_i, z_i): -1 the mirror direction, 0 the normal, 1 the beam.

    `of` gives the exponent n >= 0 and c.
    """

    of: Law

    def draw(self, x_i: Array, y_i: Array, z_i: Array, u: Array, v: Array, /, **shape: Array) -> Directed:
        n, c = self.of(**shape)
        xp = namespace(u)
        return _about(_axis(x_i, y_i, z_i, c), -xp.expm1(xp.log1p(-u) / (n + 1)), v)

    def density(self, g: Geometry, /, **shape: Array) -> Array:
        n, c = self.of(**shape)
        cos = _cosine(g, c)
        xp = namespace(cos)
        outside = cos <= 0
        return (n + 1) / (2 * math.pi) * xp.where(outside, 0.0, xp.where(outside, 1.0, cos) ** n)


@dataclass(frozen=True)
class RetroLobe:
    """Exponential of the cosine about the incident beam; `of` gives its sharpness c >= 0: exp(c cos) per steradian."""

    of: Law

    def draw(self, x_i: Array, y_i: Array, z_i: Array, u: Array, v: Array, /, **shape: Array) -> Directed:
        (c,) = at_least(1e-9, *self.of(**shape))
        xp = namespace(u)
        return _about((x_i, y_i, z_i), -xp.log1p(u * xp.expm1(-2 * c)) / c, v)

    def density(self, g: Geometry, /, **shape: Array) -> Array:
        (c,) = at_least(1e-9, *self.of(**shape))
        missing = 1 - _cosine(g, 1.0)
        xp = namespace(missing)
        return c * xp.exp(-c * missing) / (-2 * math.pi * xp.expm1(-2 * c))


@dataclass(frozen=True)
class PolarLobe:
    """A lobe that depends on theta_r alone: `angle` draws the squared angle [rad^2] and `law` is its density."""

    angle: Callable[..., Array]
    law: Callable[..., Array]
    of: Law

    def draw(self, x_i: Array, y_i: Array, z_i: Array, u: Array, v: Array, /, **shape: Array) -> Directed:
        xp = namespace(u)
        theta = xp.sqrt(self.angle(u, *self.of(**shape)))
        x, y = turned(xp.sin(theta), v)
        return x, y, xp.cos(theta)

    def density(self, g: Geometry, /, **shape: Array) -> Array:
        theta = g.theta_r_deg * (math.pi / 180)
        return self.law(theta**2, *self.of(**shape)) / (math.pi * sine_over_angle(theta))


@dataclass(frozen=True)
class FacetNormals:
    """The mirror image of the incident light in facets drawn by projected area, D cos(alpha) (walter2007).

    `distribution` is D(geometry, parameters) and `slopes` draws the two slopes of a facet by it. The density of the
    reflected direction is D cos(alpha)/(4 cos(beta)).
    """

    distribution: Callable[..., Array]
    slopes: Callable[..., Slopes]
    of: Law

    def draw(self, x_i: Array, y_i: Array, z_i: Array, u: Array, v: Array, /, **shape: Array) -> Directed:
        return _mirrored(x_i, y_i, z_i, *self.slopes(u, v, *self.of(**shape)))

    def density(self, g: Geometry, /, **shape: Array) -> Array:
        return self.distribution(g, *self.of(**shape)) * g.cos_alpha / (4 * g.cos_beta)


@dataclass(frozen=True)
class VisibleGGX:
    """The mirror image of the incident light in visible GGX normals (heitz2018), drawn by a spherical cap (dupuy2023).

    `of` gives the widths along and across the surface's x axis, which `distribution` takes too.
    """

    distribution: Callable[..., Array]
    of: Law

    def draw(self, x_i: Array, y_i: Array, z_i: Array, u: Array, v: Array, /, **shape: Array) -> Directed:
        along, across = self.of(**shape)
        x, y, z = _unit(along * x_i, across * y_i, z_i)
        drop = u * (1 + z)  # 1 - cos of the tilt in the cap
        cap_x, cap_y = turned(guarded_root(drop * (2 - drop)), v)
        up = (1 + z) * (1 - u)
        return _mirrored(x_i, y_i, z_i, along * (cap_x + x) / up, across * (cap_y + y) / up)

    def density(self, g: Geometry, /, **shape: Array) -> Array:
        along, across = self.of(**shape)
        stretched = (along * g.x_i) ** 2 + (across * g.y_i) ** 2 + g.z_i**2
        area = (g.z_i + namespace(stretched).sqrt(stretched)) / 2
        return self.distribution(g, along, across) / (4 * area)


@dataclass(frozen=True)
class VisibleBeckmann:
    """The mirror image of the incident light in visible Beckmann normals (heitz2014).

    `of` gives the total rms slope, which `distribution` takes too.
    """

    distribution: Callable[..., Array]
    of: Law

    def draw(self, x_i: Array, y_i: Array, z_i: Array, u: Array, v: Array, /, **shape: Array) -> Directed:
        (m,) = self.of(**shape)
        xp = namespace(u)
        x, y, z = _unit(m * x_i, m * y_i, z_i)
        sine = xp.sqrt(x * x + y * y)
        pole = sine == 0
        cos, sin = xp.where(pole, 1.0, x / xp.where(pole, 1.0, sine)), y / xp.where(pole, 1.0, sine)
        along, across = _visible_slope(u, z, sine), _gaussian_slope(v)
        return _mirrored(x_i, y_i, z_i, m * (cos * along - sin * across), m * (sin * along + cos * across))

    def density(self, g: Geometry, /, **shape: Array) -> Array:
        (m,) = self.of(**shape)
        xp = namespace(g.z_i)
        across = m * xp.sqrt(g.x_i**2 + g.y_i**2)
        stretched = xp.sqrt(across**2 + g.z_i**2)
        area = stretched * _lit_area(0 * stretched + BEYOND, g.z_i / stretched, across / stretched)
        return self.distribution(g, m) / (4 * area)


@dataclass(frozen=True)
class ShiftedPower:
    """A power law of the distance to the mirror direction in direction cosines, (1 + B distance^2)^-C cos(theta_r).

    `of` gives B > 0 and C. The cosine needs no rejection: it is the Jacobian from direction cosines to solid angle.
    """

    of: Law

    def draw(self, x_i: Array, y_i: Array, z_i: Array, u: Array, v: Array, /, **shape: Array) -> Directed:
        xp = namespace(u)
        x, y = turned(xp.sqrt(draw_distance(u, FARTHEST, *self.of(**shape))), v)
        x, y = x - x_i, y - y_i
        squared = 1 - x * x - y * y
        lost = squared <= 0
        return xp.where(lost, 0.0, x), xp.where(lost, 0.0, y), xp.where(lost, -1.0, xp.sqrt(xp.where(lost, 1, squared)))

    def density(self, g: Geometry, /, **shape: Array) -> Array:
        x, y = g.x_i + g.x_r, g.y_i + g.y_r
        return distance_density(x * x + y * y, FARTHEST, *self.of(**shape)) / math.pi * g.z_r


@dataclass(frozen=True)
class Either:
    """The first sampler in a `share` of the cases, else the second; u is rescaled within each share and used again."""

    first: Sampler
    second: Sampler
    share: float

    def draw(self, x_i: Array, y_i: Array, z_i: Array, u: Array, v: Array, /, **shape: Array) -> Directed:
        xp = namespace(u)
        is_first = u < self.share
        rescaled = xp.where(is_first, u / self.share, (u - self.share) / (1 - self.share))
        pairs = zip(
            self.first.draw(x_i, y_i, z_i, rescaled, v, **shape),
            self.second.draw(x_i, y_i, z_i, rescaled, v, **shape),
            strict=True,
        )
        x, y, z = (xp.where(is_first, first, second) for first, second in pairs)
        return x, y, z

    def density(self, g: Geometry, /, **shape: Array) -> Array:
        return self.share * self.first.density(g, **shape) + (1 - self.share) * self.second.density(g, **shape)


COSINE = CosineLobe(of=lambda **_: (1.0, 0.0))


def _visible_slope(u: Array, cos: Array, sin: Array) -> Array:
    """Slope towards the light, over m, of Gaussian facets that light at this (stretched) angle reaches; good to 1e-9.

    The root of _lit_area(slope) = u _lit_area(all): bisections first, then Newton's method kept within the bracket.
    """
    xp = namespace(u)
    low, high = _least_slope(cos, sin) + 0 * u, 0 * u + BEYOND
    target = u * _lit_area(high, cos, sin)
    slope = (low + high) / 2
    for step in range(BISECTIONS + NEWTON_STEPS):
        excess = _lit_area(slope, cos, sin) - target
        low, high = xp.where(excess < 0, slope, low), xp.where(excess < 0, high, slope)
        middle = (low + high) / 2
        if step < BISECTIONS:
            slope = middle
            continue
        rate = (cos + slope * sin) * xp.exp(-(slope**2)) / math.sqrt(math.pi)
        newton = slope - excess / xp.where(rate < 1e-30, 1e-30, rate)
        # The ends included: a slope that is exact has become an end of the bracket itself.
        slope = xp.where((newton >= low) & (newton <= high), newton, middle)
    return slope


def _least_slope(cos: Array, sin: Array) -> Array:
    """The slope, over m, at which a facet is parallel to the light; facets of lesser slopes are not lit."""
    xp = namespace(cos)
    steep = cos < BEYOND * sin
    return xp.where(steep, -cos / xp.where(steep, sin, 1.0), -BEYOND)


def _lit_area(slope: Array, cos: Array, sin: Array) -> Array:
    """Area, projected along the light, of the lit facets of slopes up to `slope`, over the area of the surface."""
    xp = namespace(slope)
    least = _least_slope(cos, sin)
    flat = (special("erf", slope) - special("erf", least)) / 2
    return cos * flat + sin * (xp.exp(-(least**2)) - xp.exp(-(slope**2))) / (2 * math.sqrt(math.pi))


def _gaussian_slope(v: Array) -> Array:
    """Slope across the light, over m, which does not depend on the light."""
    slope = special("erfinv", 2 * v - 1)
    return namespace(slope).where(slope < -BEYOND, -BEYOND, slope)


def _mirrored(x: Array, y: Array, z: Array, slope_x: Array, slope_y: Array) -> Directed:
    """The direction mirrored by the facet of these slopes."""
    twice = 2 * (x * slope_x + y * slope_y + z) / (1 + slope_x**2 + slope_y**2)
    return twice * slope_x - x, twice * slope_y - y, twice - z


def _axis(x: Array, y: Array, z: Array, c: Array) -> Directed:
    """The unit vector along (c x, c y, z)."""
    return _unit(c * x, c * y, z)


def _cosine(g: Geometry, c: Array) -> Array:
    """Cosine of w_r with the axis of a lobe."""
    x, y, z = _axis(g.x_i, g.y_i, g.z_i, c)
    return x * g.x_r + y * g.y_r + z * g.z_r


def _unit(x: Array, y: Array, z: Array) -> Directed:
    length = namespace(z).sqrt(x * x + y * y + z * z)
    return x / length, y / length, z / length


def _about(axis: Directed, drop: Array, v: Array) -> Directed:
    """The direction at 1 - cos = `drop` from an upward `axis`, turned by v (frame of duff2017)."""
    x, y, z = axis
    first, second = turned(guarded_root(drop * (2 - drop)), v)
    a = 1 / (1 + z)
    along = 1 - drop
    return (
        first * (1 - x * x * a) - second * x * y * a + along * x,
        second * (1 - y * y * a) - first * x * y * a + along * y,
        along * z - first * x - second * y,
    )
