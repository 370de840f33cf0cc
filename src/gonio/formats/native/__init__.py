"""The formats of gonio itself, which keep every variable of a scan: tidy CSV, NetCDF and Zarr."""

from gonio.formats.native.netcdf import FORMAT as NETCDF
from gonio.formats.native.tidy_csv import FORMAT as TIDY_CSV
from gonio.formats.native.zarr_store import FORMAT as ZARR

__all__ = ["NETCDF", "TIDY_CSV", "ZARR"]
