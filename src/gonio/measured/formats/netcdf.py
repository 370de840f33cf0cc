"""gonio's own Dataset as a NetCDF file."""

from pathlib import Path

import xarray as xr

from gonio.measured.dataset import ANGLES
from gonio.measured.format import Format, FormatError

_CLASSIC, _HDF5 = (b"CDF\x01", b"CDF\x02"), b"\x89HDF\r\n\x1a\n"


def _recognises(head: bytes) -> bool:
    return head.startswith((*_CLASSIC, _HDF5))


def _read(path: Path) -> xr.Dataset:
    with path.open("rb") as file:
        is_hdf5 = file.read(8) == _HDF5
    engine = "h5netcdf" if is_hdf5 else "scipy"
    try:
        with xr.open_dataset(path, engine=engine) as opened:
            scan = opened.load()
    except (ValueError, ImportError) as error:
        if is_hdf5 and "h5netcdf" in str(error):
            raise FormatError(
                path, "is a NetCDF-4 file: install h5netcdf to read it, or save it as NetCDF-3"
            ) from error
        raise FormatError(path, f"is a damaged NetCDF file ({error})") from error
    except Exception as error:  # the NetCDF reader raises whatever the damaged bytes lead it to
        raise FormatError(path, f"is a damaged NetCDF file ({type(error).__name__}: {error})") from error
    if missing := [name for name in ("brdf", *ANGLES) if name not in scan.variables]:
        raise FormatError(
            path, f"has no {', '.join(missing)}: a scan needs brdf and the coordinates theta_i, theta_r, phi"
        )
    for name in ("channel", "scan"):
        if name in scan.variables and scan[name].dtype.kind in "OS":
            scan[name] = scan[name].astype(str)
    return scan


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
)
