"""Surfaces with a grain, such as brushed metal: facets whose slopes differ along two axes, turned to an azimuth.

The axes are at right angles, the first at the azimuth psi from the surface's own x axis, from which phi_i counts. The
grain, the direction of the lines, is the axis of the lesser width. An ellipse is the same at psi + 180 deg, and at
psi + 90 deg with its widths exchanged, so psi runs over 90 deg, from -35 to 55: each surface has one set of values, and
a grain that stands at 0, 15, 30, 45, 60, 75 or 90 deg on its stage is not at an end.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated

from gonio.arrays import Array, namespace
from gonio.geometry import Geometry
from gonio.model import Parameter, Sampler
from gonio.optics.sampling import Directed
from gonio.units import to_radians

LEAST, MOST = -35.0, 55.0  # deg

Azimuth = Annotated[
    float, Parameter(0.0, LEAST, MOST, "azimuth of the axis of the first width; the grain is the narrow axis", "deg")
]
WidthX = Annotated[float, Parameter(0.1, 0.01, 1.0, "width of the distribution of slopes along the axis at psi")]
WidthY = Annotated[float, Parameter(0.3, 0.01, 1.0, "width of the distribution of slopes at right angles to it")]
SlopeX = Annotated[float, Parameter(0.1, 0.01, 1.4, "sqrt(2) times the rms slope along the axis at psi")]
SlopeY = Annotated[float, Parameter(0.3, 0.01, 1.4, "sqrt(2) times the rms slope at right angles to it")]


def along_axes(g: Geometry, psi: Array) -> Geometry:
    r"""The same pairs of directions, seen from axes that stand at the azimuth psi [deg].

    .. math::

        \begin{aligned}
        t_x &= s_x\cos\chi + s_y\sin\chi \\
        t_y &= s_y\cos\chi - s_x\sin\chi \\
        u_i &= x_i\cos\chi + y_i\sin\chi \\
        v_i &= y_i\cos\chi - x_i\sin\chi \\
        u_r &= x_r\cos\chi + y_r\sin\chi \\
        v_r &= y_r\cos\chi - x_r\sin\chi \\
        \chi &= \frac{\pi}{180}\,\psi
        \end{aligned}

    where t is the slope of the facet along both axes, u and v are components of the two directions, and :math:`\psi` is
    in degrees.
    """
    cos, sin = _cos_sin(psi)
    return Geometry(*_turned(g.x_i, g.y_i, cos, -sin), g.z_i, *_turned(g.x_r, g.y_r, cos, -sin), g.z_r)


@dataclass(frozen=True)
class AlongAxes:
    """What `sampler` draws about the x and y axes, about axes that stand at the azimuth psi [deg]."""

    sampler: Sampler

    def draw(self, x_i: Array, y_i: Array, z_i: Array, u: Array, v: Array, /, **shape: Array) -> Directed:
        cos, sin = _cos_sin(shape["psi"])
        x, y, z = self.sampler.draw(*_turned(x_i, y_i, cos, -sin), z_i, u, v, **shape)
        return (*_turned(x, y, cos, sin), z)

    def density(self, g: Geometry, /, **shape: Array) -> Array:
        return self.sampler.density(along_axes(g, shape["psi"]), **shape)


def grain_azimuth(x: str, y: str) -> Callable[..., float]:
    """The azimuth of the grain [deg], -90 to 90, from values by name; `x` and `y` name the widths."""

    def azimuth(values: Mapping[str, float]) -> float:
        turn = values["psi"] if values[x] <= values[y] else values["psi"] + 90.0
        return float((turn + 90.0) % 180.0 - 90.0)

    return azimuth


def _cos_sin(psi: Array) -> tuple[Array, Array]:
    angle = to_radians(psi)
    xp = namespace(angle)
    return xp.cos(angle), xp.sin(angle)


def _turned(x: Array, y: Array, cos: Array, sin: Array) -> tuple[Array, Array]:
    return cos * x - sin * y, sin * x + cos * y
