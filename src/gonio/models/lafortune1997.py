"""A generalised cosine lobe: off-specular, forward or backward by the ratio of two coefficients."""

import math
from typing import Annotated

from gonio.arrays import namespace
from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerSteradian, drawn_by
from gonio.optics.diffuse import lambertian
from gonio.optics.sampling import CosineLobe

# Only the ratio of the paper's two coefficients is left once the lobe is normalised; two would not be identifiable.
Ratio = Annotated[
    float, Parameter(-0.9, -2.0, 2.0, "Cxy/Cz: -1 mirror direction, below off-specular, 1 retroreflection")
]
Exponent = Annotated[float, Parameter(10.0, 1.0, 1000.0, "exponent of the lobe")]


@drawn_by(CosineLobe(of=lambda c, n, **_: (n, c)))
def generalised_cosine(g: Geometry, c: Ratio, n: Exponent) -> PerSteradian:
    r"""Cosine lobe of unit peak coefficient, normalised (lafortune1997; formulas 7.3).

    .. math::

        \begin{aligned}
        f_s &= \frac{n + 2}{2\pi}\left(\frac{\max(0, E)}{\max(1, \lvert c\rvert)}\right)^n \\
        E &= c\,\sin\theta_i\sin\theta_r\cos\varphi + \cos\theta_i\cos\theta_r
        \end{aligned}
    """
    xp = namespace(g.z_i)
    lobe = c * (g.x_i * g.x_r + g.y_i * g.y_r) + g.z_i * g.z_r
    steep = xp.abs(c)
    lobe = lobe / xp.where(steep > 1.0, steep, 1.0)
    outside = lobe <= 0
    return (n + 2) / (2 * math.pi) * xp.where(outside, 0.0, xp.where(outside, 1.0, lobe) ** n)


lafortune = Model(
    name="lafortune",
    title="Lafortune's generalised cosine lobe",
    cite="lafortune1997",
    terms={"rho_d": lambertian, "rho_s": generalised_cosine},
)
