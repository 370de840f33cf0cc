"""The Dataset of a height map: what it holds, and which maps cannot be.

Variables over (y, x): `z` [um], NaN where nothing was measured; `mask`, 0 = in use, 1 = missing, 2 = outlier.
Coordinates `x` and `y` [um] of the centres of the pixels, equally spaced, in the order of the file. `history` has one
line a step, `provenance` what the file says of itself.
"""

import re
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

Values = npt.NDArray[np.float64]

MASK_MEANINGS = ("in_use", "missing", "outlier")
MISSING, OUTLIER = 1, 2
FEWEST = 2  # points along a side
LEAST, MOST = 1.0, 1e6  # um: a side of a map
STEEPEST = 10.0  # range of heights over the longer side: a larger one is a mistake in the unit
MOST_MISSING = 0.2  # share of the points: where more is missing, statistics are those of what could be measured
UNEQUAL = 1e-3  # of the pitch, by which points that are equally spaced may differ


class Grid(NamedTuple):
    """Heights (y, x) [um], NaN where missing, and the distances of points along x and y [um], as a reader gives them.

    place: where in the file the sizes stand; provenance: what the file says of itself.
    """

    z: Values
    dx: float
    dy: float
    place: str = ""
    provenance: str = ""


def make_heights(
    z: npt.ArrayLike, dx: float, dy: float | None = None, *, provenance: str = "", history: str = ""
) -> xr.Dataset:
    """Make a height map of an array of heights.

    Parameters
    ----------
    z : array_like
        Heights (y, x) [um]; NaN and infinite values are missing points.
    dx, dy : float
        Distances of neighbouring points along x and y [um]; without dy they are equal.
    provenance, history : str
        What is known of the measurement, and what was done to it, one line a step.

    Returns
    -------
    xarray.Dataset
        `z` [um] and `mask` over y and x [um].

    Raises
    ------
    ValueError
        The map cannot be: a side outside 1 um to 1 m, heights of one value, or ten times larger than the side; or
        more than 20 % of its points are missing.

    """
    values = np.array(z, dtype=float)
    dy = dx if dy is None else dy
    if values.ndim != 2 or min(values.shape) < FEWEST:
        raise ValueError(f"a map of shape {values.shape} is none: give rows of at least {FEWEST} heights")
    missing = ~np.isfinite(values)
    values[missing] = np.nan
    _refuse_impossible(values, missing, float(dx), float(dy))
    mask = np.where(missing, MISSING, 0).astype(np.int8)
    flags = {"flag_values": np.arange(len(MASK_MEANINGS), dtype=np.int8), "flag_meanings": " ".join(MASK_MEANINGS)}
    rows, columns = values.shape
    return xr.Dataset(
        {"z": (("y", "x"), values, {"units": "um"}), "mask": (("y", "x"), mask, flags)},
        coords={
            "y": ("y", np.arange(rows) * float(dy), {"units": "um"}),
            "x": ("x", np.arange(columns) * float(dx), {"units": "um"}),
        },
        attrs={"Conventions": "CF-1.11", "history": history, "provenance": provenance},
    )


def _refuse_impossible(z: Values, missing: npt.NDArray[np.bool_], dx: float, dy: float) -> None:
    for name, step, count in (("x", dx, z.shape[1]), ("y", dy, z.shape[0])):
        side = step * count
        if not (np.isfinite(side) and LEAST <= side <= MOST * (1 + 1e-9)):
            what = f"the side along {name} is {side:.6g} um ({count} points of {step:.6g} um)"
            raise ValueError(f"{what}, and maps are 1 um to 1 m wide: check the unit of the pitch")
    share = float(missing.mean())
    if share > MOST_MISSING:
        raise ValueError(
            f"{100 * share:.1f} % of the points are missing, more than {100 * MOST_MISSING:.0f} %: measure again, or "
            "cut out a part that was measured"
        )
    used = z[~missing]
    if not np.abs(used).max() <= MOST:
        raise ValueError(f"heights reach {np.abs(used).max():.6g} um, more than 1 m: check the unit of the heights")
    extent = float(np.ptp(used))
    longest = max(dx * z.shape[1], dy * z.shape[0])
    if not extent <= STEEPEST * longest:
        what = f"heights span {extent:.6g} um on a side of {longest:.6g} um"
        raise ValueError(f"{what}: no surface is so steep; check the unit of the heights")
    if extent == 0:
        raise ValueError("every height is the same: there is no topography in it")


def values(heights: xr.Dataset) -> Values:
    """Heights (y, x) [um], NaN for what is masked. Raises ValueError for a Dataset that is no height map."""
    if lacking := [name for name in ("z", "x", "y") if name not in heights.variables]:
        raise ValueError(f"the Dataset has no {', '.join(lacking)}: a height map needs z over y and x, all in um")
    ordered = heights.transpose("y", "x")
    z = ordered["z"].values.astype(float)
    return np.where(ordered["mask"].values == 0, z, np.nan) if "mask" in heights else z


def pitch(heights: xr.Dataset) -> tuple[float, float]:
    """Distances of neighbouring points along x and y [um]. Raises ValueError for points that are not equally spaced."""
    found = []
    for name in ("x", "y"):
        steps = np.diff(heights[name].values.astype(float))
        step = float(steps.mean()) if steps.size else 0.0
        if not step > 0 or np.abs(steps - step).max() > UNEQUAL * step:
            raise ValueError(f"the points of a height map are not equally spaced along {name}: resample them first")
        found.append(step)
    return found[0], found[1]


def sides(heights: xr.Dataset) -> tuple[float, float]:
    """Width and height of a map [um], each pixel counted whole."""
    dx, dy = pitch(heights)
    return dx * heights.sizes["x"], dy * heights.sizes["y"]


def share_missing(heights: xr.Dataset) -> float:
    """The share of points that are not in use."""
    return float(np.isnan(values(heights)).mean())


def with_values(heights: xr.Dataset, z: Values, line: str) -> xr.Dataset:
    """The map with other heights at the points in use, and one more line of history."""
    masked = heights["mask"].values if "mask" in heights else np.where(np.isnan(z), MISSING, 0)
    lost = np.isnan(z) & (masked == 0)
    flags = heights["mask"].attrs if "mask" in heights else {}
    out = heights.transpose("y", "x").assign(
        z=(("y", "x"), z, heights["z"].attrs),
        mask=(("y", "x"), np.where(lost, MISSING, masked).astype(np.int8), flags),
    )
    return add_history(out, line)


def add_history(heights: xr.Dataset, line: str) -> xr.Dataset:
    """A copy with one more line of history."""
    past = str(heights.attrs.get("history", ""))
    return heights.assign_attrs(history=f"{past}\n{line}" if past else line)


def name_of(heights: xr.Dataset) -> str:
    """What a map is called: the file that it was read from, else `a height map`."""
    found = re.search(r"^read from (.+) as [^\n]+$", str(heights.attrs.get("history", "")), re.MULTILINE)
    return found[1] if found else "a height map"
