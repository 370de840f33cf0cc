"""Vectors over time, and the satellite's frame in which an observer on the ground sees sun and satellite."""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]

EARTH_RADIUS = 6.378e6  # m, at the equator


class Sight(NamedTuple):
    """Where sun, observer and Earth are, in the frame of a body, each (times, 3).

    sun: towards the sun, a unit vector. observer: from the body to the observer [m]. position: from the centre of the
    Earth to the body [m].
    """

    sun: Values
    observer: Values
    position: Values


def from_horizon(sun_altitude: Any, sun_azimuth: Any, altitude: Any, azimuth: Any, height: Any) -> Sight:
    """What an observer on the ground sees, in the frame of the satellite: z to its zenith, y to the sun's side.

    The x axis is y cross z. So (0, 0, -1) is a surface that faces the nadir, and (0, 1, 0) one that is upright and
    turned to the sun. The Earth is a sphere (EARTH_RADIUS), and the observer is at sea level; refraction is left out.

    Parameters
    ----------
    sun_altitude, sun_azimuth : float or array_like (times,)
        Of the sun [deg]: above the observer's horizon, where it may be below 0, and from the north through the east.
    altitude, azimuth : float or array_like (times,)
        Of the satellite [deg].
    height : float or array_like (times,)
        Of the satellite above the ground [m].

    Returns
    -------
    Sight
        Vectors (times, 3).

    Raises
    ------
    ValueError
        The satellite is below the horizon or on the ground, or the sun is at its zenith or nadir, where it has no side.

    """
    given = np.broadcast_arrays(
        *(np.atleast_1d(np.asarray(v, dtype=float)) for v in (sun_altitude, sun_azimuth, altitude, azimuth, height))
    )
    if not all(np.isfinite(one).all() for one in given):
        raise ValueError("an angle or a height is no finite number")
    sun, towards = _direction(*given[:2]), _direction(*given[2:4])
    above, h = given[2], given[4]
    if not ((above >= 0) & (h > 0)).all():
        raise ValueError("the satellite is below the horizon or on the ground: altitude from 0 deg, height above 0 m")
    sine = towards[:, 2]
    distance = np.sqrt((EARTH_RADIUS * sine) ** 2 + h * (2 * EARTH_RADIUS + h)) - EARTH_RADIUS * sine
    centre = distance[:, None] * towards + np.array([0.0, 0.0, EARTH_RADIUS])
    zenith = unit(centre, "the satellite")
    side = sun - dot(sun, zenith)[:, None] * zenith
    if (np.linalg.norm(side, axis=1) < 1e-9).any():
        raise ValueError("the sun is at the satellite's zenith or nadir, and has no side there: give vectors instead")
    y = unit(side, "the sun's side")
    axes = np.stack([np.cross(y, zenith), y, zenith], axis=1)
    turned = [np.einsum("tij,tj->ti", axes, v) for v in (sun, -distance[:, None] * towards, centre)]
    return Sight(*turned)


def _direction(altitude: Values, azimuth: Values) -> Values:
    """East, north and up of directions (times, 3)."""
    a, z = np.radians(altitude), np.radians(azimuth)
    return np.stack([np.cos(a) * np.sin(z), np.cos(a) * np.cos(z), np.sin(a)], axis=-1)


def vectors(given: Any, what: str) -> Values:
    """Vectors (times, 3), or (1, 3) of one; ValueError for another shape, and for what is no finite vector but 0."""
    found = np.asarray(given, dtype=float)
    if found.ndim not in (1, 2) or found.shape[-1] != 3:
        raise ValueError(f"{what} has the shape {found.shape}: give a vector of three, or (times, 3)")
    found = np.atleast_2d(found)
    if not np.isfinite(found).all() or not (np.linalg.norm(found, axis=1) > 0).all():
        raise ValueError(f"{what} is a vector without a direction: give three finite numbers that are not all 0")
    return found


def unit(given: Any, what: str) -> Values:
    """Unit vectors (times, 3); ValueError as `vectors` raises it."""
    found = vectors(given, what)
    return np.asarray(found / np.linalg.norm(found, axis=1, keepdims=True))


def dot(a: Values, b: Values) -> Values:
    """The products (..) of vectors (.., 3)."""
    return np.einsum("...i,...i->...", a, b)
