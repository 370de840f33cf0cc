"""The coordinates in which files lay out their grids, each with the way to directions and back.

All angles are in degrees and all arrays broadcast. Azimuths run from 0 to 360. Directions are theta_i, theta_r, phi =
phi_r - phi_i and phi_i, the azimuth of the incident light from the surface's x axis (geometry.py).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

Array = npt.NDArray[np.float64]
Angles = tuple[Array, Array, Array, Array]  # theta_i, theta_r, phi, phi_i


@dataclass(frozen=True)
class System:
    """One set of coordinates: the names of its axes, those that are azimuths, and the ways to directions and back.

    The last axis is the one that turns the pair of directions about the normal, which an isotropic surface ignores:
    `directions` takes it or not, and `axes_of` always gives it.
    """

    name: str
    axes: tuple[str, str, str, str]
    azimuths: tuple[str, ...]
    directions: Callable[..., Angles]
    axes_of: Callable[[Array, Array, Array, Array], tuple[Array, Array, Array, Array]]


ZERO = np.zeros(())
SNAP = 1e-9  # deg
SAME = 1e-6  # deg; angles nearer than this are the same
WIDEST_AZIMUTH = 45.0  # deg; azimuths further apart are no neighbours


def _unit(theta: Array, phi: Array) -> Array:
    """Unit vectors (..., 3) of polar angles [deg]."""
    t, p = np.broadcast_arrays(np.radians(theta), np.radians(phi))
    return np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1)


def _polar(w: Array) -> tuple[Array, Array]:
    """Polar angle and azimuth [deg] of vectors (..., 3)."""
    theta = np.degrees(np.arctan2(np.hypot(w[..., 0], w[..., 1]), w[..., 2]))
    return theta, np.degrees(np.arctan2(w[..., 1], w[..., 0])) % 360.0


def _turned(w: Array, angle: Array, axis: int) -> Array:
    """Vectors turned about the y (1) or z (2) axis by `angle` [deg]."""
    c, s = np.cos(np.radians(angle)), np.sin(np.radians(angle))
    x, y, z = w[..., 0], w[..., 1], w[..., 2]
    turned = (c * x + s * z, y, c * z - s * x) if axis == 1 else (c * x - s * y, s * x + c * y, z)
    return np.stack(np.broadcast_arrays(*turned), axis=-1)


def _spherical(theta_i: Array, theta_r: Array, phi: Array, phi_i: Array = ZERO) -> Angles:
    return theta_i, theta_r, phi, phi_i


def _from_half(theta_h: Array, theta_d: Array, phi_d: Array, phi_h: Array = ZERO) -> Angles:
    """Rusinkiewicz's half-difference angles (rusinkiewicz1998): the half vector, and w_i about it."""
    difference = _unit(theta_d, phi_d)
    half = _unit(theta_h, phi_h)
    incident = _turned(_turned(difference, theta_h, 1), phi_h, 2)
    reflected = 2 * np.sum(incident * half, axis=-1, keepdims=True) * half - incident
    (theta_i, phi_i), (theta_r, phi_r) = _polar(incident), _polar(reflected)
    return theta_i, theta_r, (phi_r - phi_i) % 360.0, phi_i


def _to_half(theta_i: Array, theta_r: Array, phi: Array, phi_i: Array = ZERO) -> Angles:
    incident, reflected = _unit(theta_i, phi_i), _unit(theta_r, phi_i + phi)
    theta_h, phi_h = _polar(incident + reflected)
    theta_d, phi_d = _polar(_turned(_turned(incident, -phi_h, 2), -theta_h, 1))
    return theta_h, theta_d, phi_d, phi_h


def _from_specular(theta_i: Array, theta_s: Array, phi_s: Array, phi_i: Array = ZERO) -> Angles:
    """Polar angle and azimuth about the mirror direction; azimuth 0 leads from it towards the normal.

    At phi_s = 90 deg w_r lies where phi = phi_r - phi_i is below 180 deg.
    """
    # With the mirror direction along +x of the plane of incidence: towards the normal is -x of the turned frame.
    about = _unit(theta_s, 180.0 - np.asarray(phi_s))
    theta_r, from_mirror = _polar(_turned(about, theta_i, 1))
    phi = (180.0 - from_mirror) % 360.0
    return theta_i, theta_r, phi, phi_i


def _to_specular(theta_i: Array, theta_r: Array, phi: Array, phi_i: Array = ZERO) -> Angles:
    about = _turned(_unit(theta_r, 180.0 - np.asarray(phi)), -np.asarray(theta_i), 1)
    theta_s, turned = _polar(about)
    return theta_i, theta_s, (180.0 - turned) % 360.0, phi_i


SYSTEMS = {
    system.name: system
    for system in (
        System("spherical", ("theta_i", "theta_r", "phi", "phi_i"), ("phi", "phi_i"), _spherical, _spherical),
        System("half-difference", ("theta_h", "theta_d", "phi_d", "phi_h"), ("phi_d", "phi_h"), _from_half, _to_half),
        System("specular", ("theta_i", "theta_s", "phi_s", "phi_i"), ("phi_s", "phi_i"), _from_specular, _to_specular),
    )
}


def grid(system: str, **axes: Any) -> xr.Dataset:
    """The directions of a grid: a Dataset of the coordinates theta_i, theta_r, phi and, where it is given, phi_i [deg].

    `axes` are the values of the system's axes in the order of the dimensions; the last may be left out. Dimensions have
    the axes' names. Nodes whose theta_r is beyond 90 deg lie below the horizon: no value belongs there.
    """
    chosen = SYSTEMS[system]
    shape = np.ix_(*(np.asarray(v, dtype=float) for v in axes.values()))
    by_name = dict(zip(axes, shape, strict=True))
    found = chosen.directions(*(by_name[a] for a in chosen.axes if a in by_name))
    turning = chosen.axes[-1]
    names = ("theta_i", "theta_r", "phi", *(["phi_i"] if turning in axes else []))
    dims = tuple(axes)
    own = {a: (a, np.asarray(v, dtype=float), {"units": "degree"}) for a, v in axes.items()}
    full = tuple(len(np.asarray(v)) for v in axes.values())
    angles = {
        n: (dims, _snapped(np.broadcast_to(v, full)), {"units": "degree"})
        for n, v in zip(("theta_i", "theta_r", "phi", "phi_i"), found, strict=True)
        if n in names and n not in own
    }
    return xr.Dataset(coords=own | angles)


def _snapped(angles: Array) -> Array:
    """Angles that rounding moved off the normal or the horizon, put back there."""
    out = np.where(np.abs(angles - 90.0) < SNAP, 90.0, angles)
    return np.where(np.abs(out) < SNAP, 0.0, out)


def system_of(scan: xr.Dataset) -> System | None:
    """The system whose axes a dense scan's dimensions are, None for scattered directions."""
    dims = set(scan["brdf"].dims) if "brdf" in scan else set(scan.dims)
    return next((s for s in SYSTEMS.values() if set(s.axes[:3]) <= dims), None)
