"""Maxwell and Beard's model of paints, as the Nonconventional Exploitation Factors data base uses it."""

from typing import Annotated

from gonio.arrays import namespace
from gonio.geometry import Geometry
from gonio.model import Dimensionless, Model, Parameter, drawn_by
from gonio.optics.diffuse import uniform
from gonio.optics.distributions import draw_gtr
from gonio.optics.facets import gtr_normals
from gonio.optics.fresnel import Extinction, Index, unpolarised
from gonio.optics.masking import shadowing_and_obscuration
from gonio.optics.sampling import COSINE, FacetNormals

Width = Annotated[float, Parameter(0.2, 0.01, 2.0, "width of the first-surface function, as a slope")]
Tau = Annotated[float, Parameter(14.0, 1.0, 180.0, "fall of the shadowing with the local angle of incidence", "deg")]
Omega = Annotated[float, Parameter(40.0, 1.0, 180.0, "tilt at which shadowing halves", "deg")]


@drawn_by(FacetNormals(gtr_normals, draw_gtr, of=lambda s, **_: (s, 1.0)))
def first_surface(g: Geometry, s: Width, tau: Tau, Omega: Omega, index: Index, extinction: Extinction) -> Dimensionless:
    r"""Modified Cauchy first-surface reflection, shadowed and obscured (westlund2002, eq 10; formulas 7.14).

    .. math::

        f_b = \frac{F(\beta)}{F(0)}\,\frac{S\cos\alpha}{(s^2 + \tan^2\alpha)\cos\theta_i\cos\theta_r}

    where F is Fresnel's reflectance (:func:`.unpolarised`) and S the shadowing and obscuration of parameters
    :math:`\tau` and :math:`\Omega` (:func:`.shadowing_and_obscuration`).
    """
    at_normal = unpolarised(0 * g.cos_beta + 1, index, extinction)
    xp = namespace(at_normal)
    # an index of 1 reflects nothing, and nothing over nothing would follow
    fresnel = unpolarised(g.cos_beta, index, extinction) / xp.where(at_normal < 1e-12, 1e-12, at_normal)
    cauchy = g.cos_alpha / (s**2 + g.tan_alpha_squared)
    return fresnel * cauchy / (g.cos_i * g.cos_r) * shadowing_and_obscuration(g, tau, Omega)


@drawn_by(COSINE)
def volume(g: Geometry) -> Dimensionless:
    r"""Light that returns from below the surface: 2/(cos theta_i + cos theta_r) (westlund2002, eq 10).

    .. math::

        f_v = \frac{2}{\cos\theta_i + \cos\theta_r}
    """
    return 2 / (g.cos_i + g.cos_r)


maxwell_beard = Model(
    name="maxwell-beard",
    title="Maxwell-Beard, Cauchy",
    cite="westlund2002",
    terms={"B": first_surface, "rho_D": uniform, "rho_V": volume},
    violates={"energy": "the weights are radiances of the parts, and nothing bounds their sum"},
    confidence="reconstructed",
)
