"""The readings of a journal as a Dataset, one row a reading: what a reduction takes."""

import math
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.acquisition.journal import Content, read_journal

ROW = "reading"
# Attribute of the Dataset by what a bench calls it; whatever else the bench states goes there under its own name.
TEXTS = ("kind", "range", "filter", "polarisation")


def readings(journal: str | Path | Content) -> xr.Dataset:
    """Every reading of a journal, by its path or as `read_journal` gives it, along the dimension `reading`.

    Variables: kind; theta_i, theta_r (from 0 on) and phi [deg] from positions read back, NaN for kinds without a
    direction; signal and sd of its samples [the detector's unit]; samples; dwell [s]; range and filter (names);
    monitor; temperature [degC]; time [s since the first]; overload (1 or 0); attempt, which counts from 0 within one
    step; wavelength [nm] where it is stated; polarisation; session, which counts how often the measurement was taken up
    again: drift is not to be bridged from one to the next. Attempts that were repeated are there too: the last one
    counts. Those that gave no number are not, and the attribute `readings_without_a_number` counts them.
    Attributes: those of the bench's instrument, `plan_sha256`, `start_utc`, and `history`.
    Raises FormatError for a file that is no journal, ValueError for one without readings or with several units.
    """
    content = journal if isinstance(journal, Content) else read_journal(journal)
    taken = [record for record in content.records if "kind" in record]
    rows = [record for record in taken if record["value"] is not None]
    if not rows:
        raise ValueError("the journal holds no reading yet")
    units = {record["unit"] for record in rows}
    if len(units) > 1:
        raise ValueError(f"the readings are in several units ({', '.join(sorted(units))}): measure them apart")
    (unit,) = units
    data = xr.Dataset(
        {
            name: (ROW, values, {"units": units_of} if units_of else {})
            for name, (values, units_of) in _columns(content, rows, unit).items()
        },
        attrs=_attributes(content, rows),
    )
    if len(rows) < len(taken):
        data.attrs["readings_without_a_number"] = len(taken) - len(rows)
    return data


def _columns(content: Content, rows: list[dict[str, Any]], unit: str) -> dict[str, tuple[npt.NDArray[Any], str]]:
    directions = np.array([record["direction"] or (math.nan,) * 3 for record in rows], dtype=float)
    conditions = content.plan.conditions
    columns: dict[str, tuple[npt.NDArray[Any], str]] = {
        "kind": (np.array([record["kind"] for record in rows]), ""),
        "theta_i": (directions[:, 0], "degree"),
        "theta_r": (directions[:, 1], "degree"),
        "phi": (directions[:, 2], "degree"),
        "signal": (_numbers(rows, "value"), unit),
        "sd": (_numbers(rows, "sd"), unit),
        "samples": (_numbers(rows, "n"), "1"),
        "dwell": (_numbers(rows, "dwell"), "s"),
        "range": (np.array([f"{record['range']:g}" for record in rows]), ""),
        "filter": (np.array([record["filter"] for record in rows]), ""),
        "monitor": (_numbers(rows, "monitor"), "1"),
        "temperature": (_numbers(rows, "temperature"), "degC"),
        "time": (_numbers(rows, "t_utc") - rows[0]["t_utc"], "s"),
        "overload": (np.array([float(bool(record["overload"])) for record in rows]), "1"),
        "attempt": (_attempts(rows), "1"),
        "session": (_numbers(rows, "session"), "1"),
        "polarisation": (np.full(len(rows), conditions.polarisation), ""),
    }
    if conditions.wavelength is not None:
        columns["wavelength"] = np.full(len(rows), conditions.wavelength), "nm"
    return columns


def _numbers(rows: list[dict[str, Any]], name: str) -> npt.NDArray[np.float64]:
    return np.array([math.nan if record[name] is None else record[name] for record in rows], dtype=float)


def _attempts(rows: list[dict[str, Any]]) -> npt.NDArray[np.float64]:
    """Counted anew among the readings that gave a number: from 0 at each step, and at each range of a dark."""
    counts: list[float] = []
    for k, record in enumerate(rows):
        goes_on = k > 0 and record["attempt"] > rows[k - 1]["attempt"]
        counts.append(counts[-1] + 1 if goes_on and _same(record, rows[k - 1]) else 0.0)
    return np.array(counts)


def _same(record: Mapping[str, Any], before: Mapping[str, Any]) -> bool:
    return all(record[name] == before[name] for name in ("step", "session", "kind"))


def _attributes(content: Content, rows: list[dict[str, Any]]) -> dict[str, Any]:
    stated = {name: value for name, value in content.head.get("instrument", {}).items() if _is_plain(value)}
    start = datetime.fromtimestamp(rows[0]["t_utc"], UTC).isoformat(timespec="seconds")
    return {
        **stated,
        "plan_sha256": content.plan.sha256,
        "start_utc": start,
        "history": f"measured from {start} on in {content.sessions} sessions, {len(rows)} readings",
    }


def _is_plain(value: Any) -> bool:
    return isinstance(value, str | int | float) and not isinstance(value, bool)
