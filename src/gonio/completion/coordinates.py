"""Coordinates of a pair of directions in which light and detector may be exchanged.

The residual of a fit of a reciprocal surface is the same when both are exchanged. A function of coordinates that do not
change by it is reciprocal, whatever it learns.
"""

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset

Values = npt.NDArray[np.float64]

NEAR = 0.05  # of the shift: nearer to the mirror direction than 3 deg all is one place
NAMES = ("ln(shift + 0.05)", "distance from the back direction", "cos(theta_i) cos(theta_r)")


def coordinates(points: xr.Dataset) -> Values:
    """For each direction of a flat scan (points, 3): NAMES, in direction cosines.

    The shift is the distance from the mirror direction, |t_i + t_r| with the tangential parts t of the unit vectors;
    that from the back direction, |t_i - t_r|, runs along the lobe.
    """
    g = dataset.geometry(points)
    shift = np.hypot(g.x_i + g.x_r, g.y_i + g.y_r)
    back = np.hypot(g.x_i - g.x_r, g.y_i - g.y_r)
    return np.stack(np.broadcast_arrays(np.log(shift + NEAR), back, np.abs(g.z_i * g.z_r)), axis=-1)


def half_angles(points: xr.Dataset) -> Values:
    """theta_h, theta_d and the azimuth of the difference vector, folded to 0..90 deg (points, 3) [deg].

    Folded so, they do not change where light and detector are exchanged, or the surface is seen in a mirror.
    """
    g = dataset.geometry(points)
    w_i, w_r = np.stack([g.x_i, g.y_i, g.z_i], axis=-1), np.stack([g.x_r, g.y_r, g.z_r], axis=-1)
    half = w_i + w_r
    half /= np.maximum(np.linalg.norm(half, axis=-1, keepdims=True), 1e-12)
    cos_d = np.clip(np.sum(w_i * half, axis=-1, keepdims=True), -1, 1)
    difference = w_i - cos_d * half  # across the half vector
    tilt = np.array([0.0, 0.0, 1.0]) - half[..., 2:] * half  # the normal, across it too
    sizes = np.linalg.norm(difference, axis=-1) * np.linalg.norm(tilt, axis=-1)
    along = np.where(sizes > 1e-12, np.abs(np.sum(difference * tilt, axis=-1)) / np.maximum(sizes, 1e-12), 1.0)
    cosines = np.stack([half[..., 2], cos_d[..., 0], along], axis=-1)
    return np.degrees(np.arccos(np.clip(cosines, -1, 1)))
