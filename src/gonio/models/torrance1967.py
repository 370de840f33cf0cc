"""Specular facets over an ideal diffuse floor."""

from gonio.model import Model
from gonio.optics.diffuse import uniform
from gonio.optics.facets import gaussian_facets

torrance_sparrow = Model(
    name="torrance-sparrow",
    title="Gaussian facets over an ideal diffuse floor",
    cite="torrance1967",
    terms={"ks": gaussian_facets, "kd": uniform},
)
