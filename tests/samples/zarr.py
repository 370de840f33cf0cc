"""Small Zarr stores, flat and dense; a store is a directory of files."""

from pathlib import Path

import numpy as np
import xarray as xr

from gonio import write
from gonio.measured.dataset import make_scan


def flat() -> xr.Dataset:
    return make_scan(
        [10, 10, 30, 30.5],
        [5, 10, 45.25, 89],
        [0.1, np.nan, 1 / 3, 2e-7],
        [0, 180, 90.5, 359],
        phi_i=[0, 45, 90, 200],
        uncertainty=[0.01, 0.02, 0.03, 0.04],
        coordinates={"channel": ["R", "R", "G", "µ"], "wavelength": [550.0, 550.0, 650.0, 450.0]},
        variables={"mask": (np.array([0, 1, 0, 2], dtype=np.int8), "1"), "stage": (["a", "b", "a b", ""], "1")},
        provenance="material: aluminium, ünpolished",
        history="made by hand",
    )


def dense() -> xr.Dataset:
    values = np.arange(1.0, 13.0).reshape(2, 2, 3)
    values[0, 1, 2] = np.nan
    return xr.Dataset(
        {"brdf": (("channel", "theta_i", "theta_r"), values, {"units": "a.u."})},
        coords={
            "channel": ("channel", ["R", "G"]),
            "theta_i": ("theta_i", [10.0, 20.0], {"units": "degree"}),
            "theta_r": ("theta_r", [0.0, 30.0, 60.0], {"units": "degree"}),
            "phi": ((), 180.0, {"units": "degree"}),
        },
        attrs={"provenance": ""},
    )


def samples(folder: Path) -> list[Path]:
    found = [folder / "flat.zarr", folder / "dense.zarr"]
    for path, scan in zip(found, (flat(), dense()), strict=True):
        write(scan, path)
    return found
