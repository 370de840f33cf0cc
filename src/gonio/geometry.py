"""Where the light comes from and where it goes: the conventions, stated once.

w_i points from the surface to the source and w_r to the detector, z is the surface normal, x the surface's own axis.
phi = phi_r - phi_i, so phi = 180 deg is the forward (specular) half-plane and phi = 0 the backscatter half-plane.
In-plane goniometer files use a signed theta_r, positive forward.
"""

from functools import cached_property
from math import comb
from typing import Any, NamedTuple

from gonio.arrays import Array, align, namespace
from gonio.units import to_degrees, to_radians

_ARCSINE = [4.0**n / (n * n * comb(2 * n, n)) for n in range(1, 13)]  # 2 arcsin(s)^2 as a series of s^2

GRAZING = 1e-6  # cosines are kept above this where a model divides by them (formulas 0)


class Directions(NamedTuple):
    """Pairs of unit vectors w_i = (x_i, y_i, z_i) and w_r = (x_r, y_r, z_r) that broadcast against each other."""

    x_i: Array
    y_i: Array
    z_i: Array
    x_r: Array
    y_r: Array
    z_r: Array


class Geometry(Directions):
    r"""Pairs of directions, and the quantities that models need of them, each computed once, on first use.

    A plain tuple of arrays, hence a JAX pytree without registration. Everything is derived from cosines and the half
    vector, so that nothing is singular at the normal or at the mirror direction. Quantities that several parts of a
    model use end in a product: XLA computes a quotient or a root that is used several times in a loop of its own,
    through memory.

    The facet whose normal is the half vector of both directions is tilted by alpha, and light meets it at the angle
    beta:

    .. math::

        \begin{aligned}
        \cos 2\beta &= \cos\theta_i\cos\theta_r + \sin\theta_i\sin\theta_r\cos\varphi \\
        \cos\alpha &= \frac{\cos\theta_i + \cos\theta_r}{2\cos\beta} \\
        \tan^2\alpha &= s_x^2 + s_y^2 \\
        s_x &= \frac{x_i + x_r}{z_i + z_r} \\
        s_y &= \frac{y_i + y_r}{z_i + z_r}
        \end{aligned}

    Parameters
    ----------
    x_i, y_i, z_i : array
        Components of the unit vector from the surface to the source; z is the surface normal.
    x_r, y_r, z_r : array
        Components of the unit vector to the detector. They broadcast against the others.

    Examples
    --------
    >>> import gonio
    >>> mirror = gonio.Geometry.from_degrees(30.0, [0.0, 30.0], 180.0)
    >>> mirror.cos_alpha.round(3).tolist()  # of the half vector: 1 in the mirror direction
    [0.966, 1.0]

    """

    @classmethod
    def from_degrees(cls, theta_i: Array, theta_r: Array, phi: Array = 180.0, phi_i: Array = 0.0) -> "Geometry":
        """Directions from angles [deg].

        Parameters
        ----------
        theta_i, theta_r : array_like
            Angles of incidence and of reflection from the normal.
        phi : array_like
            Azimuth of the detector relative to the source: 180 is the forward (specular) side.
        phi_i : array_like
            Azimuth of the source from the surface's own x axis, for anisotropic surfaces.

        Returns
        -------
        Geometry
            Of the shape to which the angles broadcast.

        """
        xp, angles = align(theta_i, theta_r, phi, phi_i)
        t_i, t_r, azimuth, azimuth_i = (to_radians(a) for a in angles)
        sin_i, sin_r = xp.sin(t_i), xp.sin(t_r)
        azimuth_r = azimuth_i + azimuth
        return cls(
            sin_i * xp.cos(azimuth_i),
            sin_i * xp.sin(azimuth_i),
            xp.cos(t_i),
            sin_r * xp.cos(azimuth_r),
            sin_r * xp.sin(azimuth_r),
            xp.cos(t_r),
        )

    @classmethod
    def in_plane(cls, theta_i: Array, theta_r: Array) -> "Geometry":
        """Directions in the plane of incidence from angles [deg].

        Parameters
        ----------
        theta_i : array_like
            Angle of incidence.
        theta_r : array_like
            Signed angle of reflection, positive on the forward (specular) side.

        Returns
        -------
        Geometry
            Of the shape to which the angles broadcast.

        """
        _, (t_i, t_r) = align(theta_i, theta_r)
        return cls.from_degrees(t_i, -t_r, 0.0)

    @cached_property
    def below(self) -> Array:
        """Whether a direction is at or below the horizon, where the BRDF is 0; a NaN is not, and stays a NaN."""
        return (self.z_i <= 0) | (self.z_r <= 0)

    @cached_property
    def cos_i(self) -> Array:
        """Cosine of the incidence angle, at least GRAZING."""
        return _above_zero(self.z_i, GRAZING)

    @cached_property
    def cos_r(self) -> Array:
        """Cosine of the reflection angle, at least GRAZING."""
        return _above_zero(self.z_r, GRAZING)

    @cached_property
    def theta_i_deg(self) -> Array:
        """Incidence angle [deg]."""
        return to_degrees(_polar_angle(self.x_i, self.y_i, self.z_i))

    @cached_property
    def theta_r_deg(self) -> Array:
        """Reflection angle [deg], from the normal, never negative."""
        return to_degrees(_polar_angle(self.x_r, self.y_r, self.z_r))

    @cached_property
    def theta_i_squared(self) -> Array:
        """Squared angle of incidence [deg^2]."""
        return to_degrees(to_degrees(_polar_angle_squared(self.x_i, self.y_i, self.z_i)))

    @cached_property
    def theta_r_squared(self) -> Array:
        """Squared angle of reflection [deg^2]."""
        return to_degrees(to_degrees(_polar_angle_squared(self.x_r, self.y_r, self.z_r)))

    @cached_property
    def cos_beta(self) -> Array:
        """Cosine of the angle of incidence on the facet, half the angle between the two directions."""
        return _root(self._sum_squared) / 2

    @cached_property
    def cos_alpha(self) -> Array:
        """Cosine of the facet's tilt."""
        return _above_zero(self.z_i + self.z_r, 2 * GRAZING) / _root(self._sum_squared)

    @cached_property
    def cos_ratio(self) -> Array:
        """cos(alpha)/cos(beta), which needs no root."""
        return 2 * _above_zero(self.z_i + self.z_r, 2 * GRAZING) * (1 / self._sum_squared)

    @cached_property
    def slope_x(self) -> Array:
        """Slope of the facet along the surface's x axis, h_x/h_z."""
        return (self.x_i + self.x_r) / _above_zero(self.z_i + self.z_r, 2 * GRAZING)

    @cached_property
    def slope_y(self) -> Array:
        """Slope of the facet along the surface's y axis, h_y/h_z."""
        return (self.y_i + self.y_r) / _above_zero(self.z_i + self.z_r, 2 * GRAZING)

    @cached_property
    def tan_alpha_squared(self) -> Array:
        """Squared slope of the facet, which keeps its digits near the mirror direction where 1/cos^2 - 1 loses them."""
        x, y, z = self.x_i + self.x_r, self.y_i + self.y_r, _above_zero(self.z_i + self.z_r, 2 * GRAZING)
        return (x * x + y * y) * (1 / (z * z))

    @cached_property
    def _sum_squared(self) -> Array:
        x, y, z = self.x_i + self.x_r, self.y_i + self.y_r, self.z_i + self.z_r
        return _above_zero(x * x + y * y + z * z, GRAZING**2)


