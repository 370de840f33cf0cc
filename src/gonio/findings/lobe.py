"""The width of the measured lobe: peak, where it lies, and how far from it the curve falls to half.

    half width = (theta_upper - theta_lower)/2,   f(theta_lower) = f(theta_upper) = f(peak)/2

The height of the peak and the angles of half height are read from parabolas through three values of ln f, which a
Gaussian lobe is exactly; where a value is not positive they are read from straight lines.
"""

import math
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.findings.curves import Curve, curves, reflected

Values = npt.NDArray[np.float64]

HIGHEST = 0.5  # of ln f: a top farther above the largest value was not measured, and the value stands for it


class Width(StrEnum):
    """What the width of a lobe was read from; the values are the messages."""

    BOTH = "both sides"
    TO_NORMAL = "the lower side alone: the scan ends before the upper one falls to half"
    FROM_NORMAL = "the upper side alone: the scan ends before the lower one falls to half"
    NEVER = "the curve never falls to half inside the scan"
    AT_END = "the largest value lies at an end of the scan"
    NO_LOBE = "no positive value, or too few"


@dataclass(frozen=True)
class Lobe:
    """The lobe of one curve: its largest value [unit of the BRDF], where that lies, and its half width [deg].

    lower, upper: how far from the peak the curve falls to half towards smaller and larger theta_r [deg], NaN where it
    does not within the scan. half_width: their mean, or the one that there is.
    """

    curve: str
    theta_i: float
    peak: float
    theta_r: float
    half_width: float
    lower: float
    upper: float
    status: Width


def lobes(scan: xr.Dataset) -> list[Lobe]:
    """The lobe of every in-plane curve of a scan, of light that was reflected, by set and incidence angle."""
    return [lobe_of(curve) for curve in curves(reflected(scan))]


def lobe_of(curve: Curve) -> Lobe:
    """The lobe about the largest value of a curve."""
    t, f = curve.theta_r, curve.values
    if len(t) < 3 or not f.max() > 0:
        return Lobe(curve.name, curve.theta_i, math.nan, math.nan, math.nan, math.nan, math.nan, Width.NO_LOBE)
    tied = np.flatnonzero(f == f.max())
    k = int(tied[len(tied) // 2]) if len(tied) == np.ptp(tied) + 1 else int(tied[0])  # the middle of a plateau
    if k in (0, len(t) - 1):
        return Lobe(curve.name, curve.theta_i, float(f[k]), float(t[k]), math.nan, math.nan, math.nan, Width.AT_END)
    top, peak = _top(t[k - 1 : k + 2], f[k - 1 : k + 2])
    lower, upper = (top - _crossing(t[k::-1], f[k::-1], peak / 2), _crossing(t[k:], f[k:], peak / 2) - top)
    sides = [side for side in (lower, upper) if side == side]
    status = {2: Width.BOTH, 0: Width.NEVER}.get(len(sides), Width.TO_NORMAL if lower == lower else Width.FROM_NORMAL)
    half = sum(sides) / len(sides) if sides else math.nan
    return Lobe(curve.name, curve.theta_i, peak, top, half, lower, upper, status)


def _top(t: Values, f: Values) -> tuple[float, float]:
    """Where the parabola through three values of ln f is largest, and exp of it there; the middle one where f <= 0."""
    if f.min() > 0:
        bend, slope, middle = np.polyfit(t - t[1], np.log(f) - np.log(f[1]), 2).tolist()
        place = -slope / (2 * bend) if bend < 0 else math.inf
        rise = middle + slope * place / 2
        if t[0] - t[1] <= place <= t[2] - t[1] and rise < HIGHEST:
            return float(t[1] + place), float(f[1] * math.exp(rise))
    return float(t[1]), float(f[1])


def _crossing(t: Values, f: Values, half: float) -> float:
    """Where values that begin at the peak first fall to `half`; NaN where they do not."""
    below = np.flatnonzero(f < half)
    if not below.size:
        return math.nan
    k = int(below[0])
    a, b = k - 1, k
    linear = float(t[a] + (t[b] - t[a]) * (f[a] - half) / (f[a] - f[b]))
    inner = [a - 1, a, b] if a else [a, b, b + 1]
    if inner[-1] >= len(t) or f[inner].min() <= 0:
        return linear
    roots = np.roots(np.polyfit(t[inner] - t[a], np.log(f[inner]) - np.log(half), 2))
    inside = [
        r.real + t[a] for r in roots if abs(r.imag) < 1e-9 and min(t[a], t[b]) <= r.real + t[a] <= max(t[a], t[b])
    ]
    return float(inside[0]) if inside else linear
