"""Magnitudes of bodies of flat facets, such as satellites, from fitted BRDFs, each with its standard uncertainty."""

from gonio.photometry.air import Air, airmass
from gonio.photometry.bands import Band, bands
from gonio.photometry.bodies import read_facets
from gonio.photometry.curve import light_curve, magnitude
from gonio.photometry.facets import Facet
from gonio.photometry.lamps import SUN_HALF_ANGLE, Earth
from gonio.photometry.passes import Pass, read_pass
from gonio.photometry.vectors import EARTH_RADIUS, Sight, from_horizon

__all__ = [
    "EARTH_RADIUS",
    "SUN_HALF_ANGLE",
    "Air",
    "Band",
    "Earth",
    "Facet",
    "Pass",
    "Sight",
    "airmass",
    "bands",
    "from_horizon",
    "light_curve",
    "magnitude",
    "read_facets",
    "read_pass",
]
