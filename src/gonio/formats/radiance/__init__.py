"""The XML files of Radiance and WINDOW: Klems matrices or tensor trees."""

from gonio.formats.radiance.window import FORMAT as RADIANCE

__all__ = ["RADIANCE"]
