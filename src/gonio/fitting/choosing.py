"""The weighting that many scans ask for: `weighting="auto"` in a fit of a stack.

All scans of a stack get one weighting, so that their values and their E can be compared. Each scan chooses by the rule
for one scan (`objective.automatic`), and the most careful choice holds for all:

    relative      where one scan asks for it: a value of zero or less, or one lost in noise, has no logarithm that means
                  anything. The noise floor is the median of those that these scans ask for, because one instrument has
                  one noise.
    uncertainty   where every scan asks for it.
    log           else.

Scans without a positive value ask for nothing. Of a long stack some scans are asked, in runs that are spread evenly
over it, and the reason says how many.
"""

from collections.abc import Iterator, Sequence

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.objective.automatic import Choice, chosen
from gonio.fitting.objective.from_scan import given_floor
from gonio.measured import dataset
from gonio.measured.stack import NODE, StackLanes, one_scan

ASKED, RUNS = 1024, 16  # scans that are asked at most, and the runs in which they lie: neighbours share a chunk


def choice_for(stack: xr.Dataset, dims: Sequence[str], noise_floor: float = 0.0) -> Choice:
    """The weighting of a stack whose lanes lie along `dims`; relative where a noise floor is given."""
    if noise_floor:
        return Choice("relative", noise_floor, given_floor(noise_floor))
    if not all(stack.sizes[dim] for dim in dims):
        return Choice("uniform", 0.0, "the stack holds no scan")
    points = dataset.points(one_scan(stack, dims))
    lanes = StackLanes(stack, dims, points[NODE].values)
    choices = [chosen(scan) for rows in _asked(len(lanes)) for scan in _scans(points, lanes, rows)]
    of_all = "" if len(lanes) <= ASKED else f", as {ASKED} of the {len(lanes)} scans say"
    return _common(choices, of_all)


def _common(choices: list[Choice], of_all: str) -> Choice:
    """One weighting for all scans, from what each asks for."""
    asking = [one for one in choices if one.weighting != "uniform"]
    if not asking:
        return Choice("uniform", 0.0, f"no scan holds a positive value{of_all}")
    relative = [one for one in asking if one.weighting == "relative"]
    if relative:
        # that of a scan, and no mean of two, so that the number is one that the rule gives
        floor = float(np.quantile([one.noise_floor for one in relative], 0.5, method="lower"))
        words = f"{len(relative)} of {len(asking)} scans hold values that are not positive or that are lost in noise"
        return Choice("relative", floor, f"{words}{of_all}; the noise floor is the median of theirs")
    if all(one.weighting == "uncertainty" for one in asking):
        words = "every scan states an uncertainty for each value and spans few decades"
        return Choice("uncertainty", 0.0, f"{words}{of_all}")
    return Choice("log", 0.0, f"all values of the scans are positive{of_all}")


def _asked(count: int) -> Iterator[range]:
    """The places of the scans that are asked, in runs."""
    if count <= ASKED:
        yield range(count)
        return
    length = ASKED // RUNS
    for first in np.linspace(0, count - length, RUNS).astype(int).tolist():
        yield range(first, first + length)


def _scans(points: xr.Dataset, lanes: StackLanes, rows: range) -> Iterator[xr.Dataset]:
    """Each of some lanes as a flat scan of its values in use; lanes without one are left out."""
    laned = [name for name in ("brdf", "uncertainty") if name in lanes]
    values = {name: np.asarray(lanes.values(name, rows.start, rows.stop), dtype=float) for name in laned}
    used: npt.NDArray[np.bool_] = np.isfinite(values["brdf"])
    if lanes.has_own("mask"):
        used &= lanes.values("mask", rows.start, rows.stop) == 0
    bare = xr.Dataset(coords=points.coords)
    for k in range(len(rows)):
        if used[k].any():
            lane = bare.assign({name: ("direction", column[k]) for name, column in values.items()})
            yield lane.isel(direction=np.flatnonzero(used[k]))
