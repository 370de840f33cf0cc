"""gonio's own Dataset as a NetCDF file."""

from pathlib import Path

import numpy as np
import xarray as xr

from gonio.door import netcdf
from gonio.door.text import clip
from gonio.files import FormatError
from gonio.formats.format import Format, Holds
from gonio.measured.coordinates import SYSTEMS
from gonio.measured.dataset import ABSOLUTE, ANGLES, DIRECTIONS, HORIZON, RELATIVE, SETS

_AXES = {axis for system in SYSTEMS.values() for axis in system.axes}


def _read(path: Path) -> xr.Dataset:
    scan, places = netcdf.read(path)
    if netcdf.CONTENT in scan.attrs:
        what = f"holds a {clip(str(scan.attrs[netcdf.CONTENT]))}, and no scan: gonio check reads it, and Solution.load"
        raise FormatError(path, what, "byte 0")
    if missing := [name for name in ("brdf", *ANGLES) if name not in scan.variables]:
        what = f"has no {', '.join(missing)}: a scan needs brdf and the coordinates theta_i, theta_r, phi"
        raise FormatError(path, what, "byte 0")
    for name in SETS:
        if name in scan.variables and scan[name].dtype.kind in "OS":
            scan[name] = netcdf.text(path, scan[name], places)
    _refuse_invalid(path, scan, places)
    return scan


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


def _write(scan: xr.Dataset, path: Path) -> None:
    kept = scan.drop_vars("line", errors="ignore")
    kept.to_netcdf(path, engine="scipy", format="NETCDF3_64BIT")


FORMAT = Format(
    name="netcdf",
    title="gonio NetCDF",
    suffix=".nc",
    recognises=netcdf.is_netcdf,
    read=_read,
    write=_write,
    holds=Holds(anisotropic=True, transmission=True, relative=True, gaps=True, sets=SETS, variables=("*",)),
)
