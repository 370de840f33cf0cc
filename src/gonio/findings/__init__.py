"""The mistakes of a measurement: what shows them, and how the scan is mended."""

from gonio.findings.corrections import Corrections
from gonio.findings.lobe import Lobe, lobes
from gonio.findings.registry import MISTAKES, NAMES, check

__all__ = ["MISTAKES", "NAMES", "Corrections", "Lobe", "check", "lobes"]
