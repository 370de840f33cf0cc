"""Exponential-power facets, the larger of two scales; the smaller one's diffraction, kept in tables, is left out."""

from typing import Annotated

from gonio.arrays import Array, namespace, special
from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerSteradian, drawn_by
from gonio.optics.diffuse import lambertian
from gonio.optics.distributions import draw_student
from gonio.optics.facets import exponential_power_slopes, reflected, student_slopes
from gonio.optics.fresnel import Extinction, Index, unpolarised
from gonio.optics.masking import exponential_power_lambda, van_ginneken
from gonio.optics.sampling import FacetNormals

Width = Annotated[float, Parameter(0.1, 0.001, 1.0, "width of the distribution of facet slopes")]
Power = Annotated[float, Parameter(0.7, 0.2, 1.5, "power of the squared slope: 1 is Beckmann, below are tails")]

MEDIAN = 0.7  # of the squared slope, about, over its mean: that of GGX is its squared width
STEEPEST = 1.0  # width that is drawn: most facets of larger slopes mirror the light below the horizon


def _wide_slopes(width: Array, p: Array, **_: Array) -> tuple[Array, Array]:
    """GGX as wide as the distribution, whose squared slope has the mean width^2 Gamma(2/p)/Gamma(1/p).

    GGX falls more slowly than any exponential power does in the end, so that no light is missed.
    """
    mean = namespace(p).exp(special("gammaln", 2 / p) - special("gammaln", 1 / p))
    wide = width * (MEDIAN * mean) ** 0.5
    return namespace(p).where(wide > STEEPEST, STEEPEST, wide), 2.0 + 0 * p


@drawn_by(FacetNormals(student_slopes, draw_student, of=_wide_slopes))
def exponential_power_facets(g: Geometry, width: Width, p: Power, index: Index, extinction: Extinction) -> PerSteradian:
    r"""Exponential-power slopes, their exact Smith masking correlated by azimuth, Fresnel (holzschuch2017).

    .. math::

        f_s = \frac{F(\beta)\,D\,G}{4\cos\theta_i\cos\theta_r}

    where F is Fresnel's reflectance (:func:`.unpolarised`), D the distribution of width w and power p
    (:func:`.exponential_power_slopes`) and G Smith's masking (:func:`.van_ginneken`) with
    :math:`\Lambda` (:func:`.exponential_power_lambda`).
    """
    lambdas = (exponential_power_lambda(cos, width, p) for cos in (g.cos_i, g.cos_r))
    masking = van_ginneken(g, *lambdas)
    return unpolarised(g.cos_beta, index, extinction) * reflected(g, exponential_power_slopes(g, width, p), masking)


exponential_power = Model(
    name="exponential-power",
    title="Exponential-power facets, Smith, Fresnel",
    cite="holzschuch2017",
    terms={"rho_s": exponential_power_facets, "rho_d": lambertian},
)
