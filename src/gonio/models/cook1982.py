"""Beckmann facets in V-grooves with a Fresnel factor, over an ideal diffuse floor."""

from gonio.geometry import Geometry
from gonio.model import Model, PerSteradian, drawn_by
from gonio.optics.diffuse import lambertian
from gonio.optics.distributions import draw_beckmann
from gonio.optics.facets import TotalSlope, beckmann_slopes, reflected
from gonio.optics.fresnel import Extinction, Index, unpolarised
from gonio.optics.masking import v_groove
from gonio.optics.sampling import FacetNormals

NORMALS = FacetNormals(beckmann_slopes, draw_beckmann, of=lambda m, **_: (m,))


@drawn_by(NORMALS)
def beckmann_v_grooves(g: Geometry, m: TotalSlope, index: Index, extinction: Extinction) -> PerSteradian:
    r"""Beckmann facets, Fresnel, V-grooves, normalised to energy: a quarter of the printed form (cook1982).

    .. math::

        f_s = \frac{F(\beta)\,D\,G}{4\cos\theta_i\cos\theta_r}

    where F is Fresnel's reflectance (:func:`.unpolarised`), D Beckmann's distribution of total rms slope m
    (:func:`.beckmann_slopes`) and G the masking and shadowing by V-grooves (:func:`.v_groove`).
    """
    return unpolarised(g.cos_beta, index, extinction) * reflected(g, beckmann_slopes(g, m), v_groove(g))


@drawn_by(NORMALS)
def printed_v_grooves(g: Geometry, m: TotalSlope, index: Index, extinction: Extinction) -> PerSteradian:
    r"""The same as the paper prints it, over pi where energy asks for 4 pi (cook1982).

    .. math::

        f_s = \frac{F(\beta)\,D\,G}{\cos\theta_i\cos\theta_r}

    where F is Fresnel's reflectance (:func:`.unpolarised`), D Beckmann's distribution of total rms slope m
    (:func:`.beckmann_slopes`) and G the masking and shadowing by V-grooves (:func:`.v_groove`). The D of the paper is
    :math:`\pi D` here.
    """
    return 4 * beckmann_v_grooves(g, m, index, extinction)


cook_torrance = Model(
    name="cook-torrance",
    title="Beckmann facets in V-grooves, Fresnel",
    cite="cook1982",
    terms={"rho_s": beckmann_v_grooves, "rho_d": lambertian},
)

cook_torrance_classic = Model(
    name="cook-torrance-classic",
    title="Cook-Torrance as printed, over pi",
    cite="cook1982",
    terms={"scale": printed_v_grooves, "rho_d": lambertian},
    violates={"energy": "the facets reflect four times what arrives at them"},
)
