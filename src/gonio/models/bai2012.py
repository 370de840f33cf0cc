"""The seven-parameter statistical model: five parameters and a retro-reflection lobe; the added term is ours."""

from typing import Annotated

from gonio.arrays import namespace
from gonio.geometry import Geometry
from gonio.model import Dimensionless, Model, Parameter, drawn_by
from gonio.optics.sampling import RetroLobe
from gonio.optics.wu import diffuse_over_cosine, statistical_facets

Sharpness = Annotated[float, Parameter(20.0, 0.0, 1e4, "c: sharpness of the retro-reflection lobe")]


@drawn_by(RetroLobe(of=lambda c, **_: (c,)))
def retro_lobe(g: Geometry, c: Sharpness) -> Dimensionless:
    r"""A lobe about the incident beam, exp(-c (1 - cos 2 beta)) (formulas 6.8, ours: the printed form is not public).

    .. math::

        f_t = \exp(-c\,(1 - \cos 2\beta))
    """
    return namespace(g.cos_beta).exp(-2 * c * (1 - g.cos_beta**2))


bai_seven = Model(
    name="bai-seven",
    title="Seven-parameter statistical",
    cite="bai2012",
    terms={"kb": statistical_facets, "kd": diffuse_over_cosine, "kt": retro_lobe},
    violates={
        "reciprocity": "two terms are divided by one of the two cosines",
        "energy": "no term is normalised",
    },
    confidence="reconstructed",
)
