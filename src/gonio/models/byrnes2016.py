"""Metal and glass under a transparent layer: a thin film, in which light interferes, and a thick clear coat."""

from gonio.geometry import Geometry
from gonio.model import Model, PerSteradian, drawn_by
from gonio.optics.diffuse import lambertian
from gonio.optics.facets import Width, ggx_slopes
from gonio.optics.fresnel import Extinction, Index
from gonio.optics.kirchhoff import Wavelength
from gonio.optics.layers.film import CoatIndex, FilmIndex, Thickness, coat, film
from gonio.optics.masking import ggx_visibility
from gonio.optics.sampling import VisibleGGX

VISIBLE = VisibleGGX(ggx_slopes, of=lambda width, **_: (width, width))


@drawn_by(VISIBLE)
def filmed_facets(
    g: Geometry,
    width: Width,
    n_f: FilmIndex,
    thickness: Thickness,
    index: Index,
    extinction: Extinction,
    wavelength: Wavelength,
) -> PerSteradian:
    r"""GGX slopes, Smith's masking, and the reflectance of a coherent film in the place of Fresnel's.

    .. math::

        f_s = \frac{F\,D\,G}{4\cos\theta_i\cos\theta_r}

    where F is the reflectance of the film on its substrate (:func:`.film`), D the GGX distribution of width w
    (:func:`.ggx_slopes`) and G Smith's masking and shadowing (:func:`.ggx_visibility`).
    """
    reflectance = film(g.cos_beta, n_f, thickness, index, extinction, wavelength)
    return reflectance * ggx_slopes(g, width) * ggx_visibility(g, width)


@drawn_by(VISIBLE)
def coated_facets(g: Geometry, width: Width, n_c: CoatIndex, index: Index, extinction: Extinction) -> PerSteradian:
    r"""GGX slopes, Smith's masking, and the reflectance of a thick clear coat in the place of Fresnel's.

    The coat follows the facets: its upper face is as rough as the surface below.

    .. math::

        f_s = \frac{F\,D\,G}{4\cos\theta_i\cos\theta_r}

    where F is the reflectance of the coat on its substrate (:func:`.coat`), D the GGX distribution of width w
    (:func:`.ggx_slopes`) and G Smith's masking and shadowing (:func:`.ggx_visibility`).
    """
    return coat(g.cos_beta, n_c, index, extinction) * ggx_slopes(g, width) * ggx_visibility(g, width)


thin_film = Model(
    name="thin-film",
    title="GGX facets under a thin film",
    cite="byrnes2016",
    terms={"rho_s": filmed_facets, "rho_d": lambertian},
    only_named="a thickness is told by several wavelengths and known indices, not by the directions of one scan alone",
)

clear_coat = Model(
    name="clear-coat",
    title="GGX facets under a thick clear coat",
    cite="byrnes2016",
    terms={"rho_s": coated_facets, "rho_d": lambertian},
    only_named="directions alone do not tell a coated metal from another metal, unless the indices are held",
)
