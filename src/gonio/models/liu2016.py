"""Three components for coatings: a power of the cosine as directional-diffuse lobe."""

from typing import Annotated

from gonio.geometry import Geometry
from gonio.model import Dimensionless, Model, Parameter, drawn_by
from gonio.optics.diffuse import uniform
from gonio.optics.facets import gaussian_facets
from gonio.optics.sampling import CosineLobe

Exponent = Annotated[float, Parameter(2.0, 0.0, 1000.0, "exponent of the directional-diffuse lobe")]


@drawn_by(CosineLobe(of=lambda n, **_: (n + 1, 0.0)))
def cosine_power(g: Geometry, n: Exponent) -> Dimensionless:
    r"""Multiple reflections: the n-th power of cos theta_r (guo2023, eq 6).

    .. math::

        f_{dd} = \cos^n\theta_r
    """
    return g.cos_r**n


liu_2016 = Model(
    name="liu-2016",
    title="Three components, cosine-power lobe",
    cite="liu2016",
    terms={"ks": gaussian_facets, "kdd": cosine_power, "kid": uniform},
    violates={
        "reciprocity": "the directional-diffuse lobe depends on theta_r alone",
        "energy": "the lobe is not normalised, so no weight is a reflectance and nothing bounds their sum",
    },
)
