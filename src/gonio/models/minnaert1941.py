"""Limb darkening of the Moon: a power of both cosines."""

import math
from typing import Annotated

from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerSteradian, drawn_by
from gonio.optics.sampling import CosineLobe

Darkening = Annotated[
    float, Parameter(0.8, 0.0, 2.0, "limb-darkening exponent: 1 is Lambertian, less is brighter rims")
]


@drawn_by(CosineLobe(of=lambda k, **_: (k, 0.0)))
def limb_darkening(g: Geometry, k: Darkening) -> PerSteradian:
    r"""Power of the product of both cosines, of unit reflectance at normal incidence (minnaert1941; formulas 7.10).

    .. math::

        f_k = \frac{k + 1}{2\pi}\,(\cos\theta_i\cos\theta_r)^{k - 1}
    """
    return (k + 1) / (2 * math.pi) * (g.cos_i * g.cos_r) ** (k - 1)


minnaert = Model(
    name="minnaert",
    title="Minnaert's limb darkening",
    cite="minnaert1941",
    terms={"rho": limb_darkening},
    violates={"energy": "for k < 1 the reflectance is rho cos(theta_i)^(k-1), which passes 1 towards grazing"},
)
