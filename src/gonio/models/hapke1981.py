"""Particulate surfaces by radiative transfer: single scattering exact, multiple scattering isotropic, opposition surge.

Without macroscopic roughness, and with the first approximation of the H function.
"""

import math
from typing import Annotated

from gonio.arrays import Array
from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerSteradian
from gonio.optics.phase import cos_phase, sin_half_phase

# 0.999: the slope of sqrt(1 - w) has no bound at 1
Albedo = Annotated[float, Parameter(0.8, 0.0, 0.999, "single-scattering albedo of the particles")]
Asymmetry = Annotated[float, Parameter(0.3, 0.0, 0.95, "width of the phase function's lobes: 0 is isotropic")]
Backward = Annotated[float, Parameter(0.2, -1.0, 1.0, "share of the phase function: 1 backward lobe, -1 forward lobe")]
Surge = Annotated[float, Parameter(0.5, 0.0, 1.0, "amplitude of the opposition surge")]
SurgeWidth = Annotated[float, Parameter(0.06, 0.001, 1.0, "angular width of the opposition surge")]


def particulate(g: Geometry, w: Albedo, b: Asymmetry, c: Backward, b0: Surge, h: SurgeWidth) -> PerSteradian:
    r"""Single and multiple scattering by particles, two-term Henyey-Greenstein (hapke1981; formulas 7.11).

    .. math::

        \begin{aligned}
        f_p &= \frac{w}{4\pi}\,\frac{(1 + B)\,P + H(\theta_i)\,H(\theta_r) - 1}{\cos\theta_i + \cos\theta_r} \\
        B &= \frac{b_0}{1 + \tan\beta/h} \\
        P &= \frac{1 + c}{2}\,J(\cos 2\beta) + \frac{1 - c}{2}\,J(-\cos 2\beta) \\
        J(x) &= \frac{1 - b^2}{(1 - 2bx + b^2)^{3/2}} \\
        H(\theta) &= \frac{1 + 2\cos\theta}{1 + 2\cos\theta\,\sqrt{1 - w}}
        \end{aligned}
    """
    cos = cos_phase(g)
    surge = b0 / (1 + sin_half_phase(g) / g.cos_beta / h)
    phase = (1 + c) / 2 * _lobe(cos, b) + (1 - c) / 2 * _lobe(-cos, b)
    several = _multiple(g.cos_i, w) * _multiple(g.cos_r, w) - 1
    return w / (4 * math.pi * (g.cos_i + g.cos_r)) * ((1 + surge) * phase + several)


def _lobe(cos: Array, b: Array) -> Array:
    return (1 - b**2) / (1 - 2 * b * cos + b**2) ** 1.5


def _multiple(cos: Array, w: Array) -> Array:
    return (1 + 2 * cos) / (1 + 2 * cos * (1 - w) ** 0.5)


hapke = Model(
    name="hapke",
    title="Hapke's particulate surface, smooth",
    cite="hapke1981",
    terms={"scale": particulate},
    violates={"energy": "white particles with a backward lobe or a surge return more than arrives: nothing balances"},
)
