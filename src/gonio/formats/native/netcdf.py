"""gonio's own Dataset as a NetCDF file."""

import warnings
from pathlib import Path

import numpy as np
import xarray as xr

from gonio.door import netcdf3
from gonio.door.text import clip
from gonio.files import FormatError
from gonio.formats.format import Format, Holds
from gonio.measured.coordinates import SYSTEMS
from gonio.measured.dataset import ABSOLUTE, ANGLES, DIRECTIONS, HORIZON, RELATIVE, SETS

_HDF5 = b"\x89HDF\r\n\x1a\n"
_AXES = {axis for system in SYSTEMS.values() for axis in system.axes}


def _recognises(head: bytes) -> bool:
    return head.startswith((*netcdf3.MAGIC, _HDF5))


def _read(path: Path) -> xr.Dataset:
    with path.open("rb") as file:
        is_hdf5 = file.read(8) == _HDF5
    scan, places = _hdf5(path) if is_hdf5 else _classic(path)
    if missing := [name for name in ("brdf", *ANGLES) if name not in scan.variables]:
        what = f"has no {', '.join(missing)}: a scan needs brdf and the coordinates theta_i, theta_r, phi"
        raise FormatError(path, what, "byte 0")
    for name in SETS:
        if name in scan.variables and scan[name].dtype.kind in "OS":
            scan[name] = _as_text(path, scan[name], places)
    _refuse_invalid(path, scan, places)
    return scan


def _as_text(path: Path, names: xr.DataArray, places: dict[str, int]) -> xr.DataArray:
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
    except Exception as error:  # the decoder raises whatever the damaged attributes lead it to
        at = min(places.values(), default=0)
        raise FormatError(path, f"is a damaged NetCDF file ({_one_line(error)})", f"byte {at}") from error


def _hdf5(path: Path) -> tuple[xr.Dataset, dict[str, int]]:
    try:
        with xr.open_dataset(path, engine="h5netcdf", decode_times=False) as opened:
            return opened.load(), {}
    except (ValueError, ImportError) as error:
        if "h5netcdf" in str(error):
            what = "is a NetCDF-4 file: install h5netcdf to read it, or save it as NetCDF-3"
            raise FormatError(path, what, "byte 0") from error
        raise FormatError(path, f"is a damaged NetCDF file ({_one_line(error)})", "byte 0") from error
    except Exception as error:  # the NetCDF reader raises whatever the damaged bytes lead it to
        raise FormatError(path, f"is a damaged NetCDF file ({_one_line(error)})", "byte 0") from error


def _refuse_invalid(path: Path, scan: xr.Dataset, places: dict[str, int]) -> None:
    """FormatError at the variable that no scan can have: a place is the byte where its values begin."""

    def refuse(name: str, what: str) -> None:
        raise FormatError(path, f"{name} {what}", f"byte {places.get(name, 0)}")

    brdf = scan["brdf"]
    for name in (n for n in ("brdf", *DIRECTIONS, "uncertainty", "wavelength") if n in scan.variables):
        if scan[name].dtype.kind not in "fiu" or not set(scan[name].dims) <= set(brdf.dims):
            refuse(name, "is no number at each direction")
        if np.isinf(scan[name].values).any():
            refuse(name, "is infinite")
    if str(brdf.attrs.get("units")) not in (ABSOLUTE, RELATIVE):  # a damaged attribute may be an array
        refuse("brdf", f"has the unit {clip(str(brdf.attrs.get('units')))!r}: it needs sr-1, or a.u. for relative data")
    finite = np.isfinite(brdf.values)
    if not brdf.values[finite].any():
        refuse("brdf", "is zero everywhere, or missing")
    for name in (n for n in DIRECTIONS if n in scan.variables):
        low, high = (0.0, HORIZON) if name.startswith("theta") else (-np.inf, np.inf)
        good = (scan[name] >= low) & (scan[name] <= high)  # false where it is NaN
        if not good.values.all() and not good.broadcast_like(brdf).transpose(*brdf.dims).values[finite].all():
            refuse(name, f"is missing or outside {low:g} to {high:g} deg where brdf has a value")
    for name in (n for n in brdf.dims if n in _AXES and n in scan.variables):
        if scan[name].ndim != 1:
            refuse(str(name), "has not one value for each step along its axis")
        if not scan[name].to_index().is_unique or scan[name].isnull().any():
            refuse(str(name), "has a value twice, or none, along its axis")
    if "wavelength" in scan.variables and not (scan["wavelength"].values > 0).all():
        refuse("wavelength", "is missing or not positive")


def _one_line(error: Exception) -> str:
    text = f"{type(error).__name__}: {error}".splitlines()[0]
    return clip("".join(c for c in text if c.isprintable()), 200)


def _write(scan: xr.Dataset, path: Path) -> None:
    kept = scan.drop_vars("line", errors="ignore")
    kept.to_netcdf(path, engine="scipy", format="NETCDF3_64BIT")


FORMAT = Format(
    name="netcdf",
    title="gonio NetCDF",
    suffix=".nc",
    recognises=_recognises,
    read=_read,
    write=_write,
    holds=Holds(anisotropic=True, transmission=True, relative=True, gaps=True, sets=SETS, variables=("*",)),
)
