"""Where RGL files hold a scan that never was in one.

It is laid out on half vectors, evenly in sqrt(theta_h) and phi_h: `vndf` is constant, `ndf` 4 and `sigma` 1, so that a
value stored is f cos(theta_r) itself. An anisotropic scan covers the whole circle of phi_i, because not every reader
folds it back.
"""

import itertools
import math
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.formats.rgl.scan import X, Y, grid_of, named, surface_of, tensors_of

Values = npt.NDArray[np.float64]

SIZE = 64  # samples along each warped axis
MOST_ANGLES = 91  # incidence angles of a scan that are kept as they are
EVEN_ANGLES = 31  # otherwise
WIDEST_TURN = 15.0  # deg


def layout(scan: xr.Dataset) -> xr.Dataset:
    """The grid of the scan's own tensors, else half vectors at the scan's incidence angles and turns."""
    if all(f"tensor_{n}" in scan.variables for n in ("theta_i", "phi_i", "ndf", "sigma", "vndf", "spectra")):
        tensors = tensors_of(scan)
        tensors["spectra"] = tensors["spectra"].reshape(-1, *tensors["spectra"].shape[-4:])[0]
        own = scan["brdf"].dims if "brdf" in scan else ()
        if {Y, X} <= set(own):
            names = [n for n in ("theta_i", "theta_r", "phi", "phi_i", Y, X) if n in scan.coords and scan[n].ndim]
            return xr.Dataset(coords={n: scan[n].variable for n in names} | _kept(tensors))
    tensors = _plain_tensors(scan)
    return grid_of(surface_of(tensors, 0)).assign_coords(_kept(tensors))


def _kept(tensors: dict[str, Any]) -> dict[str, Any]:
    """The tensors that a resampled scan must bring to be written."""
    names = ("theta_i", "phi_i", "ndf", "sigma", "vndf", "jacobian")
    return named({n: tensors[n] for n in names if n in tensors}, ())


def _plain_tensors(scan: xr.Dataset) -> dict[str, Any]:
    angles = _distinct(scan["theta_i"].values)
    if len(angles) > MOST_ANGLES:
        angles = np.linspace(angles[0], min(angles[-1], 89.0), EVEN_ANGLES)
    turns = np.zeros(1)
    if "phi_i" in scan.variables and len(_distinct(scan["phi_i"].values % 360.0)) > 1:
        within = (scan["phi_i"].values.astype(float).ravel() + 180.0) % 360.0 - 180.0
        turns = _dense(_distinct(np.concatenate([within, [-180.0, 180.0]])))
    theta_i, phi_i = (np.radians(v).astype(np.float32) for v in (angles, turns))
    slices = (len(phi_i), len(theta_i))
    return {
        "theta_i": theta_i,
        "phi_i": phi_i,
        "sigma": np.ones((2, 2), dtype=np.float32),
        "ndf": np.full((2, 2), 4.0, dtype=np.float32),
        "vndf": np.ones((*slices, 2, 2), dtype=np.float32),
        "jacobian": np.ones(1, dtype=np.int32),
        "spectra": np.zeros((*slices, SIZE, SIZE), dtype=np.float32),
    }


def _dense(turns: Values) -> Values:
    """Turns of the surface no further apart than WIDEST_TURN: between them the format keeps half vectors in place."""
    parts = [np.linspace(a, b, math.ceil((b - a) / WIDEST_TURN) + 1)[:-1] for a, b in itertools.pairwise(turns)]
    return np.concatenate([*parts, turns[-1:]])


def _distinct(angles: Any) -> Values:
    found: Values = np.unique(np.round(np.asarray(angles, dtype=float), 5))
    return found
