"""Beckmann facets in V-grooves with a Fresnel factor, over an ideal diffuse floor."""

from gonio.geometry import Geometry
from gonio.model import Model, PerSteradian
from gonio.optics.diffuse import lambertian
from gonio.optics.facets import TotalSlope, beckmann_slopes, reflected
from gonio.optics.fresnel import Extinction, Index, unpolarised
from gonio.optics.masking import v_groove


def beckmann_v_grooves(g: Geometry, m: TotalSlope, index: Index, extinction: Extinction) -> PerSteradian:
    """Beckmann facets, Fresnel, V-grooves, normalised to energy: a quarter of the printed form (cook1982)."""
    return unpolarised(g.cos_beta, index, extinction) * reflected(g, beckmann_slopes(g, m), v_groove(g))


cook_torrance = Model(
    name="cook-torrance",
    title="Beckmann facets in V-grooves, Fresnel",
    cite="cook1982",
    terms={"rho_s": beckmann_v_grooves, "rho_d": lambertian},
)
