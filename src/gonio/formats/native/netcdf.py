"""gonio's own Dataset as a NetCDF file, with the names and units that docs/conventions.md lists.

Files are written in the classic format with 64-bit offsets. Files of NetCDF-4 are read where h5netcdf is installed.
"""

from pathlib import Path

import numpy as np
import xarray as xr

from gonio.door import netcdf
from gonio.door.text import clip
from gonio.files import FormatError
from gonio.formats.format import Format, Holds
from gonio.measured.causes import CAUSE, SYSTEMATIC, fault
from gonio.measured.coordinates import SYSTEMS
from gonio.measured.dataset import ANGLES, DIRECTIONS, HORIZON, SETS, UNITS
from gonio.measured.sound import UNCERTAINTIES

_AXES = {axis for system in SYSTEMS.values() for axis in system.axes}


def _read(path: Path) -> xr.Dataset:
    scan, places = netcdf.read(path)
    if netcdf.CONTENT in scan.attrs:
        message = (
            f"holds a {clip(str(scan.attrs[netcdf.CONTENT]))}, and no scan: gonio check reads it, and Solution.load"
        )
        raise FormatError(path, message, "byte 0")
    if missing := [name for name in ("brdf", *ANGLES) if name not in scan.variables]:
        message = f"has no {', '.join(missing)}: a scan needs brdf and the coordinates theta_i, theta_r, phi"
        raise FormatError(path, message, "byte 0")
    # Which variables are coordinates is an attribute, which a file may lack; what they are follows from their names.
    scan = scan.set_coords([name for name in (*DIRECTIONS, *SETS) if name in scan.variables])
    for name in (*SETS, CAUSE):
        if name in scan.variables and scan[name].dtype.kind in "OS":
            scan[name] = netcdf.text(path, scan[name], places)
    _refuse_invalid(path, scan, places)
    if wrong := fault(scan):
        raise FormatError(path, f"{SYSTEMATIC} {wrong}", f"byte {places.get(SYSTEMATIC, 0)}")
    return scan


def _refuse_invalid(path: Path, scan: xr.Dataset, places: dict[str, int]) -> None:
    """Raise FormatError for the first invalid variable of a scan; `places` has the byte where its values begin."""

    def refuse(name: str, problem: str) -> None:
        raise FormatError(path, f"{name} {problem}", f"byte {places.get(name, 0)}")

    brdf = scan["brdf"]
    for name in (n for n in ("brdf", *DIRECTIONS, *UNCERTAINTIES, "wavelength") if n in scan.variables):
        if scan[name].dtype.kind not in "fiu" or not set(scan[name].dims) <= set(brdf.dims):
            refuse(name, "is no number at each direction")
        if np.isinf(scan[name].values).any():
            refuse(name, "is infinite")
    if str(brdf.attrs.get("units")) not in UNITS:  # str: a damaged attribute may be an array
        refuse("brdf", f"has the unit {clip(str(brdf.attrs.get('units')))!r}: it needs sr-1, or a.u. for relative data")
    finite = np.isfinite(brdf.values)
    if not brdf.values[finite].any():
        refuse("brdf", "is zero everywhere, or missing")
    for name in (n for n in DIRECTIONS if n in scan.variables):
        low, high = (0.0, HORIZON) if name.startswith("theta") else (-np.inf, np.inf)
        good = (scan[name] >= low) & (scan[name] <= high)  # False where it is NaN
        if not good.values.all() and not good.broadcast_like(brdf).transpose(*brdf.dims).values[finite].all():
            refuse(name, f"is missing or outside {low:g} to {high:g} deg where brdf has a value")
    for name in (n for n in brdf.dims if n in _AXES and n in scan.variables):
        if scan[name].ndim != 1:
            refuse(str(name), "has not one value for each step along its axis")
        if not scan[name].to_index().is_unique or scan[name].isnull().any():
            refuse(str(name), "has a value twice, or none, along its axis")
    if "wavelength" in scan.variables and not (scan["wavelength"].values > 0).all():
        refuse("wavelength", "is missing or not positive")


def _write(scan: xr.Dataset, path: Path) -> None:
    stored = scan.drop_vars("line", errors="ignore")
    stored.to_netcdf(path, engine="scipy", format="NETCDF3_64BIT")


FORMAT = Format(
    name="netcdf",
    title="gonio NetCDF",
    suffix=".nc",
    recognises=netcdf.is_netcdf,
    read=_read,
    write=_write,
    holds=Holds(anisotropic=True, transmission=True, relative=True, gaps=True, sets=SETS, variables=("*",)),
)
