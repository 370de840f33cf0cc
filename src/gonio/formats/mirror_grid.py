"""The grid about the mirror direction that a format stores for a scan which is on no such grid yet."""

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.coordinates import grid, system_of
from gonio.measured.dataset import flatten

Values = npt.NDArray[np.float64]

DECIMALS = 6  # of a degree; angles nearer than this are one
AZIMUTH_STEP = 10.0  # deg, about the mirror direction
NARROWEST, WIDEST = 0.5, 5.0  # deg, between nodes about the mirror direction


def own_grid(scan: xr.Dataset, *systems: str) -> xr.Dataset | None:
    """The coordinates of the grid of one of `systems` that the scan is on already; None where it is on none."""
    found = system_of(scan)
    if found is None or found.name not in systems or scan["brdf"].dims == ("direction",):
        return None
    axes = {a: scan[a].values for a in found.axes if a in scan["brdf"].dims}
    return grid(found.name, **{a: _ascending(v, a in found.azimuths) for a, v in axes.items()})


def _ascending(values: Values, is_azimuth: bool) -> Values:
    """An axis as it is where it ascends from zero, else turned round until it does: files list ascending angles."""
    if (np.diff(values) > 0).all() and not (is_azimuth and values[0] < 0):
        return values
    return np.unique(np.round(values % 360.0, DECIMALS) if is_azimuth else values)


def mirror_grid(scan: xr.Dataset) -> xr.Dataset:
    """Directions (theta_i, theta_s, phi_s[, phi_i]) [deg] at the scan's incidence angles, with steps near its own.

    Also of an in-plane scan: with the plane alone, a program would take what lies beside it from the two sides of it.
    """
    flat = flatten(scan)
    theta_i = _distinct(flat["theta_i"].values)
    turned = "phi_i" in flat.coords and len(_distinct(flat["phi_i"].values)) > 1
    azimuths = np.arange(0.0, 361.0, AZIMUTH_STEP)
    theta_s = np.arange(0.0, 90.0 + theta_i.max() + 1e-9, _step(flat["theta_r"].values))
    axes = {"theta_i": theta_i, "theta_s": theta_s, "phi_s": azimuths}
    return grid("specular", **axes, **({"phi_i": _distinct(flat["phi_i"].values % 360.0)} if turned else {}))


def _distinct(values: Values) -> Values:
    return np.unique(np.round(np.asarray(values, dtype=float), DECIMALS)) + 0.0


def _step(theta_r: Values) -> float:
    """The scan's usual step in theta_r [deg] as a part of 90, within what a file should have."""
    steps = np.diff(_distinct(theta_r))
    usual = float(np.median(steps)) if len(steps) else WIDEST
    return 90.0 / round(90.0 / min(max(usual, NARROWEST), WIDEST))
