"""Rayleigh and Rice's first-order vector theory of smooth surfaces, with an ABC (K-correlation) height spectrum."""

import math
from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerSteradian, drawn_by
from gonio.optics.fresnel import Extinction, Index
from gonio.optics.kirchhoff import Wavelength, shift_squared
from gonio.optics.sampling import ShiftedPower

Corner = Annotated[float, Parameter(2.0, 0.1, 1000.0, "length at which the height spectrum turns over (B)", "um")]
Fall = Annotated[float, Parameter(2.5, 0.5, 6.0, "exponent of the two-dimensional height spectrum (C)")]


@drawn_by(ShiftedPower(of=lambda B, C, wavelength, **_: ((B / wavelength) ** 2, C / 2)))
def first_order_scatter(
    g: Geometry, B: Corner, C: Fall, index: Index, extinction: Extinction, wavelength: Wavelength
) -> PerSteradian:
    r"""Scatter per A = PSD(0)/wavelength^4, valid for heights well below the wavelength (church1989; formulas 7.8).

    The weight is dimensionless so that the model is linear in it. Light in the mirror direction is no part of it.

    .. math::

        \begin{aligned}
        f_a &= 16\pi^2\cos\theta_i\cos\theta_r\,\frac{Q}{(1 + B^2\Delta^2/\lambda^2)^{C/2}} \\
        Q &= \frac{\lvert q_{ss}\rvert^2 + \lvert q_{sp}\rvert^2 + \lvert q_{ps}\rvert^2 + \lvert q_{pp}\rvert^2}{2} \\
        \Delta &= 2\cos\beta\sin\alpha
        \end{aligned}

    with the amplitudes

    .. math::

        \begin{aligned}
        q_{ss} &= \frac{(e - 1)\cos\psi}{(\cos\theta_i + \kappa_i)(\cos\theta_r + \kappa_r)} \\
        q_{sp} &= \frac{-(e - 1)\,\kappa_r\sin\psi}{(\cos\theta_i + \kappa_i)(e\cos\theta_r + \kappa_r)} \\
        q_{ps} &= \frac{-(e - 1)\,\kappa_i\sin\psi}{(e\cos\theta_i + \kappa_i)(\cos\theta_r + \kappa_r)} \\
        q_{pp} &= \frac{(e - 1)(e\sin\theta_i\sin\theta_r - \kappa_i\kappa_r\cos\psi)}
        {(e\cos\theta_i + \kappa_i)(e\cos\theta_r + \kappa_r)} \\
        \kappa_i &= \sqrt{e - \sin^2\theta_i} \\
        \kappa_r &= \sqrt{e - \sin^2\theta_r} \\
        e &= (n + \mathrm{i}k)^2 \\
        \psi &= \varphi - \pi
        \end{aligned}

    where n is the index, k the extinction and :math:`\lambda` the wavelength. The two-dimensional height spectrum is
    :math:`A\lambda^4/(1 + B^2 f^2)^{C/2}` at the spatial frequency :math:`f = \Delta/\lambda`.
    """
    spectrum = (1 + (B / wavelength) ** 2 * shift_squared(g)) ** (-C / 2)
    return 16 * math.pi**2 * g.cos_i * g.cos_r * _polarisation(g, index, extinction) * spectrum


def _polarisation(g: Geometry, n: Array, k: Array) -> Array:
    """Sum of the four squared amplitudes over 2, in real arithmetic and without the azimuth.

    Its sine and cosine have no limit at normal incidence. They are eliminated by U - V = sin^2(theta) W of either
    direction, where U and V stand for |1/(c + q)|^2 and |q/(e c + q)|^2, e = (n + i k)^2 and q^2 = e - sin^2(theta).
    """
    real, imaginary = n**2 - k**2, 2 * n * k
    (u_i, v_i, w_i, p_i, a_i, b_i), (u_r, v_r, w_r, p_r, a_r, b_r) = (_one_side(c, n, k) for c in (g.cos_i, g.cos_r))
    azimuth = g.x_i * g.x_r + g.y_i * g.y_r
    product = real * (a_i * a_r - b_i * b_r) + imaginary * (a_i * b_r + b_i * a_r)
    sines = (1 - g.cos_i**2) * (1 - g.cos_r**2)
    parallel = p_i * p_r * ((real**2 + imaginary**2) * sines + 2 * azimuth * product)
    contrast = (real - 1) ** 2 + imaginary**2
    return contrast / 2 * (v_i * u_r + u_i * v_r + azimuth**2 * w_i * w_r + parallel)


def _one_side(cos: Array, n: Array, k: Array) -> tuple[Array, ...]:
    """U, V, W, 1/|e c + q|^2 and both parts of q for the direction of this cosine."""
    xp = namespace(cos)
    sin2 = 1 - cos**2
    real, imaginary = n**2 - k**2, 2 * n * k
    t = real - sin2
    size = xp.sqrt(t**2 + imaginary**2)
    # the larger part of q by a root, the other by division: a root of nothing has no slope
    larger2 = (size + xp.abs(t)) / 2
    larger = xp.sqrt(xp.where(larger2 < 1e-12, 1e-12, larger2))
    a = xp.where(t < 0, imaginary / 2 / larger, larger)
    b = xp.where(t < 0, larger, imaginary / 2 / larger)
    u = 1 / ((cos + a) ** 2 + b**2)
    p = 1 / ((real * cos + a) ** 2 + (imaginary * cos + b) ** 2)
    w = (size - size**2 + cos**2 * (2 * t + sin2) + 2 * cos * a) * u * p
    return u, size * p, w, p, a, b


rayleigh_rice = Model(
    name="rayleigh-rice",
    title="Rayleigh-Rice scatter, ABC height spectrum",
    cite="church1989",
    terms={"A": first_order_scatter},
    violates={"energy": "first order in the height spectrum: nothing takes the scatter from the mirror direction"},
)
