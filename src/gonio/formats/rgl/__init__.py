"""The measured BRDF files of RGL: tensor files in an adaptive parameterisation."""

from gonio.formats.rgl.file import FORMAT as RGL

__all__ = ["RGL"]
