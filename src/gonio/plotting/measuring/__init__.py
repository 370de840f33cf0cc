"""Figures of a measurement while it is made, and of what verifies a set-up."""

from gonio.plotting.measuring.readings import draw_readings, readings_figure
from gonio.plotting.measuring.verification import diffuse_figure, mirror_figure

__all__ = ["diffuse_figure", "draw_readings", "mirror_figure", "readings_figure"]
