"""Three components with a Cauchy-Lorentz directional-diffuse lobe (guo2023), and its reciprocal form."""

import math
from typing import Annotated

from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerDegree, PerSteradian, drawn_by
from gonio.optics.diffuse import lambertian, uniform
from gonio.optics.distributions import draw_lorentz_angle, lorentz_angle
from gonio.optics.facets import gaussian_facets
from gonio.optics.lorentz import hemispherical_integral, profile
from gonio.optics.sampling import PolarLobe
from gonio.units import to_radians

HalfWidth = Annotated[
    float, Parameter(45.0, 1.0, 720.0, "half width at half maximum of the directional-diffuse lobe", "deg")
]

LORENTZ = PolarLobe(draw_lorentz_angle, lorentz_angle, of=lambda gamma, **_: (to_radians(gamma),))


@drawn_by(LORENTZ)
def lorentz_lobe(g: Geometry, gamma: HalfWidth) -> PerDegree:
    r"""Multiple reflections: a Cauchy-Lorentz lobe about the surface normal, angles in degrees (eq 7).

    .. math::

        f_{dd} = \frac{1}{\pi}\,\frac{\gamma}{\theta_r^2 + \gamma^2}

    where all angles are in degrees.
    """
    return gamma / (math.pi * (g.theta_r_squared + gamma**2))


@drawn_by(LORENTZ)
def reciprocal_lorentz_lobe(g: Geometry, gamma: HalfWidth) -> PerSteradian:
    r"""The same lobe at both ends, L(theta_i) L(theta_r)/H: reciprocal, of reflectance L(theta_i) (formulas 5).

    .. math::

        f_{dd} = \frac{L(\theta_i)\,L(\theta_r)}{H}

    where L is the Lorentz profile of half width :math:`\gamma` (:func:`.profile`) and H its integral over the
    hemisphere (:func:`.hemispherical_integral`).
    """
    return profile(g.theta_i_squared, gamma) * profile(g.theta_r_squared, gamma) / hemispherical_integral(gamma)


cauchy_lorentz = Model(
    name="cauchy-lorentz",
    title="Three components, Cauchy-Lorentz lobe",
    cite="guo2023",
    terms={"ks": gaussian_facets, "kdd": lorentz_lobe, "kid": uniform},
    violates={
        "reciprocity": "the directional-diffuse lobe depends on theta_r alone",
        "energy": "the lobe is not normalised, so no weight is a reflectance and nothing bounds their sum",
    },
    combinations={"kdd/(pi gamma)": lambda values: values["kdd"] / (math.pi * values["gamma"])},
)

cauchy_lorentz_reciprocal = Model(
    name="cauchy-lorentz-reciprocal",
    title="Cauchy-Lorentz, reciprocal and normalised",
    cite="guo2023",
    terms={"rho_s": gaussian_facets, "rho_dd": reciprocal_lorentz_lobe, "rho_id": lambertian},
)
