"""Radiance: the XML of a window, with Klems matrices or tensor trees."""

from gonio.formats.radiance.window import FORMAT as RADIANCE

__all__ = ["RADIANCE"]
