"""An energy-conserving Phong lobe with Fresnel weight, and the diffuse light that it leaves (isotropic form)."""

import math
from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerSteradian, drawn_by
from gonio.optics.distributions import draw_cosine_power
from gonio.optics.facets import cosine_power_normals
from gonio.optics.fresnel import schlick
from gonio.optics.sampling import COSINE, FacetNormals

Specular = Annotated[float, Parameter(0.5, 0.0, 1.0, "specular reflectance at normal incidence")]
Exponent = Annotated[float, Parameter(50.0, 0.0, 100000.0, "exponent of the distribution of facet normals")]


@drawn_by(FacetNormals(cosine_power_normals, draw_cosine_power, of=lambda n, **_: (n - 1,)))
def fresnel_lobe(g: Geometry, rs: Specular, n: Exponent) -> PerSteradian:
    r"""Power of the facet tilt's cosine, times Schlick's reflectance (ashikhmin2000; formulas 7.4).

    .. math::

        \begin{aligned}
        f_s &= \frac{n + 1}{8\pi}\,\frac{F\cos^n\alpha}{\cos\beta\,\max(\cos\theta_i, \cos\theta_r)} \\
        F &= r_s + (1 - r_s)(1 - \cos\beta)^5
        \end{aligned}
    """
    larger = namespace(g.cos_i).where(g.cos_i > g.cos_r, g.cos_i, g.cos_r)
    return (n + 1) / (8 * math.pi) * g.cos_alpha**n * schlick(g.cos_beta, rs) / (g.cos_beta * larger)


@drawn_by(COSINE)
def coupled_diffuse(g: Geometry, rs: Specular) -> PerSteradian:
    r"""Diffuse reflection of the light that the specular lobe leaves (ashikhmin2000; formulas 7.4).

    .. math::

        \begin{aligned}
        f_d &= \frac{28}{23\pi}\,(1 - r_s)\,E(\theta_i)\,E(\theta_r) \\
        E(\theta) &= 1 - \left(1 - \frac{\cos\theta}{2}\right)^5
        \end{aligned}
    """
    return 28 / (23 * math.pi) * (1 - rs) * _left(g.cos_i) * _left(g.cos_r)


def _left(cos: Array) -> Array:
    c = cos / 2  # multiplied out, E keeps its digits near the horizon
    return c * (5 - c * (10 - c * (10 - c * (5 - c))))


ashikhmin_shirley = Model(
    name="ashikhmin-shirley",
    title="Ashikhmin and Shirley's Phong, isotropic",
    cite="ashikhmin2000",
    terms={"ks": fresnel_lobe, "rho_d": coupled_diffuse},
)
