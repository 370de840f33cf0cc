"""Disney's principled model: the achromatic core with one base value."""

import math
from typing import Annotated

from gonio.arrays import Array
from gonio.geometry import Geometry
from gonio.model import Dimensionless, Model, Parameter, drawn_by
from gonio.optics.distributions import draw_gtr
from gonio.optics.facets import ggx_slopes, gtr_normals, reflected
from gonio.optics.masking import elliptical_ggx_lambda, smith_uncorrelated
from gonio.optics.sampling import COSINE, Either, FacetNormals, VisibleGGX

Base = Annotated[float, Parameter(0.5, 0.0, 1.0, "linear base value")]
Metallic = Annotated[float, Parameter(0.0, 0.0, 1.0, "from dielectric to metal")]
Roughness = Annotated[float, Parameter(0.5, 0.05, 1.0, "perceptual roughness; its square is the slope width")]
Specular = Annotated[float, Parameter(0.5, 0.0, 1.0, "strength of the dielectric reflection")]
Subsurface = Annotated[float, Parameter(0.0, 0.0, 1.0, "share of the flatter diffuse form")]
Sheen = Annotated[float, Parameter(0.0, 0.0, 1.0, "strength of the cloth-like grazing term")]
Anisotropic = Annotated[float, Parameter(0.0, 0.0, 1.0, "stretch of the highlight along the surface's x axis")]
Gloss = Annotated[float, Parameter(1.0, 0.0, 1.0, "gloss of the clearcoat")]


def _grazing(cos: Array) -> Array:
    return (1 - cos) ** 5


def _mix(a: Array, b: Array, t: Array) -> Array:
    return a + t * (b - a)


def _diffuse(g: Geometry, roughness: Array, subsurface: Array) -> Array:
    grazing_i, grazing_r, cos2 = _grazing(g.cos_i), _grazing(g.cos_r), g.cos_beta**2
    edge = 0.5 + 2 * cos2 * roughness
    plain = _mix(1.0, edge, grazing_i) * _mix(1.0, edge, grazing_r)
    flat = _mix(1.0, cos2 * roughness, grazing_i) * _mix(1.0, cos2 * roughness, grazing_r)
    scattered = 1.25 * (flat * (1 / (g.cos_i + g.cos_r) - 0.5) + 0.5)
    return _mix(plain, scattered, subsurface) / math.pi


def _masking(g: Geometry, along: Array, across: Array) -> Array:
    return smith_uncorrelated(
        elliptical_ggx_lambda(g.x_i, g.y_i, g.cos_i, along, across),
        elliptical_ggx_lambda(g.x_r, g.y_r, g.cos_r, along, across),
    )


def _widths(roughness: Array, anisotropic: Array) -> tuple[Array, Array]:
    aspect = (1 - 0.9 * anisotropic) ** 0.5
    return roughness**2 / aspect, roughness**2 * aspect


