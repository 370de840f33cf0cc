"""Albedo of surfaces: black-, white- and blue-sky and NBAR, of a model or a fit, and of every pixel of an image.

A black-sky albedo is under the sun alone, a white-sky one under an even sky, a blue-sky one a mixture of both.
"""

from gonio.albedo.integrals import METHODS
from gonio.albedo.maps import albedo_maps
from gonio.albedo.retrieval import as_stack, retrieve
from gonio.albedo.surfaces import Albedo, black_sky, blue_sky, nbar, white_sky

__all__ = ["METHODS", "Albedo", "albedo_maps", "as_stack", "black_sky", "blue_sky", "nbar", "retrieve", "white_sky"]
