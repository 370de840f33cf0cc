"""Where a goniometer counts its angles from: a tilted sample, the zeros of arm and table."""

import math

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]


def tilted(
    theta_i: npt.ArrayLike, theta_r: npt.ArrayLike, phi: npt.ArrayLike, along: float, across: float = 0.0
) -> tuple[Values, Values, Values]:
    """theta_i, theta_r, phi [deg] to the normal of a tilted sample, from those to the axis of the goniometer.

    along, across [deg]: the normal is (sin e_x cos e_y, sin e_y, cos e_x cos e_y), e_x positive towards the forward
    side. In plane theta_i becomes theta_i + e_x, and the signed theta_r becomes theta_r - e_x.
    """
    e_x, e_y = math.radians(along), math.radians(across)
    normal = np.array([math.sin(e_x) * math.cos(e_y), math.sin(e_y), math.cos(e_x) * math.cos(e_y)])
    incident = _direction(theta_i, np.full(np.shape(theta_i), 180.0))
    scattered = _direction(theta_r, 180.0 - np.asarray(phi, dtype=float))
    cos_i, cos_r = incident @ normal, scattered @ normal
    flat_i, flat_r = incident - cos_i[..., None] * normal, scattered - cos_r[..., None] * normal
    new_i, new_r = (_angle(length, cos) for length, cos in ((flat_i, cos_i), (flat_r, cos_r)))
    lengths = np.linalg.norm(flat_i, axis=-1) * np.linalg.norm(flat_r, axis=-1)
    crossed = np.linalg.norm(np.cross(flat_i, flat_r), axis=-1)
    between = np.degrees(np.arctan2(crossed, (flat_i * flat_r).sum(axis=-1)))
    return new_i, new_r, np.where(lengths > 1e-18, between, np.asarray(phi, dtype=float))


def _direction(theta: npt.ArrayLike, azimuth: npt.ArrayLike) -> Values:
    polar, around = np.radians(np.asarray(theta, float)), np.radians(np.asarray(azimuth, float))
    return np.stack([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)], axis=-1)


def _angle(flat: Values, cosine: Values) -> Values:
    return np.degrees(np.arctan2(np.linalg.norm(flat, axis=-1), cosine))


def moved_arm(theta_r: npt.ArrayLike, phi: npt.ArrayLike, zero: float) -> tuple[Values, Values]:
    """theta_r and phi [deg] where the arm, which moves in the plane of incidence, counts from `zero` [deg].

    Raises ValueError for directions out of the plane.
    """
    theta_r, phi = np.asarray(theta_r, dtype=float), np.asarray(phi, dtype=float)
    if not zero:
        return theta_r, phi
    if not np.isclose(np.abs((phi + 90) % 180 - 90), 0).all():
        raise ValueError("a zero of the arm is known in the plane of incidence alone: correct the angles of the others")
    signed = np.where(np.isclose(phi % 360.0, 180.0), theta_r, -theta_r) - zero
    return np.abs(signed), np.where(signed >= 0, 180.0, 0.0)


def zero_of_mirror(theta_i: npt.ArrayLike, peak: npt.ArrayLike) -> tuple[float, float]:
    """How far mirror peaks [deg] lie from theta_i [deg] on average, and the standard uncertainty of that mean.

    Half of it is the tilt e_x of the sample, or all of it the zero of the arm, or any mixture of these: peaks alone
    do not tell them apart.
    """
    offset = np.asarray(peak, dtype=float) - np.asarray(theta_i, dtype=float)
    if offset.ndim != 1 or len(offset) < 2:
        raise ValueError("give the mirror peak at two incidence angles or more")
    return float(offset.mean()), float(offset.std(ddof=1) / np.sqrt(len(offset)))