@drawn_by(
    Either(COSINE, VisibleGGX(ggx_slopes, of=lambda roughness, anisotropic, **_: _widths(roughness, anisotropic)), 0.5)
)
def principled(
    g: Geometry,
    base: Base,
    metallic: Metallic,
    roughness: Roughness,
    specular: Specular,
    subsurface: Subsurface,
    sheen: Sheen,
    anisotropic: Anisotropic,
) -> Dimensionless:
    r"""Diffuse with retro-reflection, sheen, and a GGX highlight (burley2012, formulas 7.5).

    .. math::

        \begin{aligned}
        f_s &= (1 - \mathrm{metallic})\,B + F\,\frac{D\,G}{4\cos\theta_i\cos\theta_r} \\
        B &= \mathrm{base}\;f_b + \mathrm{sheen}\;h(\beta) \\
        F &= C + (1 - C)\,h(\beta) \\
        C &= 0.08\,(1 - \mathrm{metallic})\,\mathrm{specular} \\
        &\quad + \mathrm{metallic}\;\mathrm{base} \\
        h(\theta) &= (1 - \cos\theta)^5
        \end{aligned}

    Its diffuse part is

    .. math::

        \begin{aligned}
        f_b &= (1 - \mathrm{subsurface})\,P(E)/\pi \\
        &\quad + \mathrm{subsurface}\;S/\pi \\
        P(t) &= (1 + (t - 1)\,h_i)(1 + (t - 1)\,h_r) \\
        h_i &= h(\theta_i) \\
        h_r &= h(\theta_r) \\
        E &= 0.5 + 2\,\mathrm{roughness}\,\cos^2\beta \\
        S &= 1.25\,(P(V)\,U + 0.5) \\
        U &= \frac{1}{\cos\theta_i + \cos\theta_r} - 0.5 \\
        V &= \mathrm{roughness}\,\cos^2\beta
        \end{aligned}

    and its facets are GGX facets of two widths:

    .. math::

        \begin{aligned}
        D &= \frac{1}{\pi a_x a_y\cos^4\alpha\,(1 + s_x^2/a_x^2 + s_y^2/a_y^2)^2} \\
        G &= \frac{1}{(1 + \Lambda_i)(1 + \Lambda_r)} \\
        \Lambda_i &= \frac{1}{2}\left(\sqrt{1 + \frac{a_x^2 x_i^2 + a_y^2 y_i^2}{z_i^2}} - 1\right) \\
        \Lambda_r &= \frac{1}{2}\left(\sqrt{1 + \frac{a_x^2 x_r^2 + a_y^2 y_r^2}{z_r^2}} - 1\right) \\
        a_x &= \frac{\mathrm{roughness}^2}{\sqrt{1 - 0.9\,\mathrm{anisotropic}}} \\
        a_y &= \mathrm{roughness}^2\,\sqrt{1 - 0.9\,\mathrm{anisotropic}}
        \end{aligned}
    """
    grazing = _grazing(g.cos_beta)
    normal = _mix(0.08 * specular, base, metallic)
    widths = _widths(roughness, anisotropic)
    highlight = reflected(g, ggx_slopes(g, *widths), _masking(g, *widths))
    body = base * _diffuse(g, roughness, subsurface) + sheen * grazing
    return (1 - metallic) * body + _mix(normal, 1.0, grazing) * highlight


@drawn_by(FacetNormals(gtr_normals, draw_gtr, of=lambda gloss, **_: (_mix(0.1, 0.001, gloss), 1.0)))
def clearcoat(g: Geometry, gloss: Gloss) -> Dimensionless:
    r"""A quarter of a second, GTR highlight of fixed index 1.5 (burley2012, formulas 7.5).

    .. math::

        \begin{aligned}
        f_c &= \frac{F}{4}\,\frac{D\,G}{4\cos\theta_i\cos\theta_r} \\
        F &= 0.04 + 0.96\,(1 - \cos\beta)^5 \\
        D &= \frac{w^2 - 1}{\pi\ln(w^2)\,(w^2\cos^2\alpha + \sin^2\alpha)} \\
        w &= 0.1 - 0.099\,\mathrm{gloss} \\
        G &= \frac{1}{(1 + \Lambda(\theta_i))(1 + \Lambda(\theta_r))} \\
        \Lambda(\theta) &= \frac{1}{2}\left(\sqrt{1 + 0.25^2\tan^2\theta} - 1\right)
        \end{aligned}
    """
    normals = gtr_normals(g, _mix(0.1, 0.001, gloss), 1.0)
    fresnel = _mix(0.04, 1.0, _grazing(g.cos_beta))
    return 0.25 * fresnel * reflected(g, normals, _masking(g, 0.25, 0.25))


disney = Model(
    name="disney",
    title="Disney's principled model, achromatic",
    cite="burley2012",
    terms={"scale": principled, "clearcoat": clearcoat},
    violates={"energy": "white surfaces reflect up to 1.16 of the light: the terms are added, not balanced"},
)
