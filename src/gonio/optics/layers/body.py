"""A diffuse body below a smooth boundary: what its boundary lets through, and what its pigment scatters.

Saunderson's correction: light crosses the boundary, is scattered evenly by the body, and is in part thrown back by the
boundary from within, again and again, before it leaves.
"""

import math
from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Parameter, PerSteradian, drawn_by
from gonio.optics.fresnel import transmittance
from gonio.optics.sampling import COSINE

Binder = Annotated[
    float, Parameter(1.5, 1.05, 2.2, "refractive index of the coating's binder; fits keep it unless --bound frees it",
                     held=True)
]  # fmt: skip
THIN = 1e-3  # of scattering times thickness below which a layer is computed by its series


def external_reflectance(n: Array) -> Array:
    r"""Fresnel reflectance of a boundary of index n_b for uniform light from outside, in closed form (duntley1942).

    .. math::

        \begin{aligned}
        F_e &= \frac{1}{2} + \frac{(n_b - 1)(3n_b + 1)}{6\,(n_b + 1)^2} \\
        &\quad + \frac{n_b^2\,(n_b^2 - 1)^2}{(n_b^2 + 1)^3}\,\ln\frac{n_b - 1}{n_b + 1} \\
        &\quad - \frac{2n_b^3\,(n_b^2 + 2n_b - 1)}{(n_b^2 + 1)(n_b^4 - 1)} \\
        &\quad + \frac{8n_b^4\,(n_b^4 + 1)}{(n_b^2 + 1)(n_b^4 - 1)^2}\,\ln n_b
        \end{aligned}

    """
    xp = namespace(n)
    square, fourth = n**2, n**4
    crossed = square * (square - 1) ** 2 / (square + 1) ** 3 * xp.log((n - 1) / (n + 1))
    sides = 0.5 + (n - 1) * (3 * n + 1) / (6 * (n + 1) ** 2) + crossed
    last = 8 * fourth * (fourth + 1) / ((square + 1) * (fourth - 1) ** 2) * xp.log(n)
    return sides - 2 * n**3 * (square + 2 * n - 1) / ((square + 1) * (fourth - 1)) + last


def internal_reflectance(n: Array) -> Array:
    r"""Fresnel reflectance of the same boundary for uniform light from within, total reflection included.

    .. math::

        F_i = 1 - \frac{1 - F_e}{n_b^2}

    """
    return 1 - (1 - external_reflectance(n)) / n**2


@drawn_by(COSINE)
def coated_body(g: Geometry, n_b: Binder) -> PerSteradian:
    r"""Diffuse body below a smooth boundary, which light crosses twice (saunderson1942).

    A weight of 1 is a body that absorbs nothing: all that crosses the boundary comes out again, so that
    1 - F(theta_i) of the light is reflected. Less weight is a body of reflectance rho (`body_reflectance`).

    .. math::

        f_b = \frac{T(\theta_i)\,T(\theta_r)}{\pi\,(1 - F_e)}

    where T is what the boundary of index :math:`n_b` lets through (:func:`.transmittance`), and :math:`F_e` what it
    reflects of uniform light (:func:`.external_reflectance`).
    """
    through = transmittance(g.cos_i, n_b) * transmittance(g.cos_r, n_b)
    return through / (math.pi * (1 - external_reflectance(n_b)))


def body_reflectance(weight: Array, n: Array) -> Array:
    """Reflectance rho of the body itself, as light within the coating meets it, from the weight of `coated_body`.

    weight = rho (1 - F_i)/(1 - rho F_i), F_i = `internal_reflectance`. Where it stands before T(theta_i) T(theta_r)/pi,
    this is the factor rho/(n^2 (1 - rho F_i)) of Saunderson's form.

    Parameters
    ----------
    weight : array
        0 to 1; beyond 1 the body would give more light than it gets.
    n : array
        Index of the binder, more than 1.

    Returns
    -------
    array
        rho, 0 to 1.

    """
    inner = internal_reflectance(n)
    return weight / (1 - inner + weight * inner)


def body_weight(rho: Array, n: Array) -> Array:
    """The weight of `coated_body` for a body of reflectance rho, as light within the coating of index n meets it."""
    inner = internal_reflectance(n)
    return rho * (1 - inner) / (1 - rho * inner)


def kubelka_munk(absorption: Array, scattering: Array, thickness: Array, backing: Array = 0.0) -> tuple[Array, Array]:
    """Reflectance over a backing, and transmittance, of a layer that absorbs and scatters diffuse light (kubelka1948).

    The reflectance is the rho of a coated body: the boundary is not in it.

    Parameters
    ----------
    absorption, scattering : array
        K >= 0 and S > 0, per unit of thickness.
    thickness : array
        X >= 0, in the unit that K and S are per.
    backing : array
        Reflectance of what lies below, 0 to 1.

    Returns
    -------
    tuple of array
        Reflectance over the backing, and transmittance of the layer alone, 0 to 1 each.

    """
    optical = scattering * thickness
    xp = namespace(optical)
    a = 1 + absorption / scattering
    b = xp.sqrt(xp.where(a > 1, a**2 - 1, 0.0))
    # sinh(bx)/b and cosh(bx), over exp(bx): neither overflows, and the limit of no absorption is x
    decay = xp.exp(-2 * b * optical)
    small = b * optical < THIN
    sinh = xp.where(small, optical * (1 + (b * optical) ** 2 / 6) * xp.exp(-b * optical),
                    (1 - decay) / xp.where(small, 1.0, 2 * b))  # fmt: skip
    cosh = (1 + decay) / 2
    below = (a - backing) * sinh + cosh
    return (sinh * (1 - a * backing) + backing * cosh) / below, xp.exp(-b * optical) / (a * sinh + cosh)


def infinite_reflectance(absorption_over_scattering: Array) -> Array:
    """Reflectance of a layer so thick that nothing passes, from K/S (kubelka1948): a - sqrt(a^2 - 1), a = 1 + K/S."""
    ratio = absorption_over_scattering
    return 1 / (1 + ratio + namespace(ratio).sqrt(ratio * (ratio + 2)))


def absorption_over_scattering(rho: Array) -> Array:
    """K/S of a layer so thick that nothing passes, from its reflectance: (1 - rho)^2/(2 rho)."""
    return (1 - rho) ** 2 / (2 * rho)
