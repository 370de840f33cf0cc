"""gamma straight from the measured curve, without a fit of the model (guo2023, section 2.1 and eq 7)."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.dataset import is_in_plane, points, sets, signed_theta_r

Values = npt.NDArray[np.float64]
NEAR_NORMAL = 5.0  # deg: the peak is the top of a parabola about the normal through the points this close to it
NEAR_CROSSING = 5.0  # deg: the crossing is read from a straight line through the points this close to it
ONE_ANGLE = 1e-6  # deg: points no farther apart than this give no parabola
NARROWEST, WIDEST = 1.0, 720.0  # deg: range of half widths when the floor is estimated


class Reading(StrEnum):
    """Whether a half width could be read; the values are the messages."""

    READ = "read from the curve"
    NEVER_HALF = "the curve never falls to half inside the scan"
    NO_FAR_SIDE = "no backscatter side from the normal outwards"
    NO_LOBE = "no lobe above the uniform floor"


@dataclass(frozen=True)
class HalfWidth:
    """The directional-diffuse lobe of one curve: half width at half maximum [deg], its uncertainty, peak and floor."""

    curve: str
    theta_i: float
    gamma: float
    uncertainty: float
    peak: float
    floor: float
    status: Reading


def half_widths(scan: xr.Dataset, floor: float | None = None) -> list[HalfWidth]:
    """The half width of every curve, on its backscatter side, where no specular lobe covers it.

    The uniform part is removed first: `floor` [unit of the BRDF], or where None the constant of a Lorentz curve plus a
    constant fitted to the far side. Only the floor is taken from that fit; the half width is read from the data.
    The uncertainty is that of the curve's scatter about the crossing; it does not hold the floor's own.
    """
    return [_read(name, theta_i, t, f, floor) for name, theta_i, t, f in _far_sides(points(scan))]


def widest_angle(readings: list[HalfWidth]) -> HalfWidth | None:
    """The reading at the largest incidence angle, where the specular lobe is farthest; None when nothing was read."""
    good = [reading for reading in readings if reading.status is Reading.READ]
    return max(good, key=lambda reading: reading.theta_i, default=None)


def _far_sides(flat: xr.Dataset) -> Iterator[tuple[str, float, Values, Values]]:
    """Name, theta_i, angle from the normal [deg] and BRDF of the backscatter side of every in-plane curve."""
    flat = flat.isel(direction=np.flatnonzero(is_in_plane(flat)))
    keys = ["theta_i", *sets(flat)]
    columns = [flat[key].values for key in keys]
    signed = signed_theta_r(flat)
    for row in sorted(set(zip(*(c.tolist() for c in columns), strict=True))):
        here = np.all([c == v for c, v in zip(columns, row, strict=True)], axis=0) & (signed <= 0)
        order = np.argsort(-signed[here])
        name = ", ".join(f"{k} {v:g}" if isinstance(v, float) else f"{k} {v}" for k, v in zip(keys, row, strict=True))
        yield name, row[0], -signed[here][order], flat["brdf"].values[here][order]


def _read(name: str, theta_i: float, t: Values, f: Values, floor: float | None) -> HalfWidth:
    # In units of a power of two near the largest value, which changes no digit: squares of values cannot overflow then,
    # and the tolerance of the non-negative least squares, which is absolute, means the same for every scan.
    unit = 2.0 ** min(math.frexp(float(np.max(np.abs(f), initial=0.0)))[1], 1023)  # 2^1024 is beyond a double
    f = np.asarray(f, dtype=float) / unit  # single precision would not hold the unit of its largest values

    def failed(status: Reading, peak: float = math.nan, used: float = math.nan) -> HalfWidth:
        return HalfWidth(name, theta_i, math.nan, math.nan, peak * unit, used * unit, status)

    near = t <= NEAR_NORMAL
    if near.sum() < 2 or np.ptp(t[near]) < ONE_ANGLE or len(t) < 5 or t[-1] < 2 * NEAR_NORMAL:
        return failed(Reading.NO_FAR_SIDE)
    used = _floor(t, f) if floor is None else floor / unit
    peak = float(np.polyfit(t[near] ** 2, f[near], 1)[1]) - used
    if not peak > 0:
        return failed(Reading.NO_LOBE, peak, used)
    below = np.flatnonzero(f - used < peak / 2)
    if not below.size:
        return failed(Reading.NEVER_HALF, peak, used)
    around = np.abs(t - t[below[0]]) <= max(NEAR_CROSSING, 2.5 * float(np.max(np.diff(t))))
    slope, offset, scatter = _line(t[around], f[around] - used - peak / 2)
    gamma = -offset / slope if slope < 0 else math.nan
    if not 0 < gamma <= t[-1]:
        return failed(Reading.NEVER_HALF, peak, used)
    spread = scatter / abs(slope) * math.sqrt(1 / around.sum() + 1 / (4 * near.sum()))
    return HalfWidth(name, theta_i, gamma, spread, peak * unit, used * unit, Reading.READ)


def _line(x: Values, y: Values) -> tuple[float, float, float]:
    """Slope and offset of the straight line through points, and the standard deviation of the points about it."""
    slope, offset = np.polyfit(x, y, 1).tolist()
    residual = y - np.polyval([slope, offset], x)
    return slope, offset, math.sqrt(float(np.sum(residual**2)) / max(len(residual) - 2, 1))


def _floor(t: Values, f: Values) -> float:
    """The constant of the best Lorentz curve plus constant, neither negative."""
    from scipy.optimize import minimize_scalar, nnls  # late: half a second that who only looks does not need

    def weights(log_gamma: float) -> tuple[Values, float]:
        lobe = 1 / (1 + (t / math.exp(log_gamma)) ** 2)
        found, residual = nnls(np.column_stack([lobe, np.ones_like(t)]), f)
        return found, float(residual)

    bounds = (math.log(NARROWEST), math.log(WIDEST))
    best = minimize_scalar(lambda x: weights(x)[1], bounds=bounds, method="bounded", options={"xatol": 1e-6})
    return float(weights(best.x)[0][1])
