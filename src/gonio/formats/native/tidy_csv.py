"""gonio's tidy CSV: one geometry per row, a unit in the name of every column that has one, `#` lines first.

    # material: aluminium
    theta_i_deg,theta_r_deg,wavelength_nm,brdf_sr-1,uncertainty_sr-1
    30,-80,633,0.0241,0.0003

docs/conventions.md lists the columns. theta_r is signed (positive forward) unless there is a column of azimuths:
phi_deg, or phi_r_deg, from which phi_i_deg is taken away. `brdf_a.u.` marks relative data; a column `dolp` in the place
of the BRDF holds degrees of polarisation, and `uncertainty_dolp` their uncertainty. Other usual names are understood. A
column that is not understood is kept as a further variable. But one in a unit of angle or length is refused, because it
may be a direction, unless a line `# further columns: NAME, NAME` says that it is none.

A table whose headings state all of this in another way (`Theta_i [deg]`, tabs, decimal commas) is read too, with the
mapping in its history. Any other table is refused with the `gonio import` that reads it (docs/tables.md).
"""

import csv
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.door.text import clip, lines
from gonio.files import FormatError
from gonio.formats.format import Format, Holds
from gonio.formats.native.tidy_columns import (
    EXAMPLE,
    FURTHER,
    OF_DIRECTIONS,
    QUANTITIES,
    REFLECTED_AZIMUTH,
    Column,
    columns_of,
    heading,
)
from gonio.measured.causes import SYSTEMATIC, gathered, spread
from gonio.measured.dataset import (
    DIRECTIONS,
    SETS,
    flatten,
    is_in_plane,
    make_scan,
    signed_theta_r,
)
from gonio.outside import as_cell, from_cell
from gonio.tables.direct import read_stated

MOST_BAD_ROWS = 1_000  # after so many the file is not read further
MOST_MASK = 127  # the largest number of a signed byte
_HISTORY = "history: "


def _read(path: Path) -> xr.Dataset:
    source = lines(path)
    comments, header_line, header = _header(path, source)
    try:
        columns = columns_of(path, header_line, header, _further(comments))
    except FormatError as error:
        if any(cell.lower().startswith(f"{SYSTEMATIC}[") for cell in header):  # which no other table has
            raise
        return read_stated(path, error)
    cells, rows = _rows(path, header_line, source, columns)
    return _dataset(path, comments, columns, cells, rows)


def read_directions(path: Path) -> xr.Dataset | None:
    """The directions of a tidy CSV without values, as coordinates; None for a file that is none.

    Raises FormatError for such a file with bad rows.
    """
    source = lines(path)
    try:
        comments, header_line, header = _header(path, source)
        columns = columns_of(path, header_line, header, _further(comments), ("theta_i", "theta_r"))
    except FormatError:
        return None
    if "brdf" in {column.name for column in columns}:
        return None
    cells, rows = _rows(path, header_line, source, columns)
    placed = _dataset(path, comments, [*columns, Column("brdf", "sr-1")], [*cells, [1.0] * len(rows)], rows)
    return placed.drop_vars(list(placed.data_vars))


def _header(path: Path, source: Iterator[tuple[int, str]]) -> tuple[list[str], int, list[str]]:
    comments, last = [], 1
    for number, line in source:
        last = number if line else last
        if line.startswith("#"):
            comments.append(line[1:].removeprefix(" "))
        elif line.strip():
            return comments, number, [cell.strip() for cell in next(csv.reader([line]))]
    message = f"holds no header: the first line after the # lines must be like {EXAMPLE}"
    raise FormatError(path, message, f"line {last}")


def _further(comments: list[str]) -> set[str]:
    """The columns that a line of the file says are meant to be further variables."""
    lists = [c.removeprefix(FURTHER) for c in comments if c.startswith(FURTHER)]
    return {name.strip() for text in lists for name in text.split(",")}


def _rows(
    path: Path, header_line: int, source: Iterator[tuple[int, str]], columns: list[Column]
) -> tuple[list[list[float | str]], list[int]]:
    """The cells by column, and the line of each row. Raises one FormatError that lists the bad rows."""
    cells: list[list[float | str]] = [[] for _ in columns]
    rows: list[int] = []
    bad: list[tuple[int, str]] = []
    signed = all(column.name not in ("phi", REFLECTED_AZIMUTH) for column in columns)
    for number, line in source:
        if not line.strip() or line.startswith("#"):
            continue
        row = next(csv.reader([line]))
        if not any(cell.strip() for cell in row):  # as spreadsheets leave them at the end
            continue
        values, problem = _cells(row, columns, signed)
        if problem:
            bad.append((number, problem))
            if len(bad) == MOST_BAD_ROWS:
                break
            continue
        rows.append(number)
        for store, value in zip(cells, values, strict=True):
            store.append(value)
    if bad:
        raise FormatError(path, _listed(bad) + "; correct or delete these rows", f"line {bad[0][0]}")
    if not rows:
        raise FormatError(path, "holds a header and no rows", f"line {header_line}")
    return cells, rows


def _cells(row: list[str], columns: list[Column], signed: bool) -> tuple[list[float | str], str]:
    """The values of one row, and a message where something is wrong with it."""
    if len(row) != len(columns):
        return [], f"{len(row)} cells where the header has {len(columns)}"
    values: list[float | str] = []
    for text, column in zip(row, columns, strict=True):
        value, problem = _cell(text.strip(), column, signed)
        if problem:
            return [], problem
        values.append(value)
    return values, ""


