"""What a detector reads without the sample's light: darks, and the background of a light trap.

The dark is linear in time between the reading before and the one after, of the same range and dwell, and constant
beyond the first and the last. A background is a reading with the shutter open and a light trap in place of the sample.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.reduction.readings import LINE, NET, of_kind, place

Values = npt.NDArray[np.float64]
DECIMALS = 3  # of a degree, to which the direction of a background agrees with that of a reading


@dataclass(frozen=True)
class Darks:
    """The dark of every reading (readings,), and how it is made of the d readings of darks.

    weights (d, readings): the share of each dark in that of a reading. sizes (d,): standard uncertainty of each dark,
    NaN where none is stated. lines: where they stand in the file. line: what was done, in words.
    """

    value: Values
    weights: Values
    sizes: Values
    lines: tuple[int, ...]
    line: str


def times(raw: xr.Dataset) -> Values:
    """The time of every reading [s], or its place in the file where not all have a time."""
    time = raw["time"].values
    return time if np.isfinite(time).all() else np.arange(len(time), dtype=float)


def darks(raw: xr.Dataset) -> Darks:
    """The dark of every reading; zero where none was read, or where the instrument has subtracted it already.

    Raises ValueError, with the reading, where darks were read and none has its range and dwell.
    """
    rows, count = of_kind(raw, "dark"), raw.sizes["reading"]
    if not len(rows):
        return Darks(np.zeros(count), np.zeros((0, count)), np.zeros(0), (), "no dark was read: none is subtracted")
    signal = raw["signal"].values
    sizes = raw["sd"].values[rows] / np.sqrt(raw["samples"].values[rows])
    if raw.attrs.get(NET):
        # Which dark the instrument took is not known: it may lie anywhere between the least and the largest.
        half = np.array([(signal[rows].max() - signal[rows].min()) / 2 / np.sqrt(3.0)])
        said = "the signals are net of dark already: the darks read count as their uncertainty alone"
        return Darks(np.zeros(count), np.ones((1, count)), half, (), said)
    weights = np.zeros((len(rows), count))
    time, dwell, name = times(raw), raw["dwell"].values, raw["range"].values
    alike = [(n, None if d != d else d) for n, d in zip(name.tolist(), dwell.tolist(), strict=True)]
    of: dict[tuple[str, float | None], list[int]] = {}
    for k, row in enumerate(rows.tolist()):
        of.setdefault(alike[row], []).append(k)
    for row in np.setdiff1d(np.arange(count), rows).tolist():
        if alike[row] not in of:
            what = [f"range {alike[row][0]!r}"] * bool(alike[row][0]) + [f"dwell {dwell[row]:g} s"] * bool(
                dwell[row] == dwell[row]
            )
            message = f"there is no dark of {' and '.join(what) or 'no range and no dwell, as this reading has'}"
            raise ValueError(f"{place(raw, row)}: {message}: read one, or leave out the darks to subtract none")
        some = np.array(of[alike[row]])
        weights[some, row] = _shares(time[rows[some]], time[row])
    lines = tuple(int(n) for n in raw[LINE].values[rows])
    said = f"subtracted the dark of {len(rows)} readings, linear in time between them"
    return Darks(weights.T @ signal[rows], weights, sizes, lines, said)


def _shares(at: Values, time: float) -> Values:
    """The share of each of some darks, read at the times `at`, in that of a reading at one time."""
    shares, order = np.zeros(len(at)), np.argsort(at, kind="stable")
    after = int(np.searchsorted(at[order], time))
    if after in (0, len(order)):
        shares[order[min(after, len(order) - 1)]] = 1.0
        return shares
    first, last = at[order[after - 1]], at[order[after]]
    shares[order[after]] = (time - first) / (last - first)
    shares[order[after - 1]] = 1.0 - shares[order[after]]
    return shares


@dataclass(frozen=True)
class Background:
    """The background of every reading (readings,), its random standard uncertainty, and what was done, in words."""

    value: Values
    uncertainty: Values
    line: str


def background(raw: xr.Dataset, net: Values) -> Background:
    """The background of every reading of sample, standard and check: that at its own direction, scaled by the monitor.

    net (readings,): signals without their dark. One background, or several at one direction, hold for all directions.
    Raises ValueError where a direction has none.
    """
    rows, count = of_kind(raw, "background"), len(net)
    value, variance = np.zeros(count), np.zeros(count)
    if not len(rows):
        return Background(value, variance, "")
    columns = [np.round(raw[n].values, DECIMALS) + 0.0 for n in ("theta_i", "theta_r", "phi")]
    keys = list(zip(*(column.tolist() for column in columns), strict=True))
    at: dict[tuple[float, ...], list[int]] = {}
    for row in rows.tolist():
        at.setdefault(keys[row], []).append(row)
    monitor = raw["monitor"].values
    flux = monitor if np.isfinite(monitor[np.setdiff1d(np.arange(count), of_kind(raw, "dark"))]).all() else None
    for row in of_kind(raw, ("sample", "standard", "check")).tolist():
        found = next(iter(at.values())) if len(at) == 1 else at.get(keys[row])
        if found is None:
            angles = ", ".join(f"{n} {a:g}" for n, a in zip(("theta_i", "theta_r", "phi"), keys[row], strict=True))
            raise ValueError(
                f"{place(raw, row)}: there is no background at {angles} deg: read one at each direction, or one alone"
            )
        scale = np.ones(len(found)) if flux is None else flux[row] / flux[found]
        value[row] = np.mean(scale * net[found])
        sizes = raw["sd"].values[found] / np.sqrt(raw["samples"].values[found])
        variance[row] = np.sum(np.nan_to_num(scale * sizes) ** 2) / len(found) ** 2
    said = f"subtracted the background of {len(rows)} readings" + ", scaled by the monitor" * (flux is not None)
    return Background(value, np.sqrt(variance), said)
