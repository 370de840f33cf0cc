"""Infrared reflectance of aircraft paint: a darkened diffuse part and a lobe that reflects what emission leaves."""

import math
from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerSteradian, drawn_by
from gonio.optics.distributions import draw_ggx
from gonio.optics.facets import ggx_slopes
from gonio.optics.sampling import COSINE, Either, FacetNormals

Diffuse = Annotated[float, Parameter(0.3, 0.0, 1.0, "diffuse hemispherical reflectance")]
Emissivity = Annotated[float, Parameter(0.4, 0.0, 1.0, "hemispherical emissivity")]
Grazing = Annotated[
    float, Parameter(0.2, 0.01, 0.95, "how far diffuse reflectance and emissivity fall towards grazing")
]
LobeWidth = Annotated[float, Parameter(0.2, 0.01, 1.0, "width of the specular lobe")]


@drawn_by(Either(COSINE, FacetNormals(ggx_slopes, draw_ggx, of=lambda e, **_: (e,)), 0.5))
def paint(g: Geometry, rho_d: Diffuse, eps: Emissivity, b: Grazing, e: LobeWidth) -> PerSteradian:
    r"""Diffuse part and specular lobe whose reflectances and emissivity sum to 1 (sandford1985; formulas 7.15).

    .. math::

        \begin{aligned}
        f_s &= \frac{\rho_d}{\pi}\,E(\theta_i)\,E(\theta_r)
        + \frac{\max(0, R)\,h}{4\pi H\cos\theta_r} \\
        R &= 1 - (\rho_d + \varepsilon)\,E(\theta_i) \\
        E(\theta) &= \frac{1}{J\,(1 + b^2\tan^2\theta)} \\
        J &= \frac{1}{1 - b^2}\left(1 + \frac{b^2\ln(b^2)}{1 - b^2}\right) \\
        h &= \frac{1}{(e^2\cos^2\alpha + \sin^2\alpha)^2} \\
        H &= \frac{1}{2e^2}\left(q + \frac{2e^2 + q^2}{\sqrt{q^2 + 4e^2}}\right) \\
        q &= (1 - e^2)\cos\theta_i
        \end{aligned}
    """
    xp = namespace(g.cos_i)
    mean = grazing_mean(b)
    fall_i, fall_r = _fall(g.cos_i, b) / mean, _fall(g.cos_r, b) / mean
    left = 1 - (rho_d + eps) * fall_i
    # the bounds allow rho_d + eps beyond 1: then nothing is left for the lobe
    left = xp.where(left < 0.0, 0.0, left)
    tan2 = g.tan_alpha_squared
    lobe = ((1 + tan2) / (e**2 + tan2)) ** 2
    return rho_d * fall_i * fall_r / math.pi + left * lobe / (4 * math.pi * lobe_integral(g.cos_i, e) * g.cos_r)


def grazing_mean(b: Array) -> Array:
    """Mean over the hemisphere, weighted by the cosine, of the fall towards grazing."""
    squared = b**2
    return (1 + squared / (1 - squared) * namespace(squared).log(squared)) / (1 - squared)


def lobe_integral(cos: Array, e: Array) -> Array:
    """Integral of the lobe over the hemisphere, over 4 pi, for light that arrives at this cosine."""
    narrow = (1 - e**2) * cos
    return (narrow + (2 * e**2 + narrow**2) / (narrow**2 + 4 * e**2) ** 0.5) / (2 * e**2)


def _fall(cos: Array, b: Array) -> Array:
    return cos**2 / (cos**2 + b**2 * (1 - cos**2))


sandford_robertson = Model(
    name="sandford-robertson",
    title="Sandford-Robertson paint",
    cite="sandford1985",
    terms={"scale": paint},
    violates={
        "reciprocity": "the specular lobe is normalised over theta_r alone",
        "energy": "its bounds allow a diffuse reflectance and an emissivity that add to more than 1",
    },
    confidence="reconstructed",
)
