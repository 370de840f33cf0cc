"""The materials of glTF 2.0, UsdPreviewSurface and OpenPBR as models.

Each is a sum of a part that is in proportion to the base colour and a part that is not, so the base colour is the
weight of the first, and the weight of the second is 1. Roughness r gives GGX facets of width r^2 in all of them.

Of each specification these are the parts that a measured BRDF can say something of: no emission, transmission, coat,
sheen, anisotropy or normal map.
"""

import functools
import math
from collections.abc import Callable
from typing import Annotated

import numpy as np

from gonio.arrays import Array
from gonio.geometry import GRAZING, Geometry
from gonio.model import Model, Parameter, PerSteradian
from gonio.optics.facets import ggx_slopes
from gonio.optics.fresnel import unpolarised
from gonio.optics.masking import ggx_lambda, ggx_visibility
from gonio.optics.sampling import VisibleGGX

Metallic = Annotated[float, Parameter(0.0, 0.0, 1.0, "0 a dielectric, 1 a metal")]
Roughness = Annotated[float, Parameter(0.5, 0.04, 1.0, "square root of the width of GGX facets")]
Specular = Annotated[
    float, Parameter(1.0, 0.0, 1.0, "strength of the dielectric's reflection (KHR_materials_specular)")
]
Ior = Annotated[float, Parameter(1.5, 1.0, 3.0, "refractive index of the dielectric")]

F0 = 0.04  # of glTF's dielectric, whose index is 1.5
ALBEDO_COSINES, ALBEDO_NUMBERS = 12, (24, 16)


def facets(g: Geometry, roughness: Array) -> Array:
    """Single reflection by GGX facets with height-correlated masking, without Fresnel factor [1/sr]."""
    width = roughness**2
    return ggx_slopes(g, width) * ggx_visibility(g, width)


def rise(g: Geometry) -> Array:
    """Schlick's (1 - cos beta)^5."""
    return (1 - g.cos_beta) ** 5


def gltf_base(g: Geometry, metallic: Metallic, roughness: Roughness, specular: Specular) -> PerSteradian:
    r"""What is in proportion to the base colour: the dielectric's diffuse part and the metal's reflection.

    .. math::

        f_b = (1 - m)\frac{1 - F}{\pi} + m\,(1 - (1 - \cos\beta)^5)\,S
    """
    diffuse = (1 - _gltf_fresnel(g, specular)) / math.pi
    return (1 - metallic) * diffuse + metallic * (1 - rise(g)) * facets(g, roughness)


def gltf_rest(g: Geometry, metallic: Metallic, roughness: Roughness, specular: Specular) -> PerSteradian:
    r"""What is not: the dielectric's reflection, and the rise of the metal's to 1 at grazing incidence.

    .. math::

        f_r = ((1 - m)\,F + m\,(1 - \cos\beta)^5)\,S
    """
    return ((1 - metallic) * _gltf_fresnel(g, specular) + metallic * rise(g)) * facets(g, roughness)


def _gltf_fresnel(g: Geometry, specular: Array) -> Array:
    return specular * (F0 + (1 - F0) * rise(g))


def usd_base(g: Geometry, metallic: Metallic, roughness: Roughness, ior: Ior) -> PerSteradian:
    r"""What is in proportion to the diffuse colour; a metal of it reflects alike at all angles.

    .. math::

        f_b = (1 - m)\frac{1 - F}{\pi} + m\,S
    """
    diffuse = (1 - _usd_fresnel(g, ior)) / math.pi
    return (1 - metallic) * diffuse + metallic * facets(g, roughness)


def usd_rest(g: Geometry, metallic: Metallic, roughness: Roughness, ior: Ior) -> PerSteradian:
    r"""The dielectric's reflection.

    .. math::

        f_r = (1 - m)\,F\,S
    """
    return (1 - metallic) * _usd_fresnel(g, ior) * facets(g, roughness)


def _usd_fresnel(g: Geometry, ior: Array) -> Array:
    normal = ((1 - ior) / (1 + ior)) ** 2
    return normal + (1 - normal) * rise(g)


