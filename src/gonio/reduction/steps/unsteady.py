"""Readings taken while the source changed by more than a correction can be trusted with: they are flagged as drifted.

Between two readings of the check direction the source may have moved in a line or in one step, and nothing says which:
a reading between them is unsure by as much as they differ. They are compared after division by the monitor, where that
is the correction, so that a change that the monitor sees and corrects flags nothing. A monitor alone, without a check
direction that vouches for it, is trusted as long as it stays near its median: beyond, it may itself be at fault, and
the source may have another spectrum, polarisation or spot.

Where drift is left as it is on purpose, its size is a cause of the budget, and nothing is flagged. Two sessions of a
measurement are not compared: what happened between them is no drift of a reading.
"""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.reduction.flags import SURE, Flag
from gonio.reduction.net import Corrected
from gonio.reduction.readings import of_kind
from gonio.reduction.steps.dark import times
from gonio.reduction.steps.drift import CHECK, MONITOR, NONE

Values = npt.NDArray[np.float64]
MOST_CHANGE = 0.05  # of the check direction from one reading to the next: the budget of a good bench is a tenth of it
FROM_MEDIAN = 0.2  # of a monitor that no check direction vouches for


def drifted(read: Corrected) -> Iterator[Flag]:
    """The readings of the sample (n,) between two of the check direction that differ, or at a monitor far off."""
    if read.drift.by == NONE:
        return
    raw, time = read.raw, times(read.raw)
    by_check = read.drift.by == CHECK  # which made them alike
    net, noise = (column * (read.drift.factor if by_check else 1.0) for column in (read.net, read.noise))
    reason: dict[int, str] = {}
    pairs = list(_pairs(raw, time))
    for first, last in pairs:
        change, spread = _change(net, noise, first, last)
        if abs(change) <= MOST_CHANGE or abs(change) <= SURE * spread:
            continue
        words = f"the check direction changed by {100 * change:.3g} % between the readings before and after"
        corrected = {MONITOR: ", after division by the monitor", CHECK: "; a line between them is no measurement"}
        between = (time[read.rows] >= time[first]) & (time[read.rows] <= time[last])
        for row in np.flatnonzero(between).tolist():
            reason.setdefault(row, words + corrected[read.drift.by])
    if not pairs:
        monitor = raw["monitor"].values[read.rows]
        off = monitor / np.median(monitor) - 1 if (monitor > 0).all() else np.zeros(len(monitor))
        for row in np.flatnonzero(np.abs(off) > FROM_MEDIAN).tolist():
            reason[row] = (
                f"the monitor is {100 * off[row]:+.3g} % from its median, and no check direction was read twice to "
                "vouch for it"
            )
    yield from (Flag("drifted", row, words) for row, words in sorted(reason.items()))


def _pairs(raw: xr.Dataset, time: Values) -> Iterator[tuple[int, int]]:
    """Successive readings of one check direction in one session, in the order of time."""
    last: dict[tuple[float, ...], int] = {}
    checks = of_kind(raw, "check")
    session = raw["session"].values if "session" in raw else np.zeros(len(time))
    for row in checks[np.argsort(time[checks], kind="stable")].tolist():
        key = (*(float(raw[n].values[row]) for n in ("theta_i", "theta_r", "phi")), float(session[row]))
        if key in last:
            yield last[key], row
        last[key] = row


def _change(net: Values, noise: Values, first: int, last: int) -> tuple[float, float]:
    """The relative change of a check direction and its standard uncertainty; all of it where no light was seen."""
    if not (net[first] > 0 and net[last] > 0):
        return (-1.0, 0.0) if net[first] > 0 else (0.0, 0.0)
    ratio = float(net[last] / net[first])
    each = np.nan_to_num(noise[[first, last]]) / net[[first, last]]
    return ratio - 1, ratio * float(np.hypot(*each))
