"""ALTA's parametrisations: the coordinates in which its files give two directions, and their conversion to angles.

V is the direction of view, L that of the light and H the half vector; angles are in radians. ALTA's difference vector
is V in the frame of H. Its azimuth differences are phi_L - phi_V, except the projected ones, which are phi_V - phi_L.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gonio.measured import coordinates
from gonio.measured.dataset import HORIZON

Values = npt.NDArray[np.float64]

DIGITS = 10  # of an angle in degrees: radians with 15 digits are no more precise
FURTHEST = 4 * np.pi  # rad; a larger angle was probably meant in degrees
UNIT_LENGTH = 1e-3  # the deviation from 1 that the length of a vector may have


@dataclass(frozen=True)
class Parametrisation:
    """One parametrisation: the number of its coordinates, and the function from rows (n, size) of these to angles.

    `directions` returns theta_i, theta_r, phi and phi_i [deg]. `turns`: the coordinates give the azimuth phi_i of the
    light. `dips`: on a grid of the coordinates some points lie below the horizon. `assumes`: a line for the history on
    what the coordinates leave open.
    """

    size: int
    directions: Callable[[Values], coordinates.Angles]
    turns: bool = False
    dips: bool = False
    assumes: str = ""


def _spherical(x: Values) -> coordinates.Angles:
    theta_l, phi_l, theta_v, phi_v = np.degrees(x).T
    return theta_l, theta_v, phi_v - phi_l, phi_l


def _by_difference(x: Values) -> coordinates.Angles:
    theta_v, theta_l, difference = np.degrees(x).T
    return theta_l, theta_v, -difference, coordinates.ZERO


def _projected(x: Values) -> coordinates.Angles:
    """theta_L (0 where there are two coordinates), then theta_V times cosine and sine of the azimuth difference."""
    theta_l = x[:, 0] if x.shape[1] == 3 else np.zeros(len(x))
    a, b = x[:, -2], x[:, -1]
    return np.degrees(theta_l), np.degrees(np.hypot(a, b)), np.degrees(np.arctan2(b, a)), coordinates.ZERO


def _half_difference(x: Values) -> coordinates.Angles:
    """theta_H, phi_H, theta_D and phi_D, with V in the place of gonio's incident light."""
    theta_h, phi_h, theta_d, phi_d = np.degrees(x).T
    system = coordinates.SYSTEMS["half-difference"]
    theta_v, theta_l, phi, phi_v = system.directions(theta_h, theta_d, phi_d, phi_h)
    return theta_l, theta_v, -phi, phi_v + phi


def _isotropic(x: Values) -> coordinates.Angles:
    theta_h, theta_d, phi_d = x.T
    return _half_difference(np.column_stack([theta_h, np.zeros(len(x)), theta_d, phi_d]))


def _sideways(x: Values) -> coordinates.Angles:
    return _isotropic(np.column_stack([x, np.full(len(x), np.pi / 2)]))


def _cosines(x: Values) -> coordinates.Angles:
    return _sideways(np.arccos(np.clip(x, -1, 1)))


def _cartesian(x: Values) -> coordinates.Angles:
    """The components of the vector V, then those of L."""
    polar = [np.degrees(np.arctan2(np.hypot(v[0], v[1]), v[2])) for v in (x[:, :3].T, x[:, 3:].T)]
    azimuth = [np.degrees(np.arctan2(v[1], v[0])) for v in (x[:, :3].T, x[:, 3:].T)]
    return polar[1], polar[0], azimuth[0] - azimuth[1], azimuth[1]


_NO_PHI_D = "took phi_d as 90 deg, which the file does not give"
PARAMETRISATIONS = {
    "SPHERICAL_TL_PL_TV_PV": Parametrisation(4, _spherical, turns=True),
    "ISOTROPIC_TV_TL_DPHI": Parametrisation(3, _by_difference),
    "ISOTROPIC_TL_TV_PROJ_DPHI": Parametrisation(3, _projected, dips=True),
    "ISOTROPIC_TV_PROJ_DPHI": Parametrisation(2, _projected, dips=True),
    "RUSIN_TH_PH_TD_PD": Parametrisation(4, _half_difference, turns=True, dips=True),
    "RUSIN_TH_TD_PD": Parametrisation(3, _isotropic, dips=True),
    "RUSIN_TH_TD": Parametrisation(2, _sideways, assumes=_NO_PHI_D),
    "COS_TH_TD": Parametrisation(2, _cosines, assumes=_NO_PHI_D),
    "CARTESIAN": Parametrisation(6, _cartesian, turns=True),
}


def impossible(name: str, x: Values) -> npt.NDArray[np.bool_]:
    """Which rows cannot be unit vectors, cosines or angles in radians, whichever the parametrisation `name` has."""
    with np.errstate(over="ignore"):  # an overflow is infinite, and impossible too
        if name == "CARTESIAN":
            lengths = [np.hypot(np.hypot(v[:, 0], v[:, 1]), v[:, 2]) for v in (x[:, :3], x[:, 3:])]
            most_wrong = np.abs(np.array(lengths) - 1).max(axis=0) / UNIT_LENGTH
        else:
            most_wrong = np.abs(x).max(axis=1) / (1.0 if name.startswith("COS_") else FURTHEST)
    wrong: npt.NDArray[np.bool_] = most_wrong > 1
    return wrong


def angles(parametrisation: Parametrisation, x: Values) -> tuple[Values, Values, Values, Values]:
    """theta_i, theta_r, phi and phi_i [deg] of rows of coordinates (n, size), rounded to DIGITS.

    Polar angles are not negative; one beyond 90 deg is below the horizon.
    """
    directions = np.broadcast_arrays(*parametrisation.directions(x))
    theta_i, theta_r, phi, phi_i = (np.round(np.asarray(a, dtype=float), DIGITS) for a in directions)
    other_side = np.where(theta_i < 0, 180.0, 0.0)  # of the normal, where a negative polar angle is
    phi, phi_i = phi + other_side + np.where(theta_r < 0, 180.0, 0.0), phi_i + other_side
    theta_i, theta_r = (_at_horizon(np.abs(a)) for a in (theta_i, theta_r))
    return theta_i, theta_r, _round_about(phi), _round_about(phi_i)


def _at_horizon(theta: Values) -> Values:
    return np.where(theta <= HORIZON, np.minimum(theta, 90.0), theta)


def _round_about(azimuth: Values) -> Values:
    wrapped: Values = np.round(azimuth % 360.0, DIGITS) % 360.0
    return wrapped
