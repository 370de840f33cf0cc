"""Text files of Integra (formerly Lightsource): diffuse and specular tables, of reflection and of transmission."""

from gonio.formats.integra.scattering import FORMAT as DIFFUSE
from gonio.formats.integra.scattering import TRANSMITTED as DIFFUSE_TRANSMISSION
from gonio.formats.integra.specular import FORMAT as SPECULAR
from gonio.formats.integra.specular import TRANSMITTED as SPECULAR_TRANSMISSION

__all__ = ["DIFFUSE", "DIFFUSE_TRANSMISSION", "SPECULAR", "SPECULAR_TRANSMISSION"]
