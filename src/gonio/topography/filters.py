"""The S- and L-filters of ISO 25178: Gaussian weights (ISO 16610-61); and points that stand out of their neighbours.

The filter of nesting index lc has the weight exp(-pi r^2/(alpha lc)^2)/(alpha lc)^2, alpha = sqrt(ln 2/pi). It passes a
wave of period p by 2^-(lc/p)^2: half of one whose period is lc. At edges and beside missing points the weights that are
there are made to sum to 1; the map is not continued.
"""

import math

import numpy as np
import xarray as xr
from scipy.ndimage import median_filter
from scipy.signal import oaconvolve

from gonio.topography.heights import MASK_MEANINGS, OUTLIER, Values, add_history, pitch, sides, values, with_values

ALPHA = math.sqrt(math.log(2) / math.pi)
REACH = 1.3  # nesting indices to where the weight is summed: it is 3e-11 of its largest there
OUTSIDE = 6.0  # robust standard deviations from the median of 5 x 5 points
WINDOW = 5
MAD = 1.482602218505602  # of a normal distribution: standard deviation over median absolute deviation


def low_pass(period: float, nesting: float) -> float:
    """The share of a wave of a period [um] that the S-filter of a nesting index [um] passes: 2^-(nesting/period)^2."""
    return float(2.0 ** -((nesting / period) ** 2))


def high_pass(period: float, nesting: float) -> float:
    """The share that the L-filter passes, 1 minus that of the S-filter of the same index."""
    return 1 - low_pass(period, nesting)


def smooth(heights: xr.Dataset, nesting: float) -> xr.Dataset:
    """The S-filter: take away what is smaller than the nesting index [um], such as noise.

    Raises ValueError for an index below two pixels, which filters nothing, or above the shorter side.
    """
    z = _filtered(heights, nesting)
    return with_values(heights, z, f"S-filter, nesting index {nesting:g} um")


def roughness(heights: xr.Dataset, nesting: float) -> xr.Dataset:
    """The L-filter: take away what is larger than the nesting index [um], such as waviness. Raises as `smooth`."""
    z = values(heights) - _filtered(heights, nesting)
    return with_values(heights, z, f"L-filter, nesting index {nesting:g} um")


def _filtered(heights: xr.Dataset, nesting: float) -> Values:
    steps, shortest = pitch(heights), min(sides(heights))
    if not 2 * max(steps) <= nesting <= shortest:
        raise ValueError(
            f"a nesting index of {nesting:g} um is none for this map: give {2 * max(steps):.4g} um (two pixels) to "
            f"{shortest:.4g} um (its shorter side)"
        )
    z = values(heights)
    used = np.isfinite(z)
    total, weight = np.where(used, z, 0.0), used.astype(float)
    for axis, step in ((1, steps[0]), (0, steps[1])):
        reach = math.ceil(REACH * nesting / step)
        kernel = np.exp(-math.pi * (np.arange(-reach, reach + 1) * step / (ALPHA * nesting)) ** 2)
        shape = (-1, 1) if axis == 0 else (1, -1)
        total, weight = (
            oaconvolve(part, kernel.reshape(shape) / kernel.sum(), mode="full", axes=axis) for part in (total, weight)
        )
        keep = slice(reach, reach + z.shape[axis])
        total, weight = (part[keep] if axis == 0 else part[:, keep] for part in (total, weight))
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(used, total / weight, np.nan)


def outliers(heights: xr.Dataset) -> np.ndarray:
    """Which points (y, x) stand out: farther from the median of 5 x 5 points than 6 robust standard deviations.

    The robust standard deviation is 1.4826 times the median distance from that median, over the whole map.
    """
    z = values(heights)
    if min(z.shape) < WINDOW:
        return np.zeros(z.shape, dtype=bool)
    distance = np.abs(z - _medians(z))
    spread = MAD * float(np.nanmedian(distance))
    # Heights stored as counts are equal to their neighbours more often than not: then nothing says what is far.
    return np.nan_to_num(distance, nan=0.0) > OUTSIDE * spread if spread > 0 else np.zeros(z.shape, dtype=bool)


def _medians(z: Values) -> Values:
    """The median of the points in use among 5 x 5; those beyond an edge are its mirror image."""
    if np.isfinite(z).all():
        return np.asarray(median_filter(z, WINDOW, mode="reflect"))
    padded = np.pad(z, WINDOW // 2, mode="symmetric")
    medians = np.empty(z.shape)
    for row in range(z.shape[0]):  # a window of every point at once would take 25 times the memory of the map
        windows = np.lib.stride_tricks.sliding_window_view(padded[row : row + WINDOW], (WINDOW, WINDOW))[0]
        ordered = np.sort(windows.reshape(z.shape[1], -1), axis=1)  # NaN last
        count = np.isfinite(ordered).sum(axis=1)
        middle = [np.take_along_axis(ordered, np.maximum(count - k, 0)[:, None] // 2, axis=1)[:, 0] for k in (0, 1)]
        medians[row] = np.mean(middle, axis=0)
    return medians


def mask_outliers(heights: xr.Dataset) -> xr.Dataset:
    """The map with the points of `outliers` masked; their heights stay in it."""
    found = outliers(heights)
    if not found.any():
        return add_history(heights, "no outlier was found")
    out = heights.transpose("y", "x")
    flags = dict(out["mask"].attrs) or {"flag_meanings": " ".join(MASK_MEANINGS)}
    masked = np.where(found, OUTLIER, out["mask"].values).astype(np.int8)
    return add_history(out.assign(mask=(("y", "x"), masked, flags)), f"masked {int(found.sum())} outliers")
