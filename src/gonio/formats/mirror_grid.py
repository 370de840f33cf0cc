"""Grids about the mirror direction, for formats (Integra, SSDD) that store tables about it."""

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.coordinates import grid, system_of
from gonio.measured.dataset import flatten

Values = npt.NDArray[np.float64]

DECIMALS = 6  # of a degree; angles nearer than this are one
AZIMUTH_STEP = 10.0  # deg, about the mirror direction
NARROWEST, WIDEST = 0.5, 5.0  # deg, between nodes about the mirror direction


def existing_grid(scan: xr.Dataset, *systems: str) -> xr.Dataset | None:
    """The grid that a scan is on already, in one of the named coordinate `systems`; None where it has none."""
    system = system_of(scan)
    if system is None or system.name not in systems or scan["brdf"].dims == ("direction",):
        return None
    axes = {a: scan[a].values for a in system.axes if a in scan["brdf"].dims}
    return grid(system.name, **{a: _ascending(v, a in system.azimuths) for a, v in axes.items()})


def _ascending(values: Values, is_azimuth: bool) -> Values:
    """An axis with ascending angles, as files list them: azimuths that do not ascend from 0 are reduced and sorted."""
    if (np.diff(values) > 0).all() and not (is_azimuth and values[0] < 0):
        return values
    return np.unique(np.round(values % 360.0, DECIMALS) if is_azimuth else values)


def mirror_grid(scan: xr.Dataset) -> xr.Dataset:
    """A new grid (theta_i, theta_s, phi_s[, phi_i]) [deg] at the scan's incidence angles, with steps near its own.

    A scan in the plane of incidence gets all azimuths too: a program that reads a file with the plane alone would
    interpolate the directions beside it between the two sides of the mirror direction.
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
    """The median step of the scan in theta_r [deg], moved to a divisor of 90 within NARROWEST and WIDEST."""
    steps = np.diff(_distinct(theta_r))
    usual = float(np.median(steps)) if len(steps) else WIDEST
    return 90.0 / round(90.0 / min(max(usual, NARROWEST), WIDEST))
