"""Reflection towards the source, by the back vector: the half vector of the detector and the mirrored source.

belcour2014 mirrors the incident direction about the surface normal before the half vector is taken. A lobe about the
mirror direction becomes one about the source, and stays reciprocal. An isotropic lobe reflects as much as before.
"""

from dataclasses import dataclass
from typing import Annotated

from gonio.arrays import Array
from gonio.geometry import Geometry
from gonio.model import Parameter, PerSteradian, Sampler, drawn_by
from gonio.optics.distributions import draw_gtr
from gonio.optics.facets import gtr_normals
from gonio.optics.sampling import Directed, FacetNormals

BackWidth = Annotated[float, Parameter(0.05, 0.002, 1.0, "width of the lobe about the back direction, as a slope")]
BackTail = Annotated[float, Parameter(1.5, 1.0, 4.0, "exponent of its tail: 1 is Cauchy-Lorentz, 2 is GGX")]


def backward(g: Geometry) -> Geometry:
    """The same pairs with the incident direction mirrored about the normal: their half vector is the back vector."""
    return Geometry(-g.x_i, -g.y_i, g.z_i, g.x_r, g.y_r, g.z_r)


@dataclass(frozen=True)
class Backward:
    """What `sampler` draws about the mirror direction, about the back direction instead."""

    sampler: Sampler

    def draw(self, x_i: Array, y_i: Array, z_i: Array, u: Array, v: Array, /, **shape: Array) -> Directed:
        return self.sampler.draw(-x_i, -y_i, z_i, u, v, **shape)

    def density(self, g: Geometry, /, **shape: Array) -> Array:
        return self.sampler.density(backward(g), **shape)


@drawn_by(Backward(FacetNormals(gtr_normals, draw_gtr, of=lambda w_b, c_b, **_: (w_b, c_b))))
def back_lobe(g: Geometry, w_b: BackWidth, c_b: BackTail) -> PerSteradian:
    r"""Light that returns to its source, in a lobe with a tail (burley2012) about the back vector (belcour2014).

    .. math::

        \begin{aligned}
        f_r &= \frac{K}{2\,(\cos\theta_i + \cos\theta_r)\,Q^{c_b}} \\
        Q &= w_b^2\mu^2 + 1 - \mu^2 \\
        K &= \frac{(c_b - 1)(1 - w_b^2)}{\pi\,(w_b^{2 - 2c_b} - 1)} \\
        \mu &= \frac{\cos\theta_i + \cos\theta_r}{\sqrt{B}} \\
        B &= (x_r - x_i)^2 + (y_r - y_i)^2 \\
        &\quad + (\cos\theta_i + \cos\theta_r)^2
        \end{aligned}

    where :math:`\mu` is the cosine of the tilt of the back vector, and :math:`K = (w_b^2 - 1)/(\pi\ln w_b^2)` at
    :math:`c_b = 1`. The divisor is that of Smith's masking by GGX slopes of width 1, as in `gonio-best`.
    """
    return gtr_normals(backward(g), w_b, c_b) / (2 * (g.cos_i + g.cos_r))
