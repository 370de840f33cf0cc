"""Raw readings of a detector as a Dataset: what it holds, and what it must be before anything is reduced.

One row a reading, along the dimension `reading`. `kind` says what was read: the sample, a dark (shutter closed), a
background (a light trap in place of the sample), the incident beam, a standard, or the check direction that is read
again and again. Angles are those that were read back, in degrees, as in a scan: theta_r signed and in plane without
`phi`, from 0 to 90 with it. Times are seconds since the start.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.dataset import SETS
from gonio.outside import nearest

Values = npt.NDArray[np.float64]
KINDS = ("sample", "dark", "background", "incident", "standard", "check")
WITHOUT_ANGLES = ("dark", "incident")  # kinds that are read at no direction of the sample
UNITS = ("W", "A", "V", "counts", "a.u.")  # of a signal
ROW = "reading"
LINE = "line"  # the line of the file that a reading stands in


@dataclass(frozen=True)
class Column:
    """One variable over `reading`: what it is, its unit, and the value that stands where a file says nothing."""

    help: str
    unit: str = "1"
    default: Any = np.nan


COLUMNS: Mapping[str, Column] = {
    "kind": Column(f"what was read: {', '.join(KINDS)}", "", "sample"),
    "theta_i": Column("incidence angle", "degree"),
    "theta_r": Column("reflection angle, signed and in plane without phi", "degree"),
    "phi": Column("azimuth between the directions", "degree"),
    "phi_i": Column("azimuth of the incident light on a turned surface", "degree"),
    "signal": Column(f"mean of the samples, in {', '.join(UNITS)}", "signal"),
    "sd": Column("standard deviation of the samples", "signal"),
    "samples": Column("number of samples that the signal is the mean of", "1", 1.0),
    "dwell": Column("time over which samples were taken", "s"),
    "range": Column("name of the detector's range", "", ""),
    "filter": Column("name of the filter in the beam", "", ""),
    "monitor": Column("reading of the monitor of the source", "1"),
    "temperature": Column("temperature of the detector", "degC"),
    "time": Column("time since the start", "s"),
    "overload": Column("whether the detector said that it was overloaded", "1", 0.0),
    "attempt": Column("number of the attempt, of which the last good one counts", "1", 0.0),
    "wavelength": Column("wavelength", "nm"),
    "polarisation": Column("polarisation of the source", "", ""),
    LINE: Column("line of the file", "1"),
}
REQUIRED = ("theta_i", "theta_r", "signal")
TEXTS = tuple(name for name, column in COLUMNS.items() if isinstance(column.default, str))
OF_SETS = tuple(name for name in SETS if name in COLUMNS)  # what tells sets of directions apart
NET = "signal_net_of_dark"  # attribute: 1 where the instrument has subtracted its dark already


def make_readings(columns: Mapping[str, Any], unit: str, attrs: Mapping[str, Any] | None = None) -> xr.Dataset:
    """Readings from columns (n,) by the names of COLUMNS, with the signal in `unit`, one of UNITS.

    Raises ValueError as `checked` does.
    """
    data = {n: (ROW, np.asarray(v), {"units": unit if _unit(n) == "signal" else _unit(n)}) for n, v in columns.items()}
    return checked(xr.Dataset(data, attrs=dict(attrs or {})))


def _unit(name: str) -> str:
    return COLUMNS[name].unit if name in COLUMNS else "1"


def checked(raw: xr.Dataset) -> xr.Dataset:
    """The readings with every column of COLUMNS, theta_r unsigned and with `phi`; of several attempts the last good.

    Raises ValueError, with the reading and the remedy, where a column that is needed is missing, a kind is not known,
    a signal is not finite, or an angle is outside the hemisphere.
    """
    raw = raw.reset_coords()
    if missing := [name for name in REQUIRED if name not in raw]:
        raise ValueError(f"the readings have no {', '.join(missing)}: they need {', '.join(REQUIRED)} along {ROW!r}")
    if raw["signal"].dims != (ROW,):
        raise ValueError(f"the signal lies along {', '.join(map(str, raw['signal'].dims))}, not along {ROW!r}")
    if (unit := raw["signal"].attrs.get("units")) not in UNITS:
        raise ValueError(f"the signal is in {unit!r}: set signal.attrs['units'] to one of {', '.join(UNITS)}")
    full = raw.assign({n: (ROW, _filled(raw, n)) for n in COLUMNS})
    full["signal"].attrs["units"] = full["sd"].attrs["units"] = unit
    _refuse_kinds(full)
    full = _last_attempts(full)
    _refuse_values(full)
    return _unsigned(full, "phi" in raw)


def _filled(raw: xr.Dataset, name: str) -> npt.NDArray[Any]:
    """The values of a column; where they are absent, the column's default."""
    count, column = raw.sizes[ROW], COLUMNS[name]
    if name == LINE and name not in raw:
        return np.arange(1.0, count + 1)
    if name not in raw:
        return np.full(count, column.default)
    if name in TEXTS:
        values = raw[name].values
        if values.dtype.kind in "fiu":  # a range called 1, a filter called 4
            return np.array(["" if v != v else f"{v:g}" for v in values.astype(float)])
        return np.char.strip(values.astype(str))
    values = raw[name].values.astype(float)
    return values if np.isnan(column.default) else np.where(np.isnan(values), column.default, values)


