"""Rahman, Pinty and Verstraete's surfaces: Minnaert's powers, a phase function and a hot spot."""

import math
from typing import Annotated

from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerSteradian
from gonio.optics.phase import cos_phase, guarded_root, tangent_distance_squared

Bowl = Annotated[float, Parameter(0.8, 0.0, 2.0, "exponent of the cosines: below 1 a bowl, above 1 a bell")]
Asymmetry = Annotated[float, Parameter(-0.1, -0.95, 0.95, "asymmetry of the phase function: below 0 backward")]
HotSpot = Annotated[float, Parameter(0.1, 0.0, 1.0, "hot-spot parameter, often set equal to r0: 1 is no hot spot")]


def bowl_with_hot_spot(g: Geometry, k: Bowl, theta: Asymmetry, rc: HotSpot) -> PerSteradian:
    r"""Powers of the cosines, Henyey-Greenstein's phase function and a hot spot (rahman1993; formulas 7.12).

    .. math::

        \begin{aligned}
        f_r &= \frac{1}{\pi}\,M^{k - 1}\,P\,E \\
        M &= \cos\theta_i\cos\theta_r\,(\cos\theta_i + \cos\theta_r) \\
        P &= \frac{1 - \Theta^2}{(1 + \Theta^2 + 2\Theta\cos 2\beta)^{3/2}} \\
        E &= 1 + \frac{1 - r_c}{1 + \sqrt{T}} \\
        T &= \tan^2\theta_i + \tan^2\theta_r - 2\tan\theta_i\tan\theta_r\cos\varphi
        \end{aligned}
    """
    cos = cos_phase(g)
    powers = (g.cos_i * g.cos_r * (g.cos_i + g.cos_r)) ** (k - 1)
    phase = (1 - theta**2) / (1 + theta**2 + 2 * theta * cos) ** 1.5
    hot_spot = 1 + (1 - rc) / (1 + guarded_root(tangent_distance_squared(g)))
    return powers * phase * hot_spot / math.pi


rpv = Model(
    name="rpv",
    title="Rahman, Pinty and Verstraete's land surface",
    cite="rahman1993",
    terms={"r0": bowl_with_hot_spot},
    violates={
        "energy": "r0 is an amplitude, not a reflectance, and for k < 1 the powers grow without bound at grazing"
    },
)
