"""How the source changed while readings were taken: by a monitor, or by a direction that is read again and again."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.reduction.readings import of_kind
from gonio.reduction.steps.dark import times

Values = npt.NDArray[np.float64]
MONITOR, CHECK, NONE = "monitor", "check", "none"
CHOICES = (MONITOR, CHECK, NONE)
USED = ("sample", "standard", "incident", "check", "background")


@dataclass(frozen=True)
class Drift:
    """By what every reading (readings,) is divided, the change of the check direction that is left, and the words.

    elapsed (readings,): the time of each reading from 0, the first, to 1, the last. left: the relative change from the
    first to the last reading of the check direction that no correction took away, NaN where there is none. by: of
    CHOICES.
    """

    factor: Values
    elapsed: Values
    left: float
    line: str
    by: str


def drift(raw: xr.Dataset, net: Values, choice: str = "") -> Drift:
    """The drift of readings whose signals without dark and background are `net` (readings,).

    choice: monitor, check or none; without one, the monitor where every reading has one, else the check direction
    where it was read twice, else none. The monitor counts relative to its mean, the check direction to its first
    reading, linear in time between its readings. Raises ValueError for a choice that the readings do not allow.
    """
    if choice not in ("", *CHOICES):
        raise ValueError(f"no drift {choice!r}: choose one of {', '.join(CHOICES)}")
    used, checks, time = of_kind(raw, USED), of_kind(raw, "check"), times(raw)
    elapsed = (time - time[used].min()) / max(float(np.ptp(time[used])), 1e-300)
    monitor = raw["monitor"].values
    has_monitor = bool((monitor[used] > 0).all())
    chosen = choice or (MONITOR if has_monitor else CHECK if len(checks) > 1 else NONE)
    if chosen == MONITOR and not has_monitor:
        raise ValueError(
            "drift is to follow the monitor, and not every reading has one above zero: choose check or none"
        )
    if chosen == CHECK and len(checks) < 2:
        raise ValueError(f"drift is to follow the check direction, which was read {len(checks)} times: choose none")
    factor = np.ones(len(net))
    if chosen == MONITOR:
        factor = monitor / monitor[used].mean()
    changes = _changes(raw, net / factor, checks)
    left = float(changes[-1] - 1) if len(changes) > 1 else np.nan
    if chosen == CHECK:
        factor, left = np.interp(time, time[checks], changes), np.nan
    seen = f"; the check direction changed by {100 * (changes[-1] - 1):.3g} % in all" if len(changes) > 1 else ""
    said = {
        MONITOR: "divided by the monitor over its mean",
        CHECK: f"divided by the change of the check direction, read {len(checks)} times",
        NONE: "drift is not corrected",
    }
    return Drift(factor, elapsed, left, said[chosen] + seen, chosen)


def _changes(raw: xr.Dataset, net: Values, checks: npt.NDArray[np.intp]) -> Values:
    """Each reading of a check direction over the first one at that direction, in the order of time."""
    if not (net[checks] > 0).all():
        return np.zeros(0)
    first: dict[tuple[float, ...], float] = {}
    out = []
    for row in checks.tolist():
        key = tuple(float(raw[n].values[row]) for n in ("theta_i", "theta_r", "phi"))
        out.append(net[row] / first.setdefault(key, float(net[row])))
    return np.array(out)
