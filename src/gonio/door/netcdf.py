"""A NetCDF file as a Dataset: the classic format by netcdf3.py, NetCDF-4 by h5netcdf where it is installed."""

import warnings
from pathlib import Path

import xarray as xr

from gonio.door import netcdf3
from gonio.door.text import clip
from gonio.files import FormatError

HDF5 = b"\x89HDF\r\n\x1a\n"
CONTENT = "content"  # attribute of files that hold something other than a scan: its name
MAGIC = (*netcdf3.MAGIC, HDF5)


def is_netcdf(head: bytes) -> bool:
    """Whether a file that begins with these bytes is NetCDF."""
    return head.startswith(MAGIC)


def read(path: Path) -> tuple[xr.Dataset, dict[str, int]]:
    """The Dataset, decoded and in memory, and the byte at which each variable's values begin.

    The bytes are known for the classic format only. Raises FormatError with the byte offset for a damaged file.
    """
    with path.open("rb") as file:
        is_hdf5 = file.read(len(HDF5)) == HDF5
    return _hdf5(path) if is_hdf5 else _classic(path)


def text(path: Path, names: xr.DataArray, places: dict[str, int]) -> xr.DataArray:
    """A variable of texts as Python strings. Raises FormatError where its bytes are in no known encoding."""
    try:
        return names.astype(str)
    except UnicodeDecodeError as error:
        place = f"byte {places.get(str(names.name), 0)}"
        raise FormatError(path, f"{names.name} is text in no known encoding: save it as UTF-8", place) from error


def _classic(path: Path) -> tuple[xr.Dataset, dict[str, int]]:
    places: dict[str, int] = {}
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            stored, places = netcdf3.read(path)
            return xr.decode_cf(stored, decode_times=False).load(), places
    except FormatError:
        raise
    except Exception as error:  # damaged attributes may raise any exception in the decoder
        at = min(places.values(), default=0)
        raise FormatError(path, f"is a damaged NetCDF file ({_one_line(error)})", f"byte {at}") from error


def _hdf5(path: Path) -> tuple[xr.Dataset, dict[str, int]]:
    try:
        with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as opened:
            return opened.load(), {}
    except (ValueError, ImportError) as error:
        if "h5netcdf" in str(error):
            message = "is a NetCDF-4 file: install h5netcdf to read it, or save it as NetCDF-3"
            raise FormatError(path, message, "byte 0") from error
        raise FormatError(path, f"is a damaged NetCDF file ({_one_line(error)})", "byte 0") from error
    except Exception as error:  # damaged bytes may raise any exception in the reader
        raise FormatError(path, f"is a damaged NetCDF file ({_one_line(error)})", "byte 0") from error


def _one_line(error: Exception) -> str:
    text = f"{type(error).__name__}: {error}".splitlines()[0]
    return clip("".join(c for c in text if c.isprintable()), 200)
