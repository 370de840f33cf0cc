"""Quarters of a map, whose spread is how much the place matters."""

from collections.abc import Callable, Iterator

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.topography.heights import MOST_MISSING, Values, share_missing

FEWEST = 16  # points along a side of a quarter
PARTS = 2  # along each side


def quarters(heights: xr.Dataset) -> Iterator[xr.Dataset]:
    """The four quarters of a map, without one of which too much is missing; none of a map that is too small."""
    rows, columns = (heights.sizes[name] // PARTS for name in ("y", "x"))
    if min(rows, columns) < FEWEST:
        return
    for j in range(PARTS):
        for i in range(PARTS):
            part = heights.isel(y=slice(j * rows, (j + 1) * rows), x=slice(i * columns, (i + 1) * columns))
            if share_missing(part) <= MOST_MISSING:
                yield part


def spread(heights: xr.Dataset, of: Callable[[xr.Dataset], npt.ArrayLike]) -> Values | None:
    """The standard deviation of what a function finds in each quarter; None where there are not two quarters.

    It is that of one place, and not divided by the root of their number: a spot of light lies at one place, and
    heights that are correlated over more than a quarter would make a mean look surer than it is.
    """
    found = [np.asarray(of(part), dtype=float) for part in quarters(heights)]
    return np.std(found, axis=0, ddof=1) if len(found) > 1 else None
