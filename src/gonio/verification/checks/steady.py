"""What should not change during a measurement: the check direction, and the dark."""

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.reduction.readings import NET, checked, of_kind
from gonio.reduction.steps.dark import darks, times
from gonio.verification.checks.outcome import Detail, Outcome

Values = npt.NDArray[np.float64]


def repeat(raw: xr.Dataset) -> Outcome:
    """The scatter of repeated readings of the check direction, without dark and over the monitor, relative.

    Raises ValueError where no direction was checked twice, or a signal without its dark is not above zero.
    """
    raw = checked(raw)
    net = raw["signal"].values - darks(raw).value
    checks, monitor = of_kind(raw, "check"), raw["monitor"].values
    has_monitor = bool(len(checks)) and bool((monitor[checks] > 0).all())
    scale = monitor if has_monitor else np.ones(len(net))
    if len(checks) and not (net[checks] > 0).all():
        raise ValueError("a reading of the check direction is not above its dark: choose a brighter direction")
    keys = np.round(np.column_stack([raw[n].values[checks] for n in ("theta_i", "theta_r", "phi")]), 1)
    changes, noises, details = [], [], []
    for key in np.unique(keys, axis=0):
        rows = checks[(keys == key).all(axis=1)]
        rows = rows[np.argsort(times(raw)[rows], kind="stable")]
        if len(rows) > 1:
            values = net[rows] / scale[rows]
            changes.append(values / values.mean() - 1)
            noises.append((raw["sd"].values / np.sqrt(raw["samples"].values))[rows] / net[rows])
            where = "theta_i {:g}, theta_r {:g}, phi {:g} deg".format(*key)
            details.append(Detail(f"change from first to last, at {where}", float(values[-1] / values[0] - 1)))
    if not changes:
        raise ValueError("no check direction was read twice: plan it, gonio plan --check 0,45 --check-every 20")
    freedom = sum(len(one) - 1 for one in changes)
    return Outcome(
        float(np.sqrt(sum(np.sum(one**2) for one in changes) / freedom)),
        _rms(np.concatenate(noises)),
        sum(map(len, changes)),
        "scatter of the check direction" + " over the monitor" * has_monitor,
        "let the source warm up, and correct what is left: gonio reduce --drift "
        + ("check" if has_monitor else "monitor or check"),
        details=tuple(details),
    )


def dark(raw: xr.Dataset) -> Outcome:
    """The scatter of the darks of each range, over the median signal that is read in that range.

    Of several ranges that one counts whose darks scatter most. Raises ValueError where no range with readings has two
    darks.
    """
    raw = checked(raw)
    signal, sizes = raw["signal"].values, raw["sd"].values / np.sqrt(raw["samples"].values)
    net = np.abs(signal if raw.attrs.get(NET) else signal - darks(raw).value)
    rows, others = of_kind(raw, "dark"), np.setdiff1d(np.arange(len(signal)), of_kind(raw, "dark"))
    ranges = np.zeros(len(signal), dtype="U1") if raw.attrs.get(NET) else raw["range"].values.astype(str)
    found = {}
    for name in dict.fromkeys(ranges[rows].tolist()):
        some, level = rows[ranges[rows] == name], net[others[ranges[others] == name]]
        if len(some) > 1 and level.size and np.median(level) > 0:
            scatter, middle = float(np.std(signal[some], ddof=1)), float(np.median(level))
            moved = Detail("least to largest, over the same", float(np.ptp(signal[some])) / middle)
            found[name] = (scatter / middle, _rms(sizes[some]) / middle, len(some), moved)
    if not found:
        raise ValueError("no range with readings has two darks: plan them, gonio plan --dark-every 40")
    name = max(found, key=lambda one: found[one][0])
    number, spread, count, moved = found[name]
    what = "scatter of the darks over the median signal" + f", of range {name}" * bool(name)
    remedy = "read darks more often (gonio plan --dark-every), and keep the light of the room off the detector"
    return Outcome(number, spread, count, what, remedy, details=(moved,))


def _rms(values: Values) -> float:
    return float(np.sqrt(np.mean(values**2)))
