"""Greynolds' binomial: the general fit of stray-light programs, a logarithm in powers of two reciprocal variables."""

import math
from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Dimensionless, Model, Parameter
from gonio.optics.kirchhoff import shift_squared
from gonio.optics.phase import guarded_root

# The bounds keep the logarithm within what double precision holds. The defaults look like black paint: level but for a
# weak mirror lobe, and brighter forwards at grazing angles.
B01 = Annotated[float, Parameter(0.0, -5.0, 5.0, "coefficient of D")]
B02 = Annotated[float, Parameter(0.0, -5.0, 5.0, "coefficient of D^2")]
B10 = Annotated[float, Parameter(0.8, -5.0, 5.0, "coefficient of V")]
B11 = Annotated[float, Parameter(0.0, -5.0, 5.0, "coefficient of V D")]
B12 = Annotated[float, Parameter(0.0, -5.0, 5.0, "coefficient of V D^2")]
B20 = Annotated[float, Parameter(0.8, -5.0, 5.0, "coefficient of V^2")]
B21 = Annotated[float, Parameter(0.0, -5.0, 5.0, "coefficient of V^2 D")]
B22 = Annotated[float, Parameter(0.0, -5.0, 5.0, "coefficient of V^2 D^2")]
C0 = Annotated[float, Parameter(-0.2, -4.0, 1.0, "power of the mirror lobe")]
C1 = Annotated[float, Parameter(0.0, -2.0, 2.0, "power of the mirror lobe, times V")]
C2 = Annotated[float, Parameter(0.0, -2.0, 2.0, "power of the mirror lobe, times V^2")]
Lobe = Annotated[float, Parameter(100.0, 1.0, 1e8, "inverse squared half width of the mirror lobe")]


def binomial_power(
    g: Geometry,
    b01: B01,
    b02: B02,
    b10: B10,
    b11: B11,
    b12: B12,
    b20: B20,
    b21: B21,
    b22: B22,
    c0: C0,
    c1: C1,
    c2: C2,
    d: Lobe,
) -> Dimensionless:
    r"""Ten to a polynomial in D and V, the weight being its constant term 10^b00 (greynolds2015).

    D is the distance to the mirror direction in direction cosines, V the product of the scattered and the mirror
    direction projected on the surface.

    .. math::

        \begin{aligned}
        f_b &= 10^{P} \\
        P &= p_0 + V\,(b_{10} + p_1) + V^2\,(b_{20} + p_2) \\
        p_0 &= b_{01} D + b_{02} D^2 + c_0 E \\
        p_1 &= b_{11} D + b_{12} D^2 + c_1 E \\
        p_2 &= b_{21} D + b_{22} D^2 + c_2 E \\
        E &= \frac{\ln(1 + d\,D^2)}{2\ln(10)} \\
        D &= 2\cos\beta\sin\alpha \\
        V &= -\sin\theta_i\sin\theta_r\cos\varphi
        \end{aligned}
    """
    squared = shift_squared(g)
    xp = namespace(squared)
    distance = guarded_root(squared)
    lobe = xp.log(1 + d * squared) / (2 * math.log(10.0))

    def power(linear: Array, quadratic: Array, c: Array) -> Array:
        return linear * distance + quadratic * squared + c * lobe

    v = -(g.x_i * g.x_r + g.y_i * g.y_r)
    exponent = power(b01, b02, c0) + v * (b10 + power(b11, b12, c1) + v * (b20 + power(b21, b22, c2)))
    return xp.exp(math.log(10.0) * exponent)


binomial = Model(
    name="binomial",
    title="Binomial stray-light fit",
    cite="greynolds2015",
    terms={"scale": binomial_power},
    violates={"energy": "the logarithm is fitted freely, and nothing bounds the light"},
    confidence="reconstructed",
)
