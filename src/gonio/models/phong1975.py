"""Powers of the cosine: Phong's shading, its reciprocal form, and Blinn's half-vector form."""

import math
from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Dimensionless, Model, Parameter, PerSteradian, drawn_by
from gonio.optics.diffuse import lambertian
from gonio.optics.distributions import draw_cosine_power
from gonio.optics.facets import cosine_power_normals, reflected
from gonio.optics.masking import v_groove
from gonio.optics.sampling import COSINE, CosineLobe, Either, FacetNormals

Shininess = Annotated[float, Parameter(20.0, 0.0, 1e4, "exponent of the lobe")]

# The floor of the cosine lights the whole hemisphere where the exponent is near 0: a little of COSINE covers it.
MIRRORED = Either(COSINE, CosineLobe(of=lambda n, **_: (n, -1.0)), 0.05)


def _mirrored(g: Geometry) -> Array:
    """Cosine between w_r and the mirror image of w_i, zero beyond a right angle."""
    cos = g.z_i * g.z_r - g.x_i * g.x_r - g.y_i * g.y_r
    # a positive floor, because the power's slope is infinite at zero; its value, below 1e-30, is nothing
    return namespace(cos).where(cos < 1e-30, 1e-30, cos)


@drawn_by(MIRRORED)
def phong_shading(g: Geometry, n: Shininess) -> Dimensionless:
    r"""Shading of 1975 as a BRDF: a cosine power about the mirror direction over cos theta_i (phong1975).

    .. math::

        \begin{aligned}
        f_s &= \frac{\max(0, E)^n}{\cos\theta_i} \\
        E &= \cos\theta_i\cos\theta_r - \sin\theta_i\sin\theta_r\cos\varphi
        \end{aligned}
    """
    return _mirrored(g) ** n / g.cos_i


@drawn_by(MIRRORED)
def normalised_phong(g: Geometry, n: Shininess) -> PerSteradian:
    r"""The same lobe without the cosine, of unit reflectance at normal incidence (lewis1994).

    .. math::

        \begin{aligned}
        f_s &= \frac{n + 2}{2\pi}\,\max(0, E)^n \\
        E &= \cos\theta_i\cos\theta_r - \sin\theta_i\sin\theta_r\cos\varphi
        \end{aligned}
    """
    return (n + 2) / (2 * math.pi) * _mirrored(g) ** n


phong = Model(
    name="phong",
    title="Cosine power about the mirror, 1975",
    cite="phong1975",
    terms={"ks": phong_shading, "kd": lambertian},
    violates={
        "reciprocity": "only the incidence cosine divides the lobe",
        "energy": "the lobe is not normalised and grows without bound at grazing",
    },
)

modified_phong = Model(
    name="modified-phong",
    title="Cosine power, reciprocal and normalised",
    cite="lewis1994",
    terms={"rho_s": normalised_phong, "rho_d": lambertian},
)


@drawn_by(FacetNormals(cosine_power_normals, draw_cosine_power, of=lambda n, **_: (n,)))
def blinn_facets(g: Geometry, n: Shininess) -> PerSteradian:
    r"""Facets whose normals follow a power of the cosine, in V-grooves (blinn1977).

    .. math::

        f_s = \frac{D\,G}{4\cos\theta_i\cos\theta_r}

    where D is Blinn's distribution of exponent n (:func:`.cosine_power_normals`) and G the masking and shadowing by
    V-grooves (:func:`.v_groove`).
    """
    return reflected(g, cosine_power_normals(g, n), v_groove(g))


blinn_phong = Model(
    name="blinn-phong",
    title="Cosine-power facets in V-grooves",
    cite="blinn1977",
    terms={"rho_s": blinn_facets, "rho_d": lambertian},
)
