"""Diffuse terms that models share."""

import math

from gonio.arrays import Array
from gonio.geometry import Geometry
from gonio.model import Dimensionless, PerSteradian, drawn_by
from gonio.optics.sampling import COSINE


def _ones(g: Geometry) -> Array:
    """One for every pair of directions, and NaN where a direction is."""
    return 0 * (g.z_i + g.z_r) + 1


@drawn_by(COSINE)
def uniform(g: Geometry) -> Dimensionless:
    """Ideal diffuse reflection as guo2023 writes it: f_id = 1, not 1/pi (eq 8).

    .. math::

        f_{id} = 1
    """
    return _ones(g)


@drawn_by(COSINE)
def lambertian(g: Geometry) -> PerSteradian:
    r"""Ideal diffuse reflection of unit reflectance (lambert1760).

    .. math::

        f_d = \frac{1}{\pi}
    """
    return _ones(g) / math.pi
