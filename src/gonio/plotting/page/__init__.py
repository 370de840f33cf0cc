"""The page a figure is drawn for: its size, text, resolution, title, style and formats, and whether all of it fits."""

from gonio.plotting.page.sheet import FORMATS, Page, current, drawn_on, target_of

__all__ = ["FORMATS", "Page", "current", "drawn_on", "target_of"]
