"""Is the set-up right? A mirror against Fresnel's equations, a diffuse standard against its certified curve (eq 9)."""

from gonio.verification.delta import Deviation, delta
from gonio.verification.diffuse import Compared, diffuse, lambertian
from gonio.verification.specular import Mirrored, polarisation_error, specular

__all__ = [
    "Compared",
    "Deviation",
    "Mirrored",
    "delta",
    "diffuse",
    "lambertian",
    "polarisation_error",
    "specular",
]
