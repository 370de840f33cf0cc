"""The directions among which readings are chosen: those that a goniometer can reach, and the beam does not block."""

import re
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.dataset import SETS, make_scan, signed_theta_r, unit

Values = npt.NDArray[np.float64]

STEP = 1.0  # deg
MOST = 20_000  # directions: more take minutes, and neighbours hardly differ
STEEPEST = 89.0  # deg: at the horizon no reading is one
ROUNDING = 1e-6  # deg
IN_PLANE = (0.0, 180.0)


def reachable(
    scan: xr.Dataset,
    theta_i: Sequence[float] = (),
    theta_r: tuple[float, float] | None = None,
    step: float = STEP,
    blocked: float = 0.0,
) -> xr.Dataset:
    """The directions of a grid, as a flat scan without values.

    theta_i: incidence angles [deg]; without any those of the scan. theta_r: least and greatest [deg], signed in plane,
    positive on the forward side; without them those of the scan. Azimuths are those of the scan: a scan that has
    others than 0 and 180 deg is taken to reach theta_r from 0 to the greatest of either sign at each. step [deg]: of
    theta_r. blocked [deg]: directions nearer than this to the incident beam are left out.
    Raises ValueError for more than MOST directions.
    """
    incidence = np.array(sorted(theta_i)) if len(theta_i) else np.unique(np.round(scan["theta_i"].values, 6))
    planes = np.unique(np.round(scan["phi"].values % 360.0, 6))
    flat = bool(np.isin(planes, IN_PLANE).all())
    if theta_r is None:
        reached = signed_theta_r(scan) if flat else scan["theta_r"].values
        theta_r = float(reached.min()), float(reached.max())
    low, high = (max(theta_r[0], -STEEPEST), min(theta_r[1], STEEPEST))
    steps = low + step * np.arange(int(np.floor((high - low) / step + 1e-9)) + 1)
    turned = np.unique(scan["phi_i"].values) if "phi_i" in scan.coords else np.zeros(1)
    if flat:
        i, r, t = (a.ravel() for a in np.meshgrid(incidence, steps, turned, indexing="ij"))
        phi = np.where(r >= 0, 180.0, 0.0)
    else:
        i, r, phi, t = (
            a.ravel() for a in np.meshgrid(incidence, np.unique(np.abs(steps)), planes, turned, indexing="ij")
        )
    if len(i) > MOST:
        raise ValueError(
            f"{len(i)} directions are more than the {MOST} to choose from: give a larger --every, or --theta-i"
        )
    kept = beam_angle(i, np.abs(r), phi) >= blocked - ROUNDING
    return _as_scan(scan, i[kept], np.abs(r[kept]), phi[kept], t[kept])


def beam_angle(theta_i: Values, theta_r: Values, phi: Values) -> Values:
    """The angle [deg] between the direction of the detector and that of the source, at angles [deg]."""
    i, r, azimuth = np.radians(theta_i), np.radians(theta_r), np.radians(phi)
    return np.asarray(
        np.degrees(np.arccos(np.clip(np.cos(i) * np.cos(r) + np.sin(i) * np.sin(r) * np.cos(azimuth), -1, 1)))
    )


def nearest_to_beam(scan: xr.Dataset) -> float:
    """How near the incident beam [deg] the values in use of a flat scan go: nearer the detector may block it."""
    return float(beam_angle(*(scan[n].values for n in ("theta_i", "theta_r", "phi"))).min())


def coarse(directions: xr.Dataset, points: int) -> npt.NDArray[np.intp]:
    """Places of so many directions spread evenly over all of them, in the order that these have."""
    return np.unique(np.round(np.linspace(0, directions.sizes["direction"] - 1, points)).astype(np.intp))


def parsed_range(text: str) -> tuple[float, float]:
    """`-80:80` as least and greatest theta_r [deg]; ValueError for other text, or for angles beyond the horizon."""
    found = re.fullmatch(r"\s*([-+]?[\d.]+)\s*:\s*([-+]?[\d.]+)\s*", text)
    try:
        low, high = (float(part) for part in found.groups()) if found else (1.0, 0.0)
    except ValueError:
        low, high = 1.0, 0.0
    if not -90 <= low < high <= 90:
        raise ValueError(f"--theta-r {text!r} is not a range from -90 to 90 deg: write -80:80")
    return low, high


def _as_scan(scan: xr.Dataset, theta_i: Values, theta_r: Values, phi: Values, phi_i: Values) -> xr.Dataset:
    """Directions as a flat scan of no values, with what the scan says of all its points, such as a wavelength."""
    said = {n: np.full(len(theta_i), scan[n].values.ravel()[0]) for n in SETS if n in scan.coords}
    none = np.full(len(theta_i), np.nan)
    turned = phi_i if "phi_i" in scan.coords else None
    return make_scan(theta_i, theta_r, none, phi, phi_i=turned, unit=unit(scan), coordinates=said)
