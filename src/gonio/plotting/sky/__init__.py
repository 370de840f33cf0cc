"""Light curves: the magnitude of a body over time or over the phase angle, and what each of its facets adds."""

from gonio.plotting.sky.light_curve import light_curve_figure

__all__ = ["light_curve_figure"]
