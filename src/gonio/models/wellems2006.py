"""Polarimetric facets with the hyper-Cauchy distribution, made for the long-wave infrared."""

from typing import Annotated

from gonio.arrays import Array
from gonio.geometry import Geometry
from gonio.model import Model, MuellerPerSteradian, Parameter, drawn_by
from gonio.optics.diffuse import lambertian
from gonio.optics.distributions import draw_student
from gonio.optics.facets import hyper_cauchy_slopes, reflected
from gonio.optics.fresnel import Extinction, Index
from gonio.optics.masking import v_groove
from gonio.optics.mueller import reflection
from gonio.optics.sampling import FacetNormals

Spread = Annotated[float, Parameter(0.2, 0.01, 1.0, "width of the hyper-Cauchy distribution, as a slope")]
Tail = Annotated[float, Parameter(1.8, 1.1, 20.0, "exponent of the tail: 2 is GGX, large is Gaussian")]


def _draw(u: Array, v: Array, s: Array, q: Array) -> tuple[Array, Array]:
    return draw_student(u, v, s * (2 / (q - 1)) ** 0.5, q)


@drawn_by(FacetNormals(hyper_cauchy_slopes, _draw, of=lambda s, q, **_: (s, q)))
def hyper_cauchy_facets(g: Geometry, s: Spread, q: Tail, index: Index, extinction: Extinction) -> MuellerPerSteradian:
    r"""Mueller matrix of hyper-Cauchy facets; V-grooves stand for the paper's own masking (wellems2006).

    .. math::

        f_s = \frac{D\,G}{4\cos\theta_i\cos\theta_r}\,M

    where D is the hyper-Cauchy distribution of width s and tail q (:func:`.hyper_cauchy_slopes`), G the masking and
    shadowing by V-grooves (:func:`.v_groove`) and M the Mueller matrix of a facet (:func:`.reflection`).
    """
    return reflected(g, hyper_cauchy_slopes(g, s, q), v_groove(g))[..., None, None] * reflection(g, index, extinction)


wellems = Model(
    name="wellems",
    title="Polarimetric hyper-Cauchy",
    cite="wellems2006",
    terms={"ks": hyper_cauchy_facets, "kd": lambertian},
    confidence="reconstructed",
)
