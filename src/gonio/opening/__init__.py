"""`xarray.open_dataset(path, engine="gonio")`: files of goniometers for who works with xarray.

xarray finds the class by the entry point `xarray.backends`, and loads it whenever it looks for an engine: so the
formats are loaded when a file is asked for, and not before.
"""

import os
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any, ClassVar

import xarray as xr
from xarray.backends import BackendEntrypoint

# The header of a tidy CSV file of gonio, which has no signature.
_TIDY = re.compile(rb"^(?!#)(?=[^\n]*\btheta_i_deg\b)(?=[^\n]*\btheta_r_deg\b)[^\n]*\bbrdf_", re.MULTILINE)


class Gonio(BackendEntrypoint):
    """The engine `gonio` of `xarray.open_dataset`: reads what `gonio.read` reads."""

    description: ClassVar[str] = "Open files of BRDF measurements (goniometers, MERL, RGL, Radiance, ..) by gonio"
    url: ClassVar[str] = ""
    open_dataset_parameters: ClassVar[tuple[str, ...] | None] = ("filename_or_obj", "drop_variables")

    def open_dataset(self, filename_or_obj: Any, *, drop_variables: str | Iterable[str] | None = None) -> xr.Dataset:
        """The scan in a file, as `gonio.read` gives it, without the variables that are named.

        Raises TypeError for what is no path, and FormatError, a ValueError, for a file that cannot be read.
        """
        from gonio.formats import read

        if not isinstance(filename_or_obj, str | os.PathLike):
            raise TypeError(
                f"the engine gonio reads a file by its path, and was given a {type(filename_or_obj).__name__}: "
                "write it to a file first"
            )
        dropped = [drop_variables] if isinstance(drop_variables, str) else list(drop_variables or ())
        return read(os.fspath(filename_or_obj)).drop_vars(dropped, errors="ignore")

    def guess_can_open(self, filename_or_obj: Any) -> bool:
        """Whether the file says itself that it is of a format of gonio's; True for no file that another engine reads.

        Formats that are recognised without a signature are opened where the engine is named.
        """
        from gonio.door import netcdf, text
        from gonio.formats import HEAD, formats
        from gonio.formats.format import SIGNED

        try:
            head = text.head(Path(filename_or_obj), HEAD)
        except (TypeError, ValueError, OSError):  # another kind of object, an address, a folder, what may not be read
            return False
        if netcdf.is_netcdf(head):
            return False
        signed = (one for one in formats().values() if one.rank == SIGNED)
        return any(one.recognises(head) for one in signed) or bool(_TIDY.search(head))
