"""Bagher, Soler and Holzschuch's shifted gamma distribution of facets."""

import math
from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerSteradian
from gonio.optics.diffuse import lambertian
from gonio.units import to_radians

Width = Annotated[float, Parameter(0.1, 0.001, 2.0, "width of the distribution, as a squared slope")]
Power = Annotated[float, Parameter(0.6, 0.0, 2.0, "exponent of the distribution")]
Normal = Annotated[float, Parameter(0.9, 0.0, 1.0, "reflectance at normal incidence (F0)")]
Correction = Annotated[float, Parameter(0.01, -1.0, 1.0, "correction to Schlick's reflectance (F1)")]
Depth = Annotated[float, Parameter(0.1, 0.0, 10.0, "depth of the shadowing (lambda)")]
Rate = Annotated[float, Parameter(1.0, 0.0, 10.0, "rate of the shadowing (c)")]
Exponent = Annotated[float, Parameter(1.0, 0.1, 10.0, "exponent of the shadowing (k)")]
Start = Annotated[float, Parameter(17.0, -90.0, 90.0, "polar angle where shadowing starts", "deg")]


def shifted_gamma_facets(
    g: Geometry,
    alpha: Width,
    p: Power,
    f0: Normal,
    f1: Correction,
    depth: Depth,
    c: Rate,
    k: Exponent,
    theta_0: Start,
) -> PerSteradian:
    r"""Facets of shifted gamma slopes, shadowing fitted freely (bagher2012; formulas 7.17).

    The weight stands for the product of the paper's specular weight and its normaliser, which cannot be told apart.

    .. math::

        \begin{aligned}
        f_s &= \frac{F\,D\,S(\theta_i)\,S(\theta_r)}{\pi\cos\theta_i\cos\theta_r} \\
        F &= \max(0, F_0 - F_1\cos\beta + E) \\
        E &= (1 - F_0)(1 - \cos\beta)^5 \\
        D &= \frac{\exp(-x)}{\pi x^p\cos^4\alpha} \\
        x &= a + \frac{\tan^2\alpha}{a} \\
        S(\theta) &= \max(0, 1 + d\,(1 - \exp(c\,u^k))) \\
        u &= \max\left(0, \theta - \frac{\pi\theta_0}{180}\right)
        \end{aligned}

    where a is the width alpha, d the depth of the shadowing, :math:`\theta_0` in degrees and the other angles in rad.
    """
    tan2 = g.tan_alpha_squared
    xp = namespace(tan2)
    x = alpha + tan2 / alpha
    normals = xp.exp(-x) * (1 + tan2) ** 2 / (math.pi * x**p)
    grazing = f0 - f1 * g.cos_beta + (1 - f0) * (1 - g.cos_beta) ** 5
    fresnel = xp.where(grazing < 0.0, 0.0, grazing)
    shadowing = _visible(g.theta_i_deg, depth, c, k, theta_0) * _visible(g.theta_r_deg, depth, c, k, theta_0)
    return fresnel * normals * shadowing / (math.pi * g.cos_i * g.cos_r)


def _visible(theta: Array, depth: Array, c: Array, k: Array, theta_0: Array) -> Array:
    """1 + lambda (1 - exp(c max(0, theta - theta_0)^k)), kept within 0 and 1; the power takes radians."""
    beyond = to_radians(theta - theta_0)
    xp = namespace(beyond)
    lit = beyond <= 0
    exponent = c * xp.where(lit, 1.0, beyond) ** k
    # beyond e^60 nothing is visible, and single precision ends at e^88
    seen = 1 + depth * (1 - xp.exp(xp.where(exponent > 60.0, 60.0, exponent)))
    return xp.where(lit, 1.0, xp.where(seen < 0.0, 0.0, seen))


sgd = Model(
    name="sgd",
    title="Shifted gamma distribution of facets",
    cite="bagher2012",
    terms={"rho_s": shifted_gamma_facets, "rho_d": lambertian},
    violates={"energy": "masking is fitted apart from the distribution, and the lobe may reflect more than arrives"},
)
