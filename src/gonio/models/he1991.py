"""He, Torrance, Sillion and Greenberg's wave-optical reflection, without polarisation."""

import math
from typing import Annotated

from gonio.arrays import Array, namespace, special
from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerSteradian, drawn_by
from gonio.optics.diffuse import lambertian
from gonio.optics.fresnel import Extinction, Index, unpolarised
from gonio.optics.kirchhoff import DIFFRACTED, Wavelength, diffracted, kirchhoff_obliquity

RmsHeight = Annotated[float, Parameter(0.1, 0.001, 10.0, "rms height of the surface", "um")]
Length = Annotated[float, Parameter(1.5, 0.1, 100.0, "1/e length of the height autocorrelation", "um")]

_NEWTON_STEPS = 8  # 7 reach double precision at every height and angle


@drawn_by(DIFFRACTED)
def directional_diffuse(
    g: Geometry, sigma: RmsHeight, length: Length, index: Index, extinction: Extinction, wavelength: Wavelength
) -> PerSteradian:
    r"""Diffracted light of the heights that both directions see, shadowed (he1991, eq 76; formulas 7.6).

    The specular term is a delta in the mirror direction and no part of this; the paper's vector factor is
    (2 cos beta/cos alpha)^2.

    .. math::

        \begin{aligned}
        f_s &= F(\beta)\,S(\theta_i)\,S(\theta_r)\,O\,K \\
        K &= \frac{\pi\ell^2}{\lambda^2}\,\mathrm{e}^{-g}\sum_{m=1}^{\infty} \frac{g^m}{m!\,m}
        \exp\left(-\frac{\pi^2\ell^2\Delta^2}{m\lambda^2}\right) \\
        g &= \left(\frac{2\pi\sigma_a}{\lambda}(\cos\theta_i + \cos\theta_r)\right)^2 \\
        \Delta &= 2\cos\beta\sin\alpha
        \end{aligned}

    where F is Fresnel's reflectance (:func:`.unpolarised`) and O the obliquity (:func:`.kirchhoff_obliquity`). Smith's
    shadowing S and the apparent height :math:`\sigma_a` are

    .. math::

        \begin{aligned}
        S(\theta) &= \frac{1 - \operatorname{erfc}(x)/2}{1 + E} \\
        E &= \frac{1}{2}\left(\frac{\exp(-x^2)}{x\sqrt{\pi}} - \operatorname{erfc}(x)\right) \\
        x &= \frac{\ell\cot\theta}{2\sigma} \\
        \sigma_a &= \frac{\sigma}{\sqrt{1 + z^2}} \\
        z &= \sqrt{W(t^2)} \\
        t &= \frac{T(\theta_i) + T(\theta_r)}{\sqrt{8\pi}} \\
        T(\theta) &= \tan\theta\,\operatorname{erfc}(x)
        \end{aligned}

    where W is Lambert's function: z solves :math:`z\exp(z^2/2) = t`.
    """
    apparent = _apparent_height(g, sigma, length)
    shadowing = _visible(g.cos_i, sigma, length) * _visible(g.cos_r, sigma, length)
    return (
        unpolarised(g.cos_beta, index, extinction)
        * shadowing
        * kirchhoff_obliquity(g)
        * diffracted(g, apparent, length, wavelength)
    )


def _cotangent(cos: Array) -> Array:
    squared = 1 - cos**2
    xp = namespace(cos)
    return cos / xp.sqrt(xp.where(squared < 1e-12, 1e-12, squared))


def _visible(cos: Array, sigma: Array, length: Array) -> Array:
    """Smith's shadowing of Gaussian heights in his form of 1967; its exponential is missing in the paper's print."""
    x = length * _cotangent(cos) / (2 * sigma)
    erfc = special("erfc", x)
    hidden = (namespace(cos).exp(-(x**2)) / (math.sqrt(math.pi) * x) - erfc) / 2
    return (1 - erfc / 2) / (1 + hidden)


def _apparent_height(g: Geometry, sigma: Array, length: Array) -> Array:
    """Rms height of the parts that are seen: sigma/sqrt(1 + z^2), z exp(z^2/2) = (K_i + K_r)/sqrt(8 pi)."""
    xp = namespace(g.cos_i)
    cot_i, cot_r = _cotangent(g.cos_i), _cotangent(g.cos_r)
    seen = [special("erfc", length * cot / (2 * sigma)) / cot for cot in (cot_i, cot_r)]
    target = (seen[0] + seen[1]) / math.sqrt(8 * math.pi)
    large = target > 1.5
    z = xp.where(large, xp.sqrt(2 * xp.log(xp.where(large, target, 1.5))), target)
    for _ in range(_NEWTON_STEPS):
        z = z - (z - target * xp.exp(-z * z / 2)) / (1 + z * z)
    return sigma / xp.sqrt(1 + z * z)


he_torrance = Model(
    name="he-torrance",
    title="He-Torrance, diffuse terms",
    cite="he1991",
    terms={"scale": directional_diffuse, "a": lambertian},
)
