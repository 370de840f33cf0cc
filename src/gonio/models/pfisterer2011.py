"""The ABg model of stray-light analysis."""

import math
from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Dimensionless, Model, Parameter, drawn_by
from gonio.optics.kirchhoff import shift_squared
from gonio.optics.sampling import ShiftedPower

RollOff = Annotated[float, Parameter(0.001, 1e-8, 10.0, "level at which the lobe turns flat")]
Exponent = Annotated[float, Parameter(2.0, 0.0, 6.0, "exponent of the wing; 0 is ideal diffuse reflection")]


ROUNDING = 1e-32  # of a squared distance of unit vectors
SHARPEST = 1e12  # a shoulder of a millionth in direction cosines, within which no exponent puts much of the light
LEAST = 0.05  # an exponent below is a level within the shoulder that it would have


def _shoulder_and_wing(B: Array, g: Array) -> tuple[Array, Array]:
    """The power law (1 + B' distance^2)^-C of the same shoulder, where distance^g is B, and of the same wing.

    It is the term within a factor of 4: 2^(g/2 - 1) at the shoulder, 1 far from it.
    """
    xp = namespace(g)
    logarithm = -2 * xp.log(B) / xp.where(g < LEAST, LEAST, g)
    return xp.exp(xp.where(logarithm > math.log(SHARPEST), math.log(SHARPEST), logarithm)), g / 2


@drawn_by(ShiftedPower(of=_shoulder_and_wing))
def inverse_power(geometry: Geometry, B: RollOff, g: Exponent) -> Dimensionless:
    r"""A power of the distance to the mirror direction, flattened by B (pfisterer2011; formulas 7.9).

    .. math::

        \begin{aligned}
        f_a &= \frac{1}{B + \Delta^g} \\
        \Delta &= 2\cos\beta\sin\alpha
        \end{aligned}

    where :math:`\Delta` is the distance to the mirror direction in direction cosines.
    """
    # the mirror direction itself has no logarithm, and a power below 1 no slope there
    return 1 / (B + (shift_squared(geometry) + ROUNDING) ** (g / 2))


abg = Model(
    name="abg",
    title="ABg scatter of stray-light analysis",
    cite="pfisterer2011",
    terms={"A": inverse_power},
    violates={"energy": "the weight is the level of the wing, and nothing bounds the light below the lobe"},
)
