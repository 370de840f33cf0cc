"""Three components for metals: a Gaussian directional-diffuse lobe about the normal."""

import math
from typing import Annotated

from gonio.arrays import namespace
from gonio.geometry import Geometry
from gonio.model import Model, Parameter, PerDegree, drawn_by
from gonio.optics.diffuse import uniform
from gonio.optics.distributions import draw_gaussian_angle, gaussian_angle
from gonio.optics.facets import gaussian_facets
from gonio.optics.sampling import PolarLobe
from gonio.units import to_radians

LobeWidth = Annotated[float, Parameter(32.0, 1.0, 720.0, "standard deviation of the directional-diffuse lobe", "deg")]


@drawn_by(PolarLobe(draw_gaussian_angle, gaussian_angle, of=lambda sigma_m, **_: (to_radians(sigma_m),)))
def gaussian_lobe(g: Geometry, sigma_m: LobeWidth) -> PerDegree:
    r"""Multiple reflections: a Gaussian of theta_r in degrees (guo2023, eq 5).

    .. math::

        f_{dd} = \frac{1}{\sqrt{2\pi}\,\sigma_m}\exp\left(-\frac{\theta_r^2}{2\sigma_m^2}\right)

    where all angles are in degrees.
    """
    squared = g.theta_r_squared
    return namespace(squared).exp(-squared / (2 * sigma_m**2)) / (math.sqrt(2 * math.pi) * sigma_m)


wang_2016 = Model(
    name="wang-2016",
    title="Three components, Gaussian lobe",
    cite="wang2016",
    terms={"ks": gaussian_facets, "kdd": gaussian_lobe, "kid": uniform},
    violates={
        "reciprocity": "the directional-diffuse lobe depends on theta_r alone",
        "energy": "the lobe is not normalised, so no weight is a reflectance and nothing bounds their sum",
    },
)
