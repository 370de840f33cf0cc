"""Wu's shadowing function and statistical facet term, as far as public abstracts tell (formulas 6.7, reconstructed)."""

from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Dimensionless, Parameter, drawn_by
from gonio.optics.distributions import draw_power, power_normals
from gonio.optics.sampling import COSINE, FacetNormals

# The four empirical constants of the shadowing function, from memory (formulas 6.7).
S_P, S_R, U_P, V_P = 0.0136, 16.4, 9.0, 1.0
MIRROR = 1e-13  # squared distance from the mirror direction, above rounding, below which the in-plane limit is taken

LobeWidth = Annotated[float, Parameter(0.3, 0.01, 10.0, "kr: narrow below 1, broad above")]
FresnelGain = Annotated[float, Parameter(1.0, -20.0, 20.0, "b: gain of the Fresnel-like factor")]
FresnelPower = Annotated[float, Parameter(2.0, 0.1, 10.0, "a: power of the Fresnel-like factor")]


def shadowing(g: Geometry) -> Array:
    r"""Wu's G, symmetric in the two directions and discontinuous at the mirror direction (formulas 6.7).

    .. math::

        \begin{aligned}
        G &= \frac{1 + \omega\,\lvert t_i t_r\rvert/(1 + 16.4\,t_h)}{(1 + \omega t_i^2)(1 + \omega t_r^2)} \\
        \omega &= 0.0136\left(1 + \frac{9\sin\alpha}{\sin\alpha + \cos\alpha}\right) \\
        t_i &= \frac{\tan\theta_i\,(\sin\theta_i + \sin\theta_r\cos\varphi)}{2\sin\alpha\cos\beta} \\
        t_r &= \frac{\tan\theta_r\,(\sin\theta_r + \sin\theta_i\cos\varphi)}{2\sin\alpha\cos\beta} \\
        t_h &= \frac{\lvert\cos\theta_i - \cos\theta_r\rvert}{2\sin\alpha\cos\beta}
        \end{aligned}

    In the mirror direction :math:`t_i = \tan\theta_i`, :math:`t_r = \tan\theta_r` and :math:`t_h = \tan\beta`.
    """
    xp = namespace(g.z_i + g.z_r)
    x, y = g.x_i + g.x_r, g.y_i + g.y_r
    squared = x * x + y * y
    mirror = squared < MIRROR
    length = xp.sqrt(xp.where(mirror, 1.0, squared))  # 2 sin(alpha) cos(beta)
    # tangents of the projections on the plane of the two normals; at the mirror direction they are those of the angles
    tan_i = _tangent(g.x_i, g.y_i, g.cos_i)
    tan_r = _tangent(g.x_r, g.y_r, g.cos_r)
    t_i = xp.where(mirror, tan_i, (g.x_i * x + g.y_i * y) / (g.cos_i * length))
    t_r = xp.where(mirror, tan_r, (g.x_r * x + g.y_r * y) / (g.cos_r * length))
    difference = g.cos_i - g.cos_r
    tan_local = xp.where(mirror, tan_i, xp.abs(difference) / length)
    sin_alpha = xp.where(mirror, 0.0, length / (2 * g.cos_beta))
    w = S_P * (1 + U_P * sin_alpha / (sin_alpha + V_P * g.cos_alpha))
    both = 1 + w * xp.abs(t_i * t_r) / (1 + S_R * tan_local)
    return both / ((1 + w * t_i**2) * (1 + w * t_r**2))


def _tangent(x: Array, y: Array, z: Array) -> Array:
    xp = namespace(z)
    squared = x * x + y * y
    pole = squared < MIRROR
    return xp.where(pole, 0.0, xp.sqrt(xp.where(pole, 1.0, squared))) / z


# the rational distribution kr^2 cos(alpha)/(1 + (kr^2 - 1) cos(alpha)) is cos(alpha)/(1 + B (1 - cos(alpha)))
FACETS = FacetNormals(power_normals, draw_power, of=lambda kr, **_: (1 / kr**2 - 1, 1 + 0 * kr))


@drawn_by(FACETS)
def statistical_facets(g: Geometry, kr: LobeWidth, b: FresnelGain, a: FresnelPower) -> Dimensionless:
    r"""Facets of a rational distribution and an exponential Fresnel factor, over cos theta_r (wu2002).

    .. math::

        f_b = \frac{P}{\cos\theta_r}

    where P is the product of distribution, Fresnel-like factor and shadowing, with the parameters :math:`k_r`,
    :math:`b` and :math:`a` (:func:`.facets_and_shadowing`).
    """
    return facets_and_shadowing(g, kr, b, a) / g.cos_r


def facets_and_shadowing(g: Geometry, kr: Array, b: Array, a: Array) -> Array:
    r"""What both conventions share: distribution, Fresnel-like factor and shadowing.

    .. math::

        P = \frac{k_r^2\cos\alpha}{1 + (k_r^2 - 1)\cos\alpha}\,\exp(b\,(1 - \cos\beta)^a)\,G

    where G is Wu's shadowing (:func:`.shadowing`).
    """
    xp = namespace(g.cos_beta)
    missing = 1 - g.cos_beta
    # a positive floor, because the power's slope is infinite at zero; its value is below 1e-3 of the gain there
    missing = xp.where(missing < 1e-30, 1e-30, missing)
    facets = kr**2 * g.cos_alpha / (1 + (kr**2 - 1) * g.cos_alpha)
    return facets * xp.exp(b * missing**a) * shadowing(g)


@drawn_by(COSINE)
def diffuse_over_cosine(g: Geometry) -> Dimensionless:
    r"""The diffuse part over cos theta_i, as the five-parameter model has it (wu2002).

    .. math::

        f_d = \frac{1}{\cos\theta_i}
    """
    return 1 / (g.cos_i + 0 * g.cos_r)
