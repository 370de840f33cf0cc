"""NetCDF-3 as gonio writes it, flat and on a dense grid in channels, and the classic variant with short offsets."""

from pathlib import Path

import numpy as np
import xarray as xr

from gonio import write
from gonio.measured.coordinates import grid
from gonio.measured.dataset import make_scan


def samples(folder: Path) -> list[Path]:
    """A flat scan with sets and uncertainties, a dense grid, and a scan in the older variant."""
    flat = make_scan(
        [10, 10, 30, 30.5],
        [5, 10, 45.25, 89],
        [0.1, np.nan, 1 / 3, 2e-7],
        [0, 180, 90.5, 360],
        uncertainty=[0.01, 0.02, 0.03, 0.04],
        coordinates={"channel": ["R", "R", "G", "µ"]},
        variables={"mask": (np.array([0, 1, 0, 2], dtype=np.int8), "1")},
        provenance="material: aluminium, ünpolished",
        history="made by hand",
    )
    dense = grid("specular", theta_i=[0.0, 30.0], theta_s=[0.0, 20.0, 40.0], phi_s=[0.0, 90.0, 180.0])
    values = np.where(dense["theta_r"] > 90, np.nan, 0.25)
    dense["brdf"] = (("channel", *dense["theta_r"].dims), np.stack([values, 2 * values]), {"units": "sr-1"})
    dense = dense.assign_coords(channel=["R", "G"]).assign_attrs(provenance="", history="")
    paths = [folder / "flat.nc", folder / "dense.nc", folder / "classic.nc"]
    write(flat, paths[0], to="netcdf")
    write(dense, paths[1], to="netcdf")
    small: xr.Dataset = make_scan([30, 30], [-10, 10], [0.1, 0.2], unit="a.u.")
    small.to_netcdf(paths[2], engine="scipy", format="NETCDF3_CLASSIC")
    return paths
