"""Two models of Löw, Kronander, Ynnerman and Unger, of the ABC form: by the facet's tilt, and by direction cosines."""

import math
from typing import Annotated

from gonio.arrays import namespace
from gonio.geometry import Geometry
from gonio.model import Dimensionless, Model, Parameter, drawn_by
from gonio.optics.diffuse import lambertian
from gonio.optics.distributions import draw_power, power_normals
from gonio.optics.fresnel import Extinction, Index, unpolarised
from gonio.optics.kirchhoff import shift_squared
from gonio.optics.masking import v_groove
from gonio.optics.sampling import FacetNormals, ShiftedPower

Sharpness = Annotated[float, Parameter(100.0, 0.0, 1e6, "sharpness of the lobe (B)")]
Fall = Annotated[float, Parameter(1.2, 0.0, 5.0, "exponent of the wing (C)")]

_UNBOUNDED = {"energy": "A is the height of the lobe, and nothing bounds the light below it"}


@drawn_by(FacetNormals(power_normals, draw_power, of=lambda B, C, **_: (B, C)))
def facet_lobe(g: Geometry, B: Sharpness, C: Fall, index: Index, extinction: Extinction) -> Dimensionless:
    r"""ABC distribution of the facets' tilt, with the 1/pi of the published fits (low2012, eq 15; formulas 7.16).

    .. math::

        f_a = \frac{F(\beta)\,G}{\pi\cos\theta_i\cos\theta_r\,(1 + B\,(1 - \cos\alpha))^C}

    where F is Fresnel's reflectance (:func:`.unpolarised`) and G the masking and shadowing by V-grooves
    (:func:`.v_groove`).
    """
    tilt = g.tan_alpha_squared * g.cos_alpha**2 / (1 + g.cos_alpha)  # 1 - cos alpha with all its digits
    facets = unpolarised(g.cos_beta, index, extinction) * v_groove(g) / (math.pi * g.cos_i * g.cos_r)
    return facets * (1 + B * tilt) ** -C


@drawn_by(ShiftedPower(of=lambda B, C, **_: (B, C)))
def smooth_lobe(g: Geometry, B: Sharpness, C: Fall, index: Index, extinction: Extinction) -> Dimensionless:
    r"""ABC spectrum of a smooth surface: Rayleigh and Rice's scatter, simplified (low2012; formulas 7.16).

    .. math::

        \begin{aligned}
        f_a &= \frac{F(\beta_d)}{(1 + B\Delta^2)^C} \\
        \Delta &= 2\cos\beta\sin\alpha \\
        \beta_d &= \arccos\sqrt{1 - E/4} \\
        E &= \sin^2\theta_i + \sin^2\theta_r - 2\sin\theta_i\sin\theta_r\cos\varphi
        \end{aligned}

    where F is Fresnel's reflectance (:func:`.unpolarised`), here at the angle :math:`\beta_d`.
    """
    x, y = g.x_i - g.x_r, g.y_i - g.y_r
    squared = 1 - (x * x + y * y) / 4
    xp = namespace(squared)
    cosine = xp.sqrt(xp.where(squared < 1e-12, 1e-12, squared))
    return unpolarised(cosine, index, extinction) * (1 + B * shift_squared(g)) ** -C


low_micro = Model(
    name="low-micro",
    title="Low's ABC model of facets",
    cite="low2012",
    terms={"A": facet_lobe, "rho_d": lambertian},
    violates=_UNBOUNDED,
)

low_smooth = Model(
    name="low-smooth",
    title="Low's ABC model of smooth surfaces",
    cite="low2012",
    terms={"A": smooth_lobe, "rho_d": lambertian},
    violates=_UNBOUNDED,
)
