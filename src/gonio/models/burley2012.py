"""Disney's principled model: the achromatic core with one base value."""

import math
from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Dimensionless, Model, Parameter

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


def _masking(cos: Array, width: Array) -> Array:
    """One direction's part of GGX masking over 2 cos, so that the product holds 1/(4 cos cos)."""
    return 1 / (cos + namespace(cos).sqrt(width**2 + cos**2 - width**2 * cos**2))


def _diffuse(g: Geometry, roughness: Array, subsurface: Array) -> Array:
    grazing_i, grazing_r, cos2 = _grazing(g.cos_i), _grazing(g.cos_r), g.cos_beta**2
    edge = 0.5 + 2 * cos2 * roughness
    plain = _mix(1.0, edge, grazing_i) * _mix(1.0, edge, grazing_r)
    flat = _mix(1.0, cos2 * roughness, grazing_i) * _mix(1.0, cos2 * roughness, grazing_r)
    scattered = 1.25 * (flat * (1 / (g.cos_i + g.cos_r) - 0.5) + 0.5)
    return _mix(plain, scattered, subsurface) / math.pi


def _elliptical_ggx(g: Geometry, width: Array, anisotropic: Array) -> Array:
    aspect = (1 - 0.9 * anisotropic) ** 0.5
    along, across = width / aspect, width * aspect
    slopes = (g.slope_x / along) ** 2 + (g.slope_y / across) ** 2
    return 1 / (math.pi * along * across * g.cos_alpha**4 * (1 + slopes) ** 2)


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
    """Diffuse with retro-reflection, sheen, and a GGX highlight (burley2012, formulas 7.5)."""
    grazing = _grazing(g.cos_beta)
    width = roughness**2
    normal = _mix(0.08 * specular, base, metallic)
    highlight = _elliptical_ggx(g, width, anisotropic) * _mix(normal, 1.0, grazing)
    body = base * _diffuse(g, roughness, subsurface) + sheen * grazing
    return (1 - metallic) * body + highlight * _masking(g.cos_i, width) * _masking(g.cos_r, width)


def clearcoat(g: Geometry, gloss: Gloss) -> Dimensionless:
    """A quarter of a second, GTR highlight of fixed index 1.5 (burley2012, formulas 7.5)."""
    squared = _mix(0.1, 0.001, gloss) ** 2
    xp = namespace(squared)
    cos2 = g.cos_alpha**2
    # 1 + (a^2 - 1) cos^2 in a form that keeps its digits where cos is 1 and a is a thousandth
    normals = (squared - 1) / (math.pi * xp.log(squared) * (squared * cos2 + g.tan_alpha_squared * cos2))
    fresnel = _mix(0.04, 1.0, _grazing(g.cos_beta))
    return 0.25 * normals * fresnel * _masking(g.cos_i, 0.25) * _masking(g.cos_r, 0.25)


disney = Model(
    name="disney",
    title="Disney's principled model, achromatic",
    cite="burley2012",
    terms={"scale": principled, "clearcoat": clearcoat},
    violates={"energy": "white surfaces reflect up to 1.16 of the light: the terms are added, not balanced"},
)
