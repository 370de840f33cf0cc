"""The directions at which an RGL file stores a scan that is not from such a file.

They are half vectors on an even grid in sqrt(theta_h) and phi_h: `vndf` is constant, `ndf` 4 and `sigma` 1, so that the
stored value is f cos(theta_r) itself. An anisotropic scan covers the full circle of phi_i, because not every reader
uses the symmetry of a file that covers a part.
"""

import itertools
import math
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.formats.rgl.scan import X, Y, grid_of, measurement_of, tensor_variables, tensors_of
from gonio.measured.dataset import AXES

Values = npt.NDArray[np.float64]

SIZE = 64  # samples along each warped axis
MOST_ANGLES = 91  # the number of incidence angles up to which those of the scan are kept
EVEN_ANGLES = 31  # the number of even incidence angles for a scan with more
SAME = 1e-5  # rad; incidence angles nearer than this are one
WIDEST_TURN = 15.0  # deg, between azimuths phi_i


def layout(scan: xr.Dataset) -> xr.Dataset:
    """The nodes of the tensors where the scan has them, else half vectors at its incidence angles and phi_i."""
    if all(f"tensor_{n}" in scan.variables for n in ("theta_i", "phi_i", "ndf", "sigma", "vndf", "spectra")):
        tensors = tensors_of(scan)
        tensors["spectra"] = tensors["spectra"].reshape(-1, *tensors["spectra"].shape[-4:])[0]
        dims = scan["brdf"].dims if "brdf" in scan else ()
        if {Y, X} <= set(dims) and len(more := np.radians(scan["theta_i"].values)) > len(tensors["theta_i"]):
            tensors = _at_more_incidences(tensors, more)
        elif {Y, X} <= set(dims):
            names = [n for n in ("theta_i", "theta_r", "phi", "phi_i", Y, X) if n in scan.coords and scan[n].ndim]
            coords = {n: scan[n].variable for n in names} | _layout_tensors(tensors)
            return xr.Dataset(coords=coords, attrs={AXES: f"{Y} {X}"})
        else:
            tensors = _plain_tensors(scan)
    else:
        tensors = _plain_tensors(scan)
    return grid_of(measurement_of(tensors, 0)).assign_coords(_layout_tensors(tensors))


def _at_more_incidences(tensors: dict[str, Any], theta_i: Values) -> dict[str, Any]:
    """The tensors with slices at further incidence angles [rad], warped as the slice at the nearest angle is."""
    nearest = np.abs(tensors["theta_i"][None].astype(float) - theta_i[:, None]).argmin(axis=1)
    angles = tensors["theta_i"][nearest]
    new = np.abs(angles - theta_i) > SAME
    more = {"theta_i": np.where(new, theta_i, angles).astype(np.float32)}
    return tensors | more | {name: tensors[name][:, nearest] for name in ("vndf", "spectra")}


def _layout_tensors(tensors: dict[str, Any]) -> dict[str, Any]:
    """The tensors that a resampled scan needs in order to be written."""
    names = ("theta_i", "phi_i", "ndf", "sigma", "vndf", "jacobian")
    return tensor_variables({n: tensors[n] for n in names if n in tensors}, ())


def _plain_tensors(scan: xr.Dataset) -> dict[str, Any]:
    angles = _distinct(scan["theta_i"].values)
    angles = angles[angles <= 90.0]  # half-difference grids have nodes below the horizon
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
    """Azimuths phi_i [deg] at steps of at most WIDEST_TURN.

    Between two of them a reader interpolates at a fixed half vector, hence the limit.
    """
    parts = [np.linspace(a, b, math.ceil((b - a) / WIDEST_TURN) + 1)[:-1] for a, b in itertools.pairwise(turns)]
    return np.concatenate([*parts, turns[-1:]])


def _distinct(angles: Any) -> Values:
    distinct: Values = np.unique(np.round(np.asarray(angles, dtype=float), 5))
    return distinct
