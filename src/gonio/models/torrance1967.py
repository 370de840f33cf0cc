"""Specular facets over an ideal diffuse floor."""

from gonio.model import Model
from gonio.optics.diffuse import uniform
from gonio.optics.facets import gaussian_facets

torrance_sparrow = Model(
    name="torrance-sparrow",
    title="Torrance-Sparrow as guo2023 fits it (Gaussian slopes, F in ks)",
    cite="torrance1967",
    terms={"ks": gaussian_facets, "kd": uniform},
)
