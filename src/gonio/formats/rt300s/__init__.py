"""Files of the goniometer J&C RT-300S: its workbooks, and its text tables."""

from gonio.formats.rt300s.jdv import FORMAT as JDV
from gonio.formats.rt300s.sheet import FORMAT as RT300S

__all__ = ["JDV", "RT300S"]
