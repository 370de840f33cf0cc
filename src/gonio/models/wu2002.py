"""The five-parameter statistical model, reconstructed; and its reciprocal variant."""

from gonio.geometry import Geometry
from gonio.model import Dimensionless, Model, drawn_by
from gonio.optics.diffuse import uniform
from gonio.optics.wu import (
    FACETS,
    FresnelGain,
    FresnelPower,
    LobeWidth,
    diffuse_over_cosine,
    facets_and_shadowing,
    statistical_facets,
)


@drawn_by(FACETS)
def reciprocal_facets(g: Geometry, kr: LobeWidth, b: FresnelGain, a: FresnelPower) -> Dimensionless:
    r"""The same facets over both cosines (formulas 6.7, convention "reciprocal").

    .. math::

        f_b = \frac{P}{\cos\theta_i\cos\theta_r}

    where P is the product of distribution, Fresnel-like factor and shadowing, with the parameters :math:`k_r`,
    :math:`b` and :math:`a` (:func:`.facets_and_shadowing`).
    """
    return facets_and_shadowing(g, kr, b, a) / (g.cos_i * g.cos_r)


wu_five = Model(
    name="wu-five",
    title="Five-parameter statistical",
    cite="wu2002",
    terms={"kb": statistical_facets, "kd": diffuse_over_cosine},
    violates={
        "reciprocity": "each term is divided by one of the two cosines",
        "energy": "neither term is normalised",
    },
    confidence="reconstructed",
)

wu_five_reciprocal = Model(
    name="wu-five-reciprocal",
    title="Five-parameter, reciprocal",
    cite="wu2002",
    terms={"kb": reciprocal_facets, "kd": uniform},
    violates={"energy": "neither term is normalised"},
    confidence="reconstructed",
)
