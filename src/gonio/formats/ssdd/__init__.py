"""SSDD, the format of the library libbsdf: several blocks of data in one file, in coordinates that it names."""

from gonio.formats.ssdd.file import FORMAT as SSDD

__all__ = ["SSDD"]
