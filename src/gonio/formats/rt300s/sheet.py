"""Workbooks of the goniometer J&C RT-300S (.xls): one geometry per column, on one or more sheets.

The rows are found by their names in the first column: Method, Date, .., Azimuth, Incidence, Receive [deg], .., RT, then
the spectrum. RT is the signal divided by that of a white diffuser: pi f cos(theta_r). It includes the signal of the
blank until one is subtracted (gonio.reduction.sheets). The azimuth turns the sample relative to the plane of the
receiver: at -90 deg positive receive angles are forward. The public source on the rows are the scripts of LOFT
(bsdf-tools, rt300s_to_bsdf_iso.m; krell2026). door/workbook.py reads the cells.
"""

import datetime
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.text import clip
from gonio.door.workbook import MAGIC, Cell, Cells, sheets
from gonio.files import FormatError
from gonio.formats.format import Format
from gonio.measured.dataset import make_scan

LIMITS = {
    "azimuth": 180.0,
    "incidence": 90.0,
    "receive": 89.99,
    "rt": math.inf,
}  # largest absolute values, of angles [deg]
DESCRIPTIVE_ROWS = ("method", "date", "model id", "technician", "illuminant.", "observer.")
FIRST_DAY = datetime.date(1899, 12, 30)  # day 0 of Excel's calendar, as its days since March 1900 are counted
LAST_DAY = 2_958_465  # 31 December 9999


def direction(azimuth: npt.ArrayLike, receive: npt.ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """theta_r and phi [deg] from the azimuth and receive angles [deg] of the instrument."""
    receive = np.asarray(receive, dtype=float)
    return np.abs(receive), (90.0 - np.asarray(azimuth, dtype=float) - np.where(receive < 0, 180.0, 0.0)) % 360.0


def _read(path: Path) -> xr.Dataset:
    filled = {name: cells for name, cells in sheets(path).items() if cells}
    labels = {name: _labels(cells) for name, cells in filled.items()}
    measured = [name for name, rows in labels.items() if set(LIMITS) <= set(rows)]
    if not measured:
        raise FormatError(
            path, "no sheet has rows Azimuth, Incidence, Receive and RT: this is no workbook of an RT-300S", "byte 0"
        )
    if others := [name for name in filled if name not in measured]:
        lacking = next(label for label in LIMITS if label not in labels[others[0]])
        at = min(cell.at for cell in filled[others[0]].values())
        raise FormatError(
            path, f"the sheet {clip(others[0])!r} has no row {lacking}: delete it or complete it", f"byte {at}"
        )
    columns = [c for name in measured for c in _columns(path, name, filled[name], labels[name])]
    azimuth, incidence, receive, rt = np.array(columns).T
    theta_r, phi = direction(azimuth, receive)
    scan = make_scan(
        incidence,
        theta_r,
        rt / (math.pi * np.cos(np.radians(theta_r))),
        phi,
        variables={"rt": (rt, "1")},
        provenance="\n".join(_provenance(path, [(filled[n], labels[n]) for n in measured])),
        history="\n".join(_history(filled, labels, rt)),
    )
    return scan.assign_attrs(stored="RT, that is pi x BRDF x cos(theta_r), and the blank's signal in it")


def _labels(cells: Cells) -> dict[str, int]:
    """The row of each name in the first column; names in lower case."""
    first_column = ((row, cell.value) for (row, column), cell in cells.items() if column == 0)
    return {value.strip().lower(): row for row, value in first_column if isinstance(value, str)}


def _columns(path: Path, sheet: str, cells: Cells, labels: dict[str, int]) -> Iterator[list[float]]:
    """Azimuth, incidence, receive and RT of each column that has a cell in one of these rows."""
    rows = [labels[name] for name in LIMITS]
    for column in sorted({column for row, column in cells if column and row in rows}):
        yield [_number(path, sheet, cells, labels[name], column, name) for name in LIMITS]


def _number(path: Path, sheet: str, cells: Cells, row: int, column: int, name: str) -> float:
    cell = cells.get((row, column), Cell("", cells[row, 0].at))
    place = f"{name} of column {column + 1} in {clip(sheet)!r}"
    if not isinstance(cell.value, float) or not math.isfinite(cell.value):
        raise FormatError(path, f"{place} is {clip(repr(cell.value))}, not a number", f"byte {cell.at}")
    least = 0.0 if name == "incidence" else -LIMITS[name]
    if not least <= cell.value <= LIMITS[name]:
        message = f"{place} is {cell.value:g} deg, outside {least:g} to {LIMITS[name]:g}"
        raise FormatError(path, message, f"byte {cell.at}")
    return cell.value


def _provenance(path: Path, tables: list[tuple[Cells, dict[str, int]]]) -> Iterator[str]:
    """Lines of provenance: the instrument, and what its rows say. Raises FormatError for a method other than BRDF."""
    yield "instrument: J&C RT-300S"
    for name in DESCRIPTIVE_ROWS:
        texts: dict[str, None] = {}
        for cells, labels in tables:
            row = labels.get(name, -1)
            for column in sorted({c for r, c in cells if r == row and c}):
                text = _day(cells[row, column].value) if name == "date" else str(cells[row, column].value).strip()
                if name == "method" and not text.lower().startswith("brdf"):
                    message = f"the method is {clip(text)!r}, and of the RT-300S only BRDF is known"
                    raise FormatError(path, message, f"byte {cells[row, column].at}")
                texts[" ".join(text.split())] = None
        if listed := [text for text in texts if text]:
            yield f"{name.rstrip('.')}: {clip(', '.join(listed), 200)}"


def _day(value: float | str) -> str:
    if isinstance(value, str) or not 0 < value <= LAST_DAY:
        return "" if isinstance(value, float) else value.strip()
    return (FIRST_DAY + datetime.timedelta(days=int(value))).isoformat()


def _history(filled: dict[str, Cells], labels: dict[str, dict[str, int]], rt: np.ndarray) -> Iterator[str]:
    spectral = set()
    for name, cells in filled.items():
        wavelengths = {row: cell.value for (row, column), cell in cells.items() if column == 0}
        last = labels[name]["rt"]
        spectral |= {wavelengths.get(r) for r, c in cells if c and r > last and isinstance(wavelengths.get(r), float)}
    if len(spectral) > 1:
        yield f"left out the spectra at {len(spectral)} wavelengths beside RT"
    yield "divided RT by pi cos(theta_r); no blank is subtracted"
    if not rt.any():
        yield "every value is zero"


FORMAT = Format(
    name="rt300s",
    title="J&C RT-300S workbook",
    suffix=".xls",
    recognises=lambda head: head.startswith(MAGIC),
    read=_read,
    rank=50,  # every workbook of Excel 97 begins in the same way
)
