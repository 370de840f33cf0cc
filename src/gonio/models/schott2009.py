"""Torrance-Sparrow with a distribution of facet tilts per solid angle, reconstructed."""

import math
from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerSteradian, drawn_by
from gonio.optics.diffuse import lambertian
from gonio.optics.distributions import angle_normals, draw_angle
from gonio.optics.facets import reflected
from gonio.optics.fresnel import Extinction, Index, unpolarised
from gonio.optics.masking import v_groove
from gonio.optics.quadrature import unit_interval
from gonio.optics.sampling import FacetNormals
from gonio.units import to_radians

Tilt = Annotated[float, Parameter(12.0, 1.0, 45.0, "standard deviation of the facet tilt", "deg")]
# Which density the Gaussian of the tilt is: of area, of projected area, or of slope.
Power = Annotated[float, Parameter(1.0, 0.0, 4.0, "j: 0 area density, 1 projected area, 4 slope density")]


@drawn_by(FacetNormals(angle_normals, draw_angle, of=lambda tilt, **_: (to_radians(tilt),)))
def tilted_facets(g: Geometry, tilt: Tilt, j: Power, index: Index, extinction: Extinction) -> PerSteradian:
    r"""Gaussian in the tilt angle, in V-grooves, Fresnel, over cos^j alpha (formulas 6.3, reconstructed).

    .. math::

        \begin{aligned}
        f_s &= \frac{F(\beta)\,G\,p}{4\cos\theta_i\cos\theta_r\cos^j\alpha} \\
        p &= \frac{1}{2\pi E}\exp\left(-\frac{\alpha^2}{2s^2}\right) \\
        E &= \int_0^{\pi/2} \exp\left(-\frac{a^2}{2s^2}\right)\sin a\,\mathrm{d}a \\
        s &= \frac{\pi}{180}\,\mathrm{tilt}
        \end{aligned}

    where F is Fresnel's reflectance (:func:`.unpolarised`) and G the masking and shadowing by V-grooves
    (:func:`.v_groove`).
    """
    xp = namespace(g.tan_alpha_squared)
    width = tilt * (math.pi / 180)
    flat = g.tan_alpha_squared < 1e-24
    alpha = xp.where(flat, 0.0, xp.atan(xp.sqrt(xp.where(flat, 1.0, g.tan_alpha_squared))))
    density = xp.exp(-(alpha**2) / (2 * width**2)) / (2 * math.pi * _tilt_integral(width))
    return unpolarised(g.cos_beta, index, extinction) * reflected(g, density / g.cos_alpha**j, v_groove(g))


def _tilt_integral(width: Array) -> Array:
    """Integral of exp(-a^2/(2 width^2)) sin a over tilts up to 90 deg, stepped by the width so no lobe is missed."""
    xp = namespace(width)
    end = xp.where(9 * width < math.pi / 2, 9 * width, math.pi / 2)
    nodes, weights = unit_interval(64, width)
    a = end[..., None] * nodes
    return end * xp.sum(weights * xp.exp(-(a**2) / (2 * width[..., None] ** 2)) * xp.sin(a), axis=-1)


alternate_torrance_sparrow = Model(
    name="alternate-torrance-sparrow",
    title="Gaussian facet tilts",
    cite="schott2009",
    terms={"ks": tilted_facets, "kd": lambertian},
    violates={"energy": "a density of tilts is none of slopes: steep facets near grazing reflect more than arrives"},
    confidence="reconstructed",
)
