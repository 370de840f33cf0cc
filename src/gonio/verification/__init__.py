"""Is the set-up right? A mirror against Fresnel's equations, a standard against its certified curve, and more."""

from gonio.verification.checks import CHECKS, Outcome
from gonio.verification.delta import Deviation, delta
from gonio.verification.diffuse import Compared, diffuse, lambertian
from gonio.verification.specular import Mirrored, polarisation_error, specular

__all__ = [
    "CHECKS",
    "Compared",
    "Deviation",
    "Mirrored",
    "Outcome",
    "delta",
    "diffuse",
    "lambertian",
    "polarisation_error",
    "specular",
]
