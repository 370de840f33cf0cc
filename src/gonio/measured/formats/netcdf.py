"""gonio's own Dataset as a NetCDF file."""

from pathlib import Path

import xarray as xr

from gonio.files import FormatError
from gonio.measured.dataset import ANGLES, SETS
from gonio.measured.format import Format, Holds

_CLASSIC, _HDF5 = (b"CDF\x01", b"CDF\x02"), b"\x89HDF\r\n\x1a\n"


def _recognises(head: bytes) -> bool:
    return head.startswith((*_CLASSIC, _HDF5))


def _read(path: Path) -> xr.Dataset:
    with path.open("rb") as file:
        is_hdf5 = file.read(8) == _HDF5
    try:
        scan = _load(path, "h5netcdf" if is_hdf5 else "scipy")
    except (ValueError, ImportError) as error:
        if is_hdf5 and "h5netcdf" in str(error):
            raise FormatError(
                path, "is a NetCDF-4 file: install h5netcdf to read it, or save it as NetCDF-3"
            ) from error
        raise FormatError(path, f"is a damaged NetCDF file ({_one_line(error)})") from error
    except Exception as error:  # the NetCDF reader raises whatever the damaged bytes lead it to
        raise FormatError(path, f"is a damaged NetCDF file ({_one_line(error)})") from error
    if missing := [name for name in ("brdf", *ANGLES) if name not in scan.variables]:
        raise FormatError(
            path, f"has no {', '.join(missing)}: a scan needs brdf and the coordinates theta_i, theta_r, phi"
        )
    return scan


def _load(path: Path, engine: str) -> xr.Dataset:
    with xr.open_dataset(path, engine=engine) as opened:
        scan = opened.load()
    for name in SETS:
        if name in scan.variables and scan[name].dtype.kind in "OS":
            scan[name] = scan[name].astype(str)
    return scan


def _one_line(error: Exception) -> str:
    return f"{type(error).__name__}: {error}".splitlines()[0]


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
