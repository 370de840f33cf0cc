"""The universal BRDF format of the project BiRD: JSON with metadata of the measurement beside the data."""

from gonio.formats.bird.file import FORMAT as BIRD

__all__ = ["BIRD"]