def place(raw: xr.Dataset, row: int) -> str:
    """Where a reading stands, for a message."""
    return f"line {int(raw[LINE].values[row])}"


def _refuse_kinds(raw: xr.Dataset) -> None:
    for row, kind in enumerate(raw["kind"].values.tolist()):
        if kind not in KINDS:
            raise ValueError(f"{place(raw, row)}: no kind of reading {kind!r}: {nearest(kind, KINDS)}")


def _last_attempts(raw: xr.Dataset) -> xr.Dataset:
    """Of readings that were repeated because something failed, the last; an attempt counts up from 0 at each step."""
    attempt = raw["attempt"].values
    again = np.append(attempt[1:] > np.maximum(attempt[:-1], 0), False)
    return raw.isel({ROW: np.flatnonzero(~again)}) if again.any() else raw


def _refuse_values(raw: xr.Dataset) -> None:
    for row in np.flatnonzero(~np.isfinite(raw["signal"].values)).tolist():
        raise ValueError(f"{place(raw, row)}: the signal is {raw['signal'].values[row]}: delete the reading or mend it")
    for row in np.flatnonzero(raw["sd"].values < 0).tolist():
        raise ValueError(f"{place(raw, row)}: the standard deviation is {raw['sd'].values[row]:g}, below zero")
    for row in np.flatnonzero(~(raw["samples"].values >= 1)).tolist():
        raise ValueError(f"{place(raw, row)}: the number of samples is {raw['samples'].values[row]:g}, not 1 or more")
    directed = ~np.isin(raw["kind"].values, WITHOUT_ANGLES)
    for name in ("theta_i", "theta_r"):
        values = raw[name].values
        low = -90.0 if name == "theta_r" else 0.0
        for row in np.flatnonzero(directed & ~((values >= low) & (values <= 90))).tolist():
            if raw["kind"].values[row] == "background" and np.isnan(values[row]):
                continue  # one background for all directions
            raise ValueError(f"{place(raw, row)}: {name} is {values[row]:g} deg, outside {low:g} to 90")


def _unsigned(raw: xr.Dataset, has_phi: bool) -> xr.Dataset:
    theta_r, phi = raw["theta_r"].values, raw["phi"].values
    if has_phi:
        for row in np.flatnonzero((theta_r < 0) & np.isfinite(phi)).tolist():
            raise ValueError(f"{place(raw, row)}: theta_r is {theta_r[row]:g} deg and phi is given: sign one of them")
    in_plane = np.where(theta_r >= 0, 180.0, 0.0)
    return raw.assign(theta_r=(ROW, np.abs(theta_r)), phi=(ROW, np.where(np.isnan(phi), in_plane, phi)))


def of_kind(raw: xr.Dataset, kinds: str | Sequence[str]) -> npt.NDArray[np.intp]:
    """The rows of checked readings that are of one kind, or of several."""
    return np.flatnonzero(np.isin(raw["kind"].values, [kinds] if isinstance(kinds, str) else list(kinds)))
