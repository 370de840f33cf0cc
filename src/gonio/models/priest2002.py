"""Gaussian facets with a Fresnel factor and no masking (unpolarised element of the polarimetric model)."""

from gonio.geometry import Geometry
from gonio.model import Model, PerSteradian
from gonio.optics.diffuse import lambertian
from gonio.optics.facets import Slope, gaussian_slopes, reflected
from gonio.optics.fresnel import Extinction, Index, unpolarised


def unmasked_facets(g: Geometry, sigma: Slope, index: Index, extinction: Extinction) -> PerSteradian:
    """Gaussian facets and Fresnel, nothing masked (priest2002)."""
    return unpolarised(g.cos_beta, index, extinction) * reflected(g, gaussian_slopes(g, sigma), 1.0)


priest = Model(
    name="priest",
    title="Gaussian facets, Fresnel, no masking",
    cite="priest2002",
    terms={"ks": unmasked_facets, "kd": lambertian},
)
