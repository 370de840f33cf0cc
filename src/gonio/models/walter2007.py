"""Rough conductors and dielectrics: facets with Smith's height-correlated masking and a Fresnel factor."""

from typing import Annotated

from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerSteradian, drawn_by
from gonio.optics.diffuse import lambertian
from gonio.optics.distributions import draw_student
from gonio.optics.facets import TotalSlope, Width, beckmann_slopes, ggx_slopes, reflected, student_slopes
from gonio.optics.fresnel import Extinction, Index, unpolarised
from gonio.optics.masking import beckmann_lambda, ggx_visibility, smith, student_lambda
from gonio.optics.sampling import FacetNormals, VisibleBeckmann, VisibleGGX

Tail = Annotated[float, Parameter(2.5, 1.55, 40.0, "exponent of the tail: 2 is GGX, large is Beckmann")]


@drawn_by(VisibleBeckmann(beckmann_slopes, of=lambda m, **_: (m,)))
def beckmann_facets(g: Geometry, m: TotalSlope, index: Index, extinction: Extinction) -> PerSteradian:
    r"""Gaussian slopes, Smith's masking, Fresnel (walter2007).

    .. math::

        f_s = \frac{F(\beta)\,D\,G}{4\cos\theta_i\cos\theta_r}

    where F is Fresnel's reflectance (:func:`.unpolarised`), D Beckmann's distribution of total rms slope m
    (:func:`.beckmann_slopes`) and G Smith's masking and shadowing (:func:`.smith`) with :math:`\Lambda`
    (:func:`.beckmann_lambda`).
    """
    masking = smith(beckmann_lambda(g.cos_i, m), beckmann_lambda(g.cos_r, m))
    return unpolarised(g.cos_beta, index, extinction) * reflected(g, beckmann_slopes(g, m), masking)


@drawn_by(VisibleGGX(ggx_slopes, of=lambda width, **_: (width, width)))
def ggx_facets(g: Geometry, width: Width, index: Index, extinction: Extinction) -> PerSteradian:
    r"""GGX slopes, Smith's masking, Fresnel (walter2007).

    .. math::

        f_s = \frac{F(\beta)\,D\,G}{4\cos\theta_i\cos\theta_r}

    where F is Fresnel's reflectance (:func:`.unpolarised`), D the GGX distribution of width w (:func:`.ggx_slopes`)
    and G Smith's masking and shadowing (:func:`.ggx_visibility`).
    """
    return unpolarised(g.cos_beta, index, extinction) * ggx_slopes(g, width) * ggx_visibility(g, width)


@drawn_by(FacetNormals(student_slopes, draw_student, of=lambda width, c, **_: (width, c)))
def student_facets(g: Geometry, width: Width, c: Tail, index: Index, extinction: Extinction) -> PerSteradian:
    r"""Student's t slopes, their exact Smith masking, Fresnel (ribardiere2017).

    .. math::

        f_s = \frac{F(\beta)\,D\,G}{4\cos\theta_i\cos\theta_r}

    where F is Fresnel's reflectance (:func:`.unpolarised`), D Student's t of width w and exponent c
    (:func:`.student_slopes`) and G Smith's masking and shadowing (:func:`.smith`) with :math:`\Lambda`
    (:func:`.student_lambda`).
    """
    masking = smith(student_lambda(g.cos_i, width, c), student_lambda(g.cos_r, width, c))
    return unpolarised(g.cos_beta, index, extinction) * reflected(g, student_slopes(g, width, c), masking)


beckmann = Model(
    name="beckmann",
    title="Gaussian facets, Smith masking, Fresnel",
    cite="walter2007",
    terms={"rho_s": beckmann_facets, "rho_d": lambertian},
)

ggx = Model(
    name="ggx",
    title="GGX facets, Smith masking, Fresnel",
    cite="walter2007",
    terms={"rho_s": ggx_facets, "rho_d": lambertian},
)

student_t = Model(
    name="student-t",
    title="Student-t facets, Smith masking, Fresnel",
    cite="ribardiere2017",
    terms={"rho_s": student_facets, "rho_d": lambertian},
)
