"""The journal that `gonio measure` writes: lines of JSON behind their checksums (gonio.acquisition.journal)."""

from pathlib import Path

import xarray as xr

from gonio.acquisition.journal import FORMAT
from gonio.acquisition.readings import readings
from gonio.files import FormatError


def recognises(start: bytes) -> bool:
    """Whether a file begins as a journal does."""
    return FORMAT.encode() in start.partition(b"\n")[0]


def read(path: Path) -> xr.Dataset:
    """The readings of a journal, the last attempt of each step; FormatError where it holds none that can be reduced."""
    try:
        return readings(path)
    except FormatError:
        raise
    except ValueError as error:
        raise FormatError(path, str(error)) from error