def _above_zero(value: Array, least: float) -> Array:
    return namespace(value).where(value < least, least, value)


def _root(value: Array) -> Array:
    return namespace(value).sqrt(value)


def _polar_angle(x: Array, y: Array, z: Array) -> Array:
    """Angle from the normal [rad]: atan2 keeps every digit where arccos loses half; the gradient is 0 at the pole."""
    xp: Any = namespace(z)
    squared = x * x + y * y
    at_pole = squared == 0
    radius = xp.where(at_pole, 0.0, xp.sqrt(xp.where(at_pole, 1.0, squared)))
    return xp.atan2(radius, z)


def _polar_angle_squared(x: Array, y: Array, z: Array) -> Array:
    """Squared angle from the normal [rad^2] up to the horizon: a series that vectorises where atan2 does not.

    It is that of the squared arcsine of sin^2(theta/8), below 0.04, which two halvings give from sin^2 theta: good to
    2e-16 of the angle, without a root or a special case at the pole.
    """
    xp: Any = namespace(z)
    cos = xp.where(z < 0, 0.0, z)
    half = xp.sqrt((1 + cos) / 2)
    quarter = xp.sqrt((1 + half) / 2)
    s = (x * x + y * y) * (1 / (8 * (1 + cos) * (1 + half) * (1 + quarter)))
    series = _ARCSINE[-1] * s
    for coefficient in _ARCSINE[-2::-1]:
        series = (series + coefficient) * s
    return 32 * series
