"""Harvey and Shack's empirical lobe, invariant to shifts in direction cosines."""

from typing import Annotated

from gonio.geometry import Geometry
from gonio.model import Dimensionless, Model, Parameter, drawn_by
from gonio.optics.kirchhoff import shift_squared
from gonio.optics.sampling import ShiftedPower

Shoulder = Annotated[float, Parameter(0.05, 1e-4, 1.0, "shoulder of the lobe, in direction cosines")]
Slope = Annotated[float, Parameter(-1.5, -6.0, 0.0, "slope of the wing on logarithmic axes")]


@drawn_by(ShiftedPower(of=lambda L, S, **_: (1 / L**2, -S / 2)))
def shoulder_and_wing(g: Geometry, L: Shoulder, S: Slope) -> Dimensionless:
    r"""Flat within the shoulder, a power beyond it; the weight is the peak (harvey1976; formulas 7.9).

    .. math::

        \begin{aligned}
        f_b &= \left(1 + \frac{\Delta^2}{L^2}\right)^{S/2} \\
        \Delta &= 2\cos\beta\sin\alpha
        \end{aligned}

    where :math:`\Delta` is the distance to the mirror direction in direction cosines.
    """
    return (1 + shift_squared(g) / L**2) ** (S / 2)


harvey_shack = Model(
    name="harvey-shack",
    title="Harvey and Shack's empirical scatter lobe",
    cite="harvey1976",
    terms={"b0": shoulder_and_wing},
    violates={"energy": "the weight is the peak of the lobe, and nothing bounds the light below it"},
)
