"""Diffuse reflection from V-grooves whose facets are Lambertian: rough matte surfaces."""

import math
from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerSteradian, drawn_by
from gonio.optics.sampling import COSINE
from gonio.units import to_radians

FacetReflectance = Annotated[float, Parameter(0.8, 0.0, 1.0, "reflectance of the facets")]
# above 0.65 the formula turns negative near grazing where the facets are dark
SlopeAngle = Annotated[float, Parameter(0.5, 0.0, 0.65, "standard deviation of the facets' slope angle", "rad")]
SmallSlopeAngle = Annotated[float, Parameter(0.3, 0.0, 0.65, "standard deviation of the facets' slope angle", "rad")]


@drawn_by(COSINE)
def rough_diffuse(g: Geometry, rho: FacetReflectance, s: SlopeAngle) -> PerSteradian:
    r"""Lambertian facets in V-grooves, with masking and two reflections: full form (oren1994; formulas 7.2).

    .. math::

        \begin{aligned}
        f_d &= \frac{\rho}{\pi}\,(C_1 + C_2 + C_3 + C_4) \\
        C_1 &= 1 - \frac{0.5\,s^2}{s^2 + 0.33} \\
        C_2 &= \frac{0.45\,s^2}{s^2 + 0.09}\,(\sin a - u)\cos\varphi\tan b \\
        C_3 &= \frac{0.125\,s^2}{s^2 + 0.09}\left(\frac{4ab}{\pi^2}\right)^2 (1 - \lvert\cos\varphi\rvert)
        \tan\left(\frac{a + b}{2}\right) \\
        C_4 &= \frac{0.17\,\rho s^2}{s^2 + 0.13}\left(1 - \frac{4b^2}{\pi^2}\cos\varphi\right) \\
        u &= \begin{cases} 8b^3/\pi^3, & \cos\varphi < 0 \\ 0, & \cos\varphi \ge 0 \end{cases} \\
        a &= \max(\theta_i, \theta_r) \\
        b &= \min(\theta_i, \theta_r)
        \end{aligned}
    """
    xp = namespace(g.z_i)
    sin_i, sin_r = xp.sin(to_radians(g.theta_i_deg)), xp.sin(to_radians(g.theta_r_deg))
    steeper_i = g.theta_i_deg > g.theta_r_deg
    sin_large = xp.where(steeper_i, sin_i, sin_r)
    tan_small = xp.where(steeper_i, sin_r / g.cos_r, sin_i / g.cos_i)
    small = xp.where(steeper_i, g.theta_r_deg, g.theta_i_deg) / 90
    # tangent of the mean of the two angles, which stays finite where both are 90 deg
    tan_mean = (sin_i + sin_r) / (g.cos_i + g.cos_r)
    cosine = _cos_azimuth(g, sin_i * sin_r)
    forward = cosine < 0
    variance = s**2
    wide = variance / (variance + 0.09)
    direct = 1 - 0.5 * variance / (variance + 0.33)
    backscatter = 0.45 * wide * (sin_large - xp.where(forward, small**3, 0.0)) * cosine * tan_small
    aside = 0.125 * wide * (g.theta_i_deg * g.theta_r_deg / 90**2) ** 2
    sideways = aside * (1 - xp.where(forward, -cosine, cosine)) * tan_mean
    twice = 0.17 * rho * variance / (variance + 0.13) * (1 - cosine * small**2)
    return rho / math.pi * (direct + backscatter + sideways + twice)


@drawn_by(COSINE)
def rough_diffuse_qualitative(g: Geometry, s: SmallSlopeAngle) -> PerSteradian:
    r"""Oren and Nayar's simpler form, without the facets' second reflections (oren1994; formulas 7.2).

    The sine of the larger angle times the tangent of the smaller needs no angles: it is over the larger cosine.

    .. math::

        \begin{aligned}
        f_d &= \frac{C_1 + C_2}{\pi} \\
        C_1 &= 1 - \frac{0.5\,s^2}{s^2 + 0.33} \\
        C_2 &= \frac{0.45\,s^2}{s^2 + 0.09}\max(0, \cos\varphi)\sin a\tan b \\
        a &= \max(\theta_i, \theta_r) \\
        b &= \min(\theta_i, \theta_r)
        \end{aligned}
    """
    xp = namespace(g.z_i)
    along = g.x_i * g.x_r + g.y_i * g.y_r
    backscatter = xp.where(along < 0, 0.0, along) / xp.where(g.cos_i > g.cos_r, g.cos_i, g.cos_r)
    variance = s**2
    direct = 1 - 0.5 * variance / (variance + 0.33)
    return (direct + 0.45 * variance / (variance + 0.09) * backscatter) / math.pi


def _cos_azimuth(g: Geometry, sines: Array) -> Array:
    """Cosine of the azimuth between the directions; 0 at the pole, where no azimuth exists and none matters."""
    xp = namespace(sines)
    at_pole = sines == 0
    along = g.x_i * g.x_r + g.y_i * g.y_r
    cosine = xp.where(at_pole, 0.0, along / xp.where(at_pole, 1.0, sines))
    # rounding must not carry it past 1: |cosine| multiplies tangents of 1e6 at grazing
    return xp.where(cosine > 1.0, 1.0, xp.where(cosine < -1.0, -1.0, cosine))


oren_nayar = Model(
    name="oren-nayar",
    title="Oren and Nayar's rough diffuse, full form",
    cite="oren1994",
    terms={"scale": rough_diffuse},
    violates={"energy": "rough and white, it returns a few per cent more than arrives near grazing"},
)

oren_nayar_qualitative = Model(
    name="oren-nayar-qualitative",
    title="Oren and Nayar's rough diffuse, simpler",
    cite="oren1994",
    terms={"rho": rough_diffuse_qualitative},
    violates={"energy": "white and little rough, it returns a per cent more than arrives near grazing"},
)
