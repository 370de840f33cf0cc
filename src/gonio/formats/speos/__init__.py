"""Files of Ansys (formerly OPTIS): the two kinds of BSDF tables of Speos, and the exports of the goniometer Reflet."""

from gonio.formats.speos.anisotropic import FORMAT as SPEOS_ANISOTROPIC
from gonio.formats.speos.brdf import FORMAT as SPEOS_BRDF
from gonio.formats.speos.reflet import FORMAT as REFLET

__all__ = ["REFLET", "SPEOS_ANISOTROPIC", "SPEOS_BRDF"]
