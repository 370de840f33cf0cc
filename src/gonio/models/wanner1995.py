"""Land surfaces as a sum of kernels: Ross's thick canopy and Li's sparse crowns in the reciprocal form.

The crowns are spheres (b/r = 1) whose centres stand at twice their radius (h/b = 2), as in the MODIS product.
"""

import math

from gonio.arrays import namespace
from gonio.geometry import Geometry
from gonio.model import Model, PerSteradian
from gonio.optics.diffuse import lambertian
from gonio.optics.phase import cos_phase, guarded_root, sin_half_phase, tangent_distance_squared

CROWN_HEIGHT = 2.0


def ross_thick(g: Geometry) -> PerSteradian:
    r"""Volume scattering in a dense canopy of leaves: the kernel over pi (wanner1995; formulas 7.13).

    .. math::

        f_v = \frac{1}{\pi}\left(\frac{(\pi/2 - 2\beta)\cos 2\beta + \sin 2\beta}{\cos\theta_i + \cos\theta_r}
        - \frac{\pi}{4}\right)
    """
    sin_half = sin_half_phase(g)
    phase = 2 * namespace(sin_half).atan2(sin_half, g.cos_beta)
    scattered = (math.pi / 2 - phase) * cos_phase(g) + 2 * sin_half * g.cos_beta
    return (scattered / (g.cos_i + g.cos_r) - math.pi / 4) / math.pi


def li_sparse_reciprocal(g: Geometry) -> PerSteradian:
    r"""Shadows of sparse crowns seen from the side of the light or not: the kernel over pi (formulas 7.13).

    .. math::

        \begin{aligned}
        f_g &= \frac{1}{\pi}\left(O - E + \frac{1 + \cos 2\beta}{2\cos\theta_i\cos\theta_r}\right) \\
        E &= \frac{1}{\cos\theta_i} + \frac{1}{\cos\theta_r} \\
        O &= \frac{E}{\pi}\,(t - \sin t\cos t) \\
        t &= \arccos(\min(1, 2\sqrt{T}/E)) \\
        T &= \tan^2\theta_i + \tan^2\theta_r - 2\tan\theta_i\tan\theta_r\cos\varphi \\
        &+ \tan^2\theta_i\tan^2\theta_r\sin^2\varphi
        \end{aligned}
    """
    sec_i, sec_r = 1 / g.cos_i, 1 / g.cos_r
    both = sec_i + sec_r
    across = (g.x_i * g.y_r - g.y_i * g.x_r) * sec_i * sec_r
    cos2 = CROWN_HEIGHT**2 * (tangent_distance_squared(g) + across**2) / both**2
    # sin and cos of the overlap angle by guarded roots: beyond cos = 1 the shadows no longer meet
    sin, cos = guarded_root(1 - cos2), guarded_root(cos2)
    angle = namespace(cos2).atan2(sin, cos)
    overlap = (angle - sin * cos) * both / math.pi
    return (overlap - both + (1 + cos_phase(g)) * sec_i * sec_r / 2) / math.pi


ross_li = Model(
    name="ross-li",
    title="Ross-Thick, Li-Sparse reciprocal kernels",
    cite="wanner1995",
    terms={"fiso": lambertian, "fvol": ross_thick, "fgeo": li_sparse_reciprocal},
    violates={
        "positivity": "two kernels are departures from the nadir, where they are 0, and negative in many directions",
        "energy": "the reflectance of the volume kernel passes 1 beyond 85 deg, and only fiso is a reflectance",
    },
)
