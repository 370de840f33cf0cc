"""Gaussian facets with a Fresnel factor and no masking: the polarimetric model and its unpolarised element."""

from gonio.arrays import Array
from gonio.geometry import Geometry
from gonio.model import Model, MuellerPerSteradian, PerSteradian, drawn_by
from gonio.optics.diffuse import lambertian
from gonio.optics.distributions import draw_gaussian
from gonio.optics.facets import Slope, gaussian_slopes, reflected
from gonio.optics.fresnel import Extinction, Index, unpolarised
from gonio.optics.mueller import reflection
from gonio.optics.sampling import FacetNormals

NORMALS = FacetNormals(gaussian_slopes, draw_gaussian, of=lambda sigma, **_: (sigma,))


def unmasked(g: Geometry, sigma: Array) -> Array:
    r"""Gaussian facets, every one of them lit and seen.

    .. math::

        f_g = \frac{1}{8\pi\sigma^2}\,\frac{1}{\cos\theta_i\cos\theta_r\cos^4\alpha}
        \exp\left(-\frac{\tan^2\alpha}{2\sigma^2}\right)
    """
    return reflected(g, gaussian_slopes(g, sigma), 1.0)


@drawn_by(NORMALS)
def unmasked_facets(g: Geometry, sigma: Slope, index: Index, extinction: Extinction) -> PerSteradian:
    r"""Gaussian facets and Fresnel, nothing masked (priest2002).

    .. math::

        f_s = F(\beta)\,f_g

    where F is Fresnel's reflectance (:func:`.unpolarised`) and :math:`f_g` the reflection of perfect mirrors of rms
    slope :math:`\sigma` per axis (:func:`.unmasked`).
    """
    return unpolarised(g.cos_beta, index, extinction) * unmasked(g, sigma)


@drawn_by(NORMALS)
def polarising_facets(g: Geometry, sigma: Slope, index: Index, extinction: Extinction) -> MuellerPerSteradian:
    r"""The Mueller matrix of the same: Gaussian facets, nothing masked, nothing depolarised (priest2002).

    .. math::

        f_s = f_g\,M

    where :math:`f_g` is the reflection of perfect mirrors of rms slope :math:`\sigma` per axis (:func:`.unmasked`)
    and M the Mueller matrix of a facet (:func:`.reflection`).
    """
    return unmasked(g, sigma)[..., None, None] * reflection(g, index, extinction)


UNMASKED = {"energy": "nothing is masked, so that rough facets near grazing reflect more than arrives"}

priest = Model(
    name="priest",
    title="Gaussian facets, Fresnel, no masking",
    cite="priest2002",
    terms={"ks": unmasked_facets, "kd": lambertian},
    violates=UNMASKED,
)

priest_mueller = Model(
    name="priest-mueller",
    title="Polarimetric Gaussian facets, no masking",
    cite="priest2002",
    terms={"ks": polarising_facets, "kd": lambertian},
    violates=UNMASKED,
)
