"""Raw readings as a table of text: one reading a row, a column for each that `gonio.reduction.readings` declares.

    # fill: under
    kind,theta_i_deg,theta_r_deg,signal_V,sd_V,samples,time_s
    dark,,,0.0012,0.0001,10,0
    sample,30,-60,0.2441,0.0009,10,12

Every column that has a unit carries it in its name. `signal_V`, `_W`, `_A` or `_counts` makes a table one of readings;
`signal` alone is one in any unit, as `gonio import --quantity signal` writes it beside relative values. Lines `# fill:`
and `# signal_net_of_dark:` state what the columns cannot; other lines that begin with # are kept as provenance.
"""

import csv
import math
from pathlib import Path

import numpy as np
import xarray as xr

from gonio.door.text import clip, lines
from gonio.files import FormatError
from gonio.outside import from_cell, nearest
from gonio.reduction.readings import COLUMNS, LINE, NET, REQUIRED, TEXTS, UNITS, make_readings

SUFFIX = {"degree": "deg", "s": "s", "nm": "nm", "degC": "degC"}
STATED = ("fill", NET, "instrument", "operator")  # attributes that lines of the file may give
OF_A_SCAN = "brdf"
SEPARATORS = ",;\t"


def _separated(line: str) -> list[str]:
    """The cells of a line of headings, by whichever separator gives most of them."""
    rows = [next(csv.reader([line], delimiter=mark), []) for mark in SEPARATORS]
    return [cell.strip() for cell in max(rows, key=len)]


def _headings(start: bytes) -> list[str]:
    """The first line that is no remark, as headings in lower case."""
    text = start.decode("utf-8", errors="replace").removeprefix("\ufeff")
    first = next((line for line in text.splitlines() if line.strip() and not line.startswith("#")), "")
    return [name.lower() for name in _separated(first)]


def is_scan_too(start: bytes) -> bool:
    """Whether a table that `recognises` takes holds values in arbitrary units beside its signals: a scan as well."""
    return any(name.startswith(f"{OF_A_SCAN}_") for name in _headings(start))


def recognises(start: bytes) -> bool:
    """Whether the first line that is no remark names a column of signals, and none of a BRDF in 1/sr."""
    names = _headings(start)
    if f"{OF_A_SCAN}_sr-1" in names or not any(name.startswith("theta_i") for name in names):
        return False
    return bool({"signal", *(f"signal_{unit.lower()}" for unit in UNITS)} & set(names))


def read(path: Path) -> xr.Dataset:
    """The readings of a table. Raises FormatError with the line and the remedy."""
    remarks, header, first, rows = _rows(path)
    columns, unit = _columns(path, header, first)
    data: dict[str, list[float | str]] = {name: [] for name in columns.values()}
    at = []
    for number, cells in rows:
        if len(cells) != len(header):
            raise FormatError(path, f"has {len(cells)} cells where the header has {len(header)}", f"line {number}")
        at.append(number)
        for k, name in columns.items():
            data[name].append(_cell(path, number, name, cells[k].strip()))
    if not at:
        raise FormatError(path, "holds a header and no readings", f"line {first}")
    stated = {key: value for key, value in remarks if key in STATED}
    about = "\n".join(f"{key}: {value}" if key else value for key, value in remarks if key not in STATED)
    attrs = {**stated, "provenance": about} | ({NET: int(stated[NET] in ("1", "yes"))} if NET in stated else {})
    try:
        return make_readings({**{n: np.array(v) for n, v in data.items()}, LINE: at}, unit, attrs)
    except ValueError as error:
        where, colon, what = str(error).partition(": ")
        is_line = bool(colon) and where.startswith("line ")
        raise FormatError(path, what if is_line else str(error), where if is_line else f"line {first}") from None


def _rows(path: Path) -> tuple[list[tuple[str, str]], list[str], int, list[tuple[int, list[str]]]]:
    """Remarks as pairs of key and text, the headings with their line, and the rows with theirs."""
    remarks: list[tuple[str, str]] = []
    header: list[str] = []
    first, mark, rows = 1, ",", []
    for number, line in lines(path):
        if line.startswith("#"):
            key, colon, text = line[1:].strip().partition(":")
            remarks.append((key.strip(), text.strip()) if colon else ("", key))
        elif line.strip() and not header:
            header, first = _separated(line), number
            mark = max(SEPARATORS, key=line.count)
        elif line.strip(f"{SEPARATORS} "):
            rows.append((number, next(csv.reader([line], delimiter=mark))))
    return remarks, header, first, rows


def _columns(path: Path, header: list[str], line: int) -> tuple[dict[int, str], str]:
    """The place of each column by its name, and the unit of the signal. Others than those declared are refused."""
    known = {_heading(name): name for name in COLUMNS if name != LINE} | {"signal": "signal"}
    signals = {f"{n}_{unit.lower()}": (n, unit) for n in ("signal", "sd", "monitor") for unit in UNITS}
    found: dict[int, str] = {}
    unit = ""
    for k, cell in enumerate(header):
        lower = cell.lower()
        if lower in signals:
            found[k], own = signals[lower]
            unit = own if found[k] == "signal" else unit
        elif lower in known or lower in TEXTS:
            found[k] = known.get(lower, lower)
        elif not lower.startswith((OF_A_SCAN, "uncertainty")):
            names = [*known, *(f"signal_{u}" for u in UNITS)]
            raise FormatError(path, f"no column {clip(cell)!r} of readings: {nearest(cell, names)}", f"line {line}")
    names = list(found.values())
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise FormatError(path, f"the column {twice[0]} occurs twice: keep one", f"line {line}")
    if missing := [_heading(name) for name in REQUIRED if name not in names]:
        raise FormatError(path, f"has no column {', '.join(missing)}", f"line {line}")
    for k, name in found.items():
        other = header[k].rpartition("_")[2] if "_" in header[k] else ""
        if name == "sd" and unit and other.lower() not in ("", unit.lower()):
            raise FormatError(path, f"{header[k]} is not in the unit of the signal, {unit}", f"line {line}")
    return found, unit or "a.u."


def _heading(name: str) -> str:
    unit = SUFFIX.get(COLUMNS[name].unit)
    return f"{name}_{unit}".lower() if unit else name


def _cell(path: Path, line: int, name: str, text: str) -> float | str:
    if name in TEXTS:
        return from_cell(text) or str(COLUMNS[name].default)
    if not text:
        return math.nan
    if name == "overload" and text.lower() in ("true", "false", "yes", "no"):
        return float(text.lower() in ("true", "yes"))
    try:
        return float(text)
    except ValueError:
        raise FormatError(path, f"{name} is {clip(text)!r}, not a number", f"line {line}") from None
