"""The data files of the BRDF library ALTA: one data set per file, in text or in binary."""

from gonio.formats.alta.binary import FORMAT as ALTA_BINARY
from gonio.formats.alta.text import FORMAT as ALTA

__all__ = ["ALTA", "ALTA_BINARY"]
