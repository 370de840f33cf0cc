"""Structure function and autocovariance of a height map, from pairs of points that were both measured.

The structure function D(r) = mean (z(x + r) - z(x))^2 needs no mean and no stationary height, and is what scattered
light depends on. Where the heights have a variance, D = 2 (Sq^2 - R) with the autocovariance R.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.fft import irfft2, next_fast_len, rfft2
from scipy.integrate import simpson
from scipy.interpolate import PchipInterpolator, RegularGridInterpolator
from scipy.optimize import brentq
from scipy.special import j0

from gonio.topography.heights import Values, pitch, values

FEW_PAIRS = 4  # pairs of points below which a lag is left out
SINGLE = 6.0  # pixels up to which every distance has a value of its own; beyond they are averaged in rings
DIRECTIONS = 180  # in which the autocovariance is followed for Sal and Str
FALLEN = 0.2  # of the variance, ISO 25178-2


class Lags(NamedTuple):
    """Structure function and number of pairs over the lags (y, x), both from -half to half a side; lags in um."""

    x: Values
    y: Values
    squared: Values
    pairs: Values
    variance: float


@dataclass(frozen=True)
class Structure:
    """The structure function of a surface over distance, as the prediction of scatter takes it.

    of: D [um^2] at distances [um] >= 0, up to `reach` [um], beyond which it is twice the variance [um^2].
    scale: a distance [um] over which D changes little, which sets the steps of integrals. tapered: whether what differs
    from the plateau is brought to zero over the outer half of the reach, as an estimate from one map needs it.
    """

    of: Callable[[Values], Values]
    variance: float
    reach: float
    scale: float
    tapered: bool = False

    @property
    def rms(self) -> float:
        """The rms height [um]."""
        return math.sqrt(self.variance)


def gaussian_structure(rms: float, length: float) -> Structure:
    """The structure function of Gaussian autocovariance, 2 rms^2 (1 - exp(-(r/length)^2)); both in um."""
    return Structure(lambda r: -2 * rms**2 * np.expm1(-((r / length) ** 2)), rms**2, 12 * length, length / 4)


def exponential_structure(rms: float, length: float) -> Structure:
    """The structure function of exponential autocovariance, 2 rms^2 (1 - exp(-r/length)); both in um."""
    return Structure(lambda r: -2 * rms**2 * np.expm1(-r / length), rms**2, 40 * length, length / 4)


def lags(heights: xr.Dataset) -> Lags:
    """The structure function over all lags up to half the sides, of a map of any missing points.

    With z and its mask m it is, over the pairs at each lag, (z^2 * m + m * z^2 - 2 z * z)/(m * m), where * is the
    correlation, by FFTs that are padded so that nothing wraps around.
    """
    z = values(heights)
    used = np.isfinite(z)
    z = np.where(used, z - z[used].mean(), 0.0)
    half = [n // 2 for n in z.shape]
    shape = [next_fast_len(n + h, real=True) for n, h in zip(z.shape, half, strict=True)]
    f_z, f_squared, f_mask = (rfft2(part, shape) for part in (z, z * z, used.astype(float)))

    def correlated(one: np.ndarray, other: np.ndarray) -> Values:
        whole = irfft2(np.conj(one) * other, shape)
        rows, columns = (np.arange(-h, h + 1) for h in half)
        return np.asarray(whole[np.ix_(rows, columns)])

    pairs = np.rint(correlated(f_mask, f_mask))
    total = correlated(f_squared, f_mask) + correlated(f_mask, f_squared) - 2 * correlated(f_z, f_z)
    with np.errstate(invalid="ignore", divide="ignore"):
        squared = np.where(pairs >= FEW_PAIRS, np.maximum(total, 0.0) / pairs, np.nan)
    squared[half[0], half[1]] = 0.0
    dx, dy = pitch(heights)
    x, y = np.arange(-half[1], half[1] + 1) * dx, np.arange(-half[0], half[0] + 1) * dy
    return Lags(x, y, squared, pairs, float(np.mean(z[used] ** 2)))


def radial(found: Lags) -> tuple[Values, Values]:
    """Distances [um] and the structure function [um^2] there, averaged over all directions, pairs counted.

    Near the origin every distance has its own value, farther out they share rings of one pixel.
    """
    step = min(float(np.diff(found.x).max()), float(np.diff(found.y).max()))
    reach = min(found.x[-1], found.y[-1])
    distance = np.hypot(*np.meshgrid(found.x, found.y))
    kept = (distance <= reach * (1 + 1e-9)) & np.isfinite(found.squared)
    r, d, n = distance[kept], found.squared[kept], found.pairs[kept]
    ring = np.where(r <= SINGLE * step, np.rint(r / step * 1e6) / 1e6, SINGLE + np.ceil(r / step - SINGLE))
    _, which = np.unique(ring, return_inverse=True)
    weight = np.bincount(which, n)
    return np.bincount(which, n * r) / weight, np.bincount(which, n * d) / weight


def taper(part: Values) -> Values:
    """1 up to half of the reach, then the square of a cosine to 0; `part` is the distance over the reach."""
    return np.where(part < 0.5, 1.0, np.cos(np.pi * (np.clip(part, 0.5, 1.0) - 0.5)) ** 2)


def structure(heights: xr.Dataset, found: Lags | None = None) -> Structure:
    """The structure function of a map, averaged over directions, with the variance to which it settles.

    Up to half the shorter side. found: the lags of the map, where they are known already.
    """
    found = lags(heights) if found is None else found
    r, d = radial(found)
    curve = _between(r, d)
    reach, step = float(r[-1]), min(pitch(heights))
    settled = _settled(curve, reach, step)
    # Of a map of a few points, or one that never settles, the mean squared height is what there is.
    variance = settled if 0.5 * found.variance < settled < 2 * found.variance else found.variance
    return Structure(curve, variance, reach, step, tapered=True)


def _between(r: Values, d: Values) -> Callable[[Values], Values]:
    """The structure function between its lags: D/r^2, which is smooth towards r = 0, by PCHIP without wiggles.

    At 0 it is that of an even function through the first two lags: within a pixel a surface is taken to be smooth, as
    light that sees smaller distances needs it, and as a map cannot contradict.
    """
    slopes = d[1:] / r[1:] ** 2
    first, second = r[1] ** 2, r[min(2, len(r) - 1)] ** 2
    bend = (slopes[0] - slopes[1]) * first / (second - first) if second > first else 0.0
    at_zero = max(slopes[0] + bend, 0.0)
    curve = PchipInterpolator(
        np.concatenate([-r[:0:-1], r]), np.concatenate([slopes[::-1], [at_zero], slopes]), extrapolate=False
    )
    return lambda at: np.asarray(at**2 * np.nan_to_num(curve(np.minimum(at, r[-1]))))


def _settled(curve: Callable[[Values], Values], reach: float, step: float) -> float:
    """The variance v for which the tapered spectrum, Int (v - D/2) J0(2 pi f r) r dr, is the same at f = 0 and 1/reach.

    A levelled map says nothing of the frequency zero: its heights have no mean, and D varies about its plateau over
    large areas. A wrong plateau would put a spike into the mirror direction, where that light is no scatter. The
    plateau has no part in the spectrum from 1/reach on, so that nothing else depends on it.
    """
    r = np.linspace(0, reach, max(int(4 * reach / step), 64) | 1)
    weight = taper(r / reach) * r
    lowest = j0(2 * math.pi * r / reach)
    whole, part = simpson((1 - lowest) * weight * curve(r) / 2, x=r), simpson((1 - lowest) * weight, x=r)
    return float(whole / part)


class CorrelationLengths(NamedTuple):
    """How fast the autocovariance of a map falls [um].

    Sal: distance of the fastest fall to 0.2; Str: Sal over that of the slowest, 1 for a surface without a direction,
    NaN where it does not fall that far within half the map. to_1_e: to 1/e, averaged over directions.
    """

    Sal: float
    Str: float
    to_1_e: float


def correlation_lengths(heights: xr.Dataset, found: Lags | None = None) -> CorrelationLengths:
    """Sal and Str of ISO 25178-2 and the 1/e length, of the central part of the autocovariance of a levelled map.

    found: its lags, where they are known already. NaN for what the map is too small to show.
    """
    found = lags(heights) if found is None else found
    relative = 1 - np.nan_to_num(found.squared / (2 * found.variance), nan=0.5)
    grid = RegularGridInterpolator((found.y, found.x), relative)
    reach = min(found.x[-1], found.y[-1])
    r = np.linspace(0, reach * (1 - 1e-12), max(int(4 * reach / min(pitch(heights))), 8))
    falls = [_fall(r, grid((r * np.sin(a), r * np.cos(a))), FALLEN) for a in np.pi / DIRECTIONS * np.arange(DIRECTIONS)]
    known = [fall for fall in falls if math.isfinite(fall)]
    fastest = min(known, default=math.nan)
    ratio = fastest / max(known) if len(known) == len(falls) else math.nan
    distance, d = radial(found)
    return CorrelationLengths(fastest, ratio, _fall(distance, 1 - d / (2 * found.variance), 1 / math.e))


def _fall(r: Values, relative: Values, to: float) -> float:
    """Where a function first falls to a level, by linear interpolation; NaN where it does not."""
    below = np.flatnonzero(relative <= to)
    if not below.size or below[0] == 0:
        return math.nan
    k = int(below[0])
    return float(r[k - 1] + (relative[k - 1] - to) / (relative[k - 1] - relative[k]) * (r[k] - r[k - 1]))


def effective_slope(surface: Structure, theta_i: float, wavelength: float) -> tuple[float, float]:
    """The distance r* [um] over which heights change the phase of the light by 1 rad, and the slope over it.

    k_z^2 D(r*)/2 = 1 with k_z = 4 pi cos(theta_i)/wavelength, and the slope per axis sqrt(D(r*))/r*, which is what
    light of this wavelength [um] and incidence [deg] sees of facets. Both NaN where the surface is so smooth that no
    distance does it (g = (k_z Sq)^2 < 1).
    """
    k_z = 4 * math.pi * math.cos(math.radians(theta_i)) / wavelength

    def beyond(r: float) -> float:
        return k_z**2 * float(surface.of(np.array([r]))[0]) / 2 - 1

    r = np.linspace(0, surface.reach, max(int(8 * surface.reach / surface.scale), 100))
    above = np.flatnonzero(k_z**2 * surface.of(r) / 2 >= 1)
    if not above.size:
        return math.nan, math.nan
    found = float(brentq(beyond, r[above[0] - 1], r[above[0]], xtol=1e-12))
    return found, math.sqrt(2) / k_z / found