def _cell(text: str, column: Column, signed: bool) -> tuple[float | str, str]:
    if not column.is_number:
        return from_cell(text), ""
    try:
        if "_" in text:  # float accepts 1_000, which no instrument writes
            raise ValueError
        value = float(text) * column.scale if text else math.nan
    except ValueError:
        return "", f"{column.name} is {clip(text)!r}, not a number"
    if math.isinf(value) or (
        math.isnan(value) and column.name in (*DIRECTIONS, REFLECTED_AZIMUTH, "wavelength", "mask")
    ):
        return "", f"{column.name} is {clip(text) or 'empty'}"
    if column.name in ("theta_i", "theta_r"):
        lowest = -90 if column.name == "theta_r" and signed else 0
        if not lowest <= value <= 90:
            return "", f"{column.name} is {value:g} deg, outside {lowest} to 90"
    if column.name == "mask" and not 0 <= value <= MOST_MASK:
        return "", f"mask is {value:g}, outside 0 to {MOST_MASK}"
    if column.name == "wavelength" and value <= 0:
        return "", f"wavelength is {value:g} nm, not positive"
    return value, ""


def _listed(bad: list[tuple[int, str]], most: int = 5) -> str:
    first = bad[0][1]
    rest = "".join(f"; line {number}: {problem}" for number, problem in bad[1:most])
    more = f"; and {len(bad) - most} more bad rows" if len(bad) > most else ""
    return first + rest + (" at least" + more if len(bad) == MOST_BAD_ROWS else more)


def _dataset(
    path: Path, comments: list[str], columns: list[Column], cells: list[list[float | str]], rows: list[int]
) -> xr.Dataset:
    by_name = {column.name: np.array(values) for column, values in zip(columns, cells, strict=True)}
    units = {column.name: column.cf_unit for column in columns}
    if not np.any(np.nan_to_num(by_name["brdf"])):
        raise FormatError(
            path, "every brdf value is zero: the detector saw nothing, or the column is wrong", f"line {rows[0]}"
        )
    history = [c.removeprefix(_HISTORY) for c in comments if c.startswith(_HISTORY)]
    if REFLECTED_AZIMUTH in by_name:
        phi_i = by_name.get("phi_i")
        by_name["phi"] = (by_name.pop(REFLECTED_AZIMUTH) - (0.0 if phi_i is None else phi_i)) % 360.0
        source = "the azimuth of the source, 0, as the file names none" if phi_i is None else "phi_i"
        history.append(f"took phi as the azimuth of the detector less {source}")
    known = {*DIRECTIONS, "brdf", "uncertainty", *SETS}
    variables = {name: (_numbers_if_all(v), units[name]) for name, v in by_name.items() if name not in known}
    if "mask" in variables:
        variables["mask"] = (by_name["mask"].astype(np.int8), "1")
    scan = make_scan(
        by_name["theta_i"],
        by_name["theta_r"],
        by_name["brdf"],
        by_name.get("phi"),
        phi_i=by_name.get("phi_i"),
        uncertainty=by_name.get("uncertainty"),
        unit=units["brdf"],
        coordinates={name: by_name[name] for name in SETS if name in by_name},
        variables=variables | {"line": (np.array(rows), "1")},
        provenance="\n".join(c for c in comments if not c.startswith((_HISTORY, FURTHER))),
        history="\n".join(history),
    )
    try:
        return gathered(scan)
    except ValueError as error:
        raise FormatError(path, str(error), f"line {rows[0]}") from None


def _numbers_if_all(values: np.ndarray) -> np.ndarray:
    try:
        return values.astype(float)
    except ValueError:
        return values


def _write(scan: xr.Dataset, path: Path) -> None:
    flat = spread(flatten(scan))
    names = [n for n in (*DIRECTIONS, *SETS, "brdf", "uncertainty") if n in flat.variables]
    columns = {name: flat[name].values for name in names}
    if is_in_plane(flat).all():
        columns["theta_r"] = signed_theta_r(flat)
        del columns["phi"]
    columns |= {str(name): v.values for name, v in flat.data_vars.items() if name not in (*names, "line")}
    with path.open("w", encoding="utf-8", newline="") as file:
        for line in flat.attrs.get("provenance", "").splitlines():
            file.write(f"# {line}\n")
        for line in flat.attrs.get("history", "").splitlines():
            file.write(f"# {_HISTORY}{line}\n")
        headings = {name: heading(name, flat) for name in columns}
        if further := [h for name, h in headings.items() if h.endswith(OF_DIRECTIONS) and name not in QUANTITIES]:
            file.write(f"# {FURTHER}{', '.join(further)}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(headings.values())
        writer.writerows(zip(*map(_cells_of, columns.values()), strict=True))


def _cells_of(values: np.ndarray) -> list[Any]:
    """The cells of a column; texts so that a spreadsheet runs none of them as a formula."""
    cells: list[Any] = values.tolist()
    for cell in dict.fromkeys(c for c in cells if isinstance(c, str)):
        if cell != cell.strip() or not set(cell).isdisjoint("\n\r\0"):
            raise ValueError(
                f"{cell!r} cannot be a cell of a CSV file, with a blank at an end or a line break: rename it"
            )
    return [as_cell(cell) if isinstance(cell, str) else cell for cell in cells]


FORMAT = Format(
    name="tidy-csv",
    title="tidy CSV",
    suffix=".csv",
    recognises=lambda head: True,  # no signature: asked last, and its errors say what is missing
    read=_read,
    write=_write,
    holds=Holds(anisotropic=True, transmission=True, relative=True, gaps=True, sets=SETS, variables=("*",)),
    rank=100,
)
