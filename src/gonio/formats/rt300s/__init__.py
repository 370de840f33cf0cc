"""The goniometer RT-300S: its workbooks, and the text tables that its users publish."""

from gonio.formats.rt300s.jdv import FORMAT as JDV
from gonio.formats.rt300s.sheet import FORMAT as RT300S

__all__ = ["JDV", "RT300S"]
