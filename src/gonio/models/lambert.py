"""Ideal diffuse reflection."""

from gonio.model import Model
from gonio.optics.diffuse import lambertian

lambert = Model(
    name="lambert",
    title="Lambert's ideal diffuse reflection",
    cite="lambert1760",
    terms={"rho": lambertian},
)
