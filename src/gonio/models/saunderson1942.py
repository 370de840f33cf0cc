"""Paint and paper: a diffuse body below a boundary, under the facets of that boundary or of a surface of its own."""

from collections.abc import Mapping

from gonio.geometry import Geometry
from gonio.model import Model, PerSteradian, drawn_by
from gonio.models.walter2007 import Tail, student_facets
from gonio.optics.distributions import draw_student
from gonio.optics.facets import Width, reflected, student_slopes
from gonio.optics.fresnel import dielectric
from gonio.optics.layers.body import Binder, absorption_over_scattering, body_reflectance, coated_body
from gonio.optics.masking import smith, student_lambda
from gonio.optics.sampling import FacetNormals


@drawn_by(FacetNormals(student_slopes, draw_student, of=lambda width, c, **_: (width, c)))
def binder_facets(g: Geometry, width: Width, c: Tail, n_b: Binder) -> PerSteradian:
    r"""The binder's surface: Student's t slopes, their exact Smith masking, Fresnel (ribardiere2017).

    .. math::

        f_s = \frac{F(\beta)\,D\,G}{4\cos\theta_i\cos\theta_r}

    where F is Fresnel's reflectance (:func:`.dielectric`) of the index :math:`n_b`, D Student's t of width w and
    exponent c (:func:`.student_slopes`) and G Smith's masking and shadowing (:func:`.smith`) with :math:`\Lambda`
    (:func:`.student_lambda`).
    """
    masking = smith(student_lambda(g.cos_i, width, c), student_lambda(g.cos_r, width, c))
    return dielectric(g.cos_beta, n_b) * reflected(g, student_slopes(g, width, c), masking)


def _rho(values: Mapping[str, float]) -> float:
    """Reflectance of the body itself, without the boundary."""
    return float(body_reflectance(values["rho_b"], values["n_b"]))


BODY = {"rho": _rho, "K/S": lambda values: float(absorption_over_scattering(_rho(values)))}

coated = Model(
    name="coated-body",
    title="Binder facets, coated body",
    cite="saunderson1942",
    terms={"rho_s": binder_facets, "rho_b": coated_body},
    confidence="reconstructed",
    combinations=BODY,
)

student_t_coated = Model(
    name="student-t-coated",
    title="Student-t facets, coating",
    cite="saunderson1942",
    terms={"rho_s": student_facets, "rho_b": coated_body},
    confidence="reconstructed",
    combinations=BODY,
)