def openpbr_base(g: Geometry, metallic: Metallic, roughness: Roughness, ior: Ior) -> PerSteradian:
    r"""What is in proportion to the base colour: light that the dielectric lets through, and the metal's reflection.

    .. math::

        f_b = (1 - m)\frac{1 - E(\theta_r)}{\pi} + m\,(1 - (1 - \cos\beta)^5)\,S

    where E is the directional albedo of the dielectric's reflection.
    """
    diffuse = (1 - dielectric_albedo(g, roughness, ior)) / math.pi
    return (1 - metallic) * diffuse + metallic * (1 - rise(g)) * facets(g, roughness)


def openpbr_rest(g: Geometry, metallic: Metallic, roughness: Roughness, ior: Ior) -> PerSteradian:
    r"""The dielectric's reflection, with Fresnel's equations, and the rise of the metal's.

    .. math::

        f_r = ((1 - m)\,F + m\,(1 - \cos\beta)^5)\,S
    """
    fresnel = unpolarised(g.cos_beta, ior, 0 * ior)
    return ((1 - metallic) * fresnel + metallic * rise(g)) * facets(g, roughness)


def dielectric_albedo(g: Geometry, roughness: Array, ior: Array) -> Array:
    """Directional albedo of a rough dielectric's reflection towards the viewer, E(theta_r), good to 0.002."""
    cos, wide, index = np.broadcast_arrays(g.cos_r, roughness, ior)
    out = np.empty(cos.shape)
    shapes, where = np.unique(np.stack([wide.ravel(), index.ravel()]), axis=1, return_inverse=True)
    for k, (one, n) in enumerate(shapes.T):
        mine = (where == k).reshape(cos.shape)
        out[mine] = _albedo(float(one), float(n))(cos[mine])
    return out


@functools.lru_cache(maxsize=64)
def _albedo(roughness: float, ior: float) -> Callable[[Array], Array]:
    """The albedo as a function of the cosine: a polynomial through ALBEDO_COSINES values.

    Each is the mean of F G/G1 over the visible facets, which are drawn at fixed numbers.
    """
    nodes = np.cos((np.arange(ALBEDO_COSINES) + 0.5) * math.pi / ALBEDO_COSINES) / 2 + 0.5
    u, v = ((np.arange(n) + 0.5) / n for n in ALBEDO_NUMBERS)
    cos, first, second = nodes[:, None, None], u[:, None], v[None, :] / 2  # the other half turn mirrors this one
    light = (np.sqrt(1 - cos**2), 0 * cos, cos)
    width = np.asarray(roughness**2)
    sampler = VisibleGGX(ggx_slopes, of=lambda width: (width, width))
    x, y, z = sampler.draw(*light, first + 0 * cos, second + 0 * cos, width=width)
    up = np.maximum(z, GRAZING)
    seen = 1 + ggx_lambda(cos, width)
    fresnel = unpolarised(Geometry(*light, x, y, z).cos_beta, np.asarray(ior), np.asarray(0.0))
    values = np.where(z > 0, fresnel * seen / (seen + ggx_lambda(up, width)), 0.0).mean(axis=(1, 2))
    return np.polynomial.Chebyshev.fit(nodes, values, ALBEDO_COSINES - 1, domain=[0, 1])


GLTF = Model(
    name="gltf",
    title="Material of glTF 2.0, metallic-roughness",
    cite="The Khronos Group (2021): glTF 2.0 Specification, appendix B",
    terms={"base": gltf_base, "one": gltf_rest},
)

USD = Model(
    name="usd-preview",
    title="Material UsdPreviewSurface",
    cite="Pixar (2023): UsdPreviewSurface Specification 2.6",
    terms={"base": usd_base, "one": usd_rest},
)

OPENPBR = Model(
    name="openpbr",
    title="Material OpenPBR Surface",
    cite="Academy Software Foundation (2024): OpenPBR Surface Specification 1.1",
    terms={"base": openpbr_base, "one": openpbr_rest},
    violates={"reciprocity": "the diffuse part is reduced by the albedo towards the viewer alone"},
)
