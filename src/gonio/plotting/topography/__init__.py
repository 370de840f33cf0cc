"""A height map, its spectrum and its slopes in one figure."""

from gonio.plotting.topography.figure import topography_figure

__all__ = ["topography_figure"]
