"""Exponential-power facets, the larger of two scales; the smaller one's diffraction, kept in tables, is left out."""

from typing import Annotated

from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerSteradian
from gonio.optics.diffuse import lambertian
from gonio.optics.facets import exponential_power_slopes, reflected
from gonio.optics.fresnel import Extinction, Index, unpolarised
from gonio.optics.masking import exponential_power_lambda, van_ginneken

Width = Annotated[float, Parameter(0.1, 0.001, 1.0, "width of the distribution of facet slopes")]
Power = Annotated[float, Parameter(0.7, 0.2, 1.5, "power of the squared slope: 1 is Beckmann, below are tails")]


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
