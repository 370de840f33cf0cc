"""ASTM columns, the form of the Cornell reflectance data (after ASTM E1392): keywords, then one direction per row.

    MATERIAL blue paint
    NUM_POINTS 2
    VARS theta_i,phi_i,theta_s,phi_s,R,G,B
    0.5236,0,0.5236,3.1416,0.11,0.12,0.31
    ..

Angles are in radians. Both directions point away from the surface and their azimuths are from the same axis, so that
the forward direction is at phi_s - phi_i = pi. Columns named like 650nm are wavelengths; others are channels, and a
single column Integrated is a BRDF without a channel. phi_i may be missing.

No public text of this grammar is known; ASTM E2387 is the practice of the measurement. gonio follows the two public
readers, libbsdf (AstmReader.cpp) and ALTA (astm.cpp).
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.text import MOST_VALUES, clip, lines, number, remark_lines
from gonio.files import FormatError
from gonio.formats.format import Format, Holds
from gonio.measured.dataset import ABSOLUTE, add_history, flatten, make_scan, unit

Values = npt.NDArray[np.float64]

ANGLES = ("theta_i", "phi_i", "theta_s", "phi_s")
INTEGRATED = "Integrated"  # the column of a scan without wavelength or channel
DECIMALS = 12  # of a degree: angles survive being written in radians and read again
ROUNDED = 90.01  # deg; pi/2 printed to four digits is a little more than 90 deg
_LARGEST = 12.6  # rad, two turns; a larger number is in degrees, or the file is damaged
_WAVELENGTH = re.compile(r"(\d+(?:\.\d*)?(?:e[+-]?\d+)?)\s*nm", re.IGNORECASE)


def _recognises(head: bytes) -> bool:
    text = re.sub(rb"\r\n?", b"\n", head.removeprefix(b"\xef\xbb\xbf"))
    vars_line = re.search(rb"(?m)^[ \t]*VARS[ \t]+\[?[ \t]*([^\n]*)", text)
    if vars_line:
        names = {name.strip() for name in vars_line[1].split(b",")}
        return {b"theta_i", b"theta_s"} <= names
    return bool(re.match(rb"(?:[A-Z][A-Z0-9_]*[ \t][^\n]*\n\s*)*NUM_POINTS[ \t]+\d+[ \t]*\n", text))


def _read(path: Path) -> xr.Dataset:
    source = lines(path)
    notes, count, names, at = _header(path, source)
    where = f"line {at}"
    angles = [n for n in ANGLES if n in names]
    columns = [n for n in names if n not in ANGLES]
    if missing := [n for n in ("theta_i", "theta_s", "phi_s") if n not in names]:
        raise FormatError(path, f"VARS names no {' and no '.join(missing)}", where)
    if not columns or len(set(names)) < len(names):
        raise FormatError(path, "VARS names no column of values, or one twice", where)
    table, rows = _rows(path, source, names, at)
    if count is not None and count != len(table):
        raise FormatError(path, f"NUM_POINTS promises {count} rows, and the file has {len(table)}", f"line {rows[-1]}")
    by_name = dict(zip(names, table.T, strict=True))
    _check_angles(path, by_name, angles, rows)
    values = np.array([by_name[c] for c in columns])
    if not values.any():
        raise FormatError(path, "every value is zero: the detector saw nothing", f"line {rows[0]}")
    return _scan(by_name, columns, values, notes)


def _header(path: Path, source: Iterator[tuple[int, str]]) -> tuple[list[str], int | None, list[str], int]:
    """The lines before the rows: the remarks, the number of rows, the names of the columns and the line of these."""
    notes: list[str] = []
    count = None
    at = 1
    for at, line in source:
        key, _, rest = line.strip().partition(" ")
        if key == "VARS":
            return notes, count, [n.strip() for n in rest.strip().strip("[]").split(",")], at
        if key == "NUM_POINTS":
            if not rest.strip().isdecimal() or not 0 < int(rest.strip()[:20]) <= MOST_VALUES:
                raise FormatError(path, f"NUM_POINTS is {clip(rest.strip())!r}, not a count of rows", f"line {at}")
            count = int(rest.strip())
        elif line.strip():
            notes.append(line.strip())
    raise FormatError(path, "the file ends before VARS, which names the columns", f"line {at}")


def _rows(path: Path, source: Iterator[tuple[int, str]], names: list[str], at: int) -> tuple[Values, list[int]]:
    """The numbers (row, column) below VARS, and the line of each row."""
    table: list[list[float]] = []
    rows: list[int] = []
    for at, line in source:
        cells = line.split(",")
        if len(cells) != len(names):
            if not line.strip():
                continue
            raise FormatError(path, f"{len(cells)} cells where VARS names {len(names)} columns", f"line {at}")
        try:
            row = list(map(float, cells))
        except ValueError:
            row = [np.nan]
        if "_" in line or not np.isfinite(sum(map(abs, row))):
            row = [number(path, at, c.strip(), n) for c, n in zip(cells, names, strict=True)]
        table.append(row)
        rows.append(at)
    if not table:
        raise FormatError(path, "no rows below VARS", f"line {at}")
    return np.array(table), rows


def _check_angles(path: Path, by_name: dict[str, Values], angles: list[str], rows: list[int]) -> None:
    for name in angles:
        theta = name.startswith("theta")
        low, high = (0.0, np.radians(ROUNDED)) if theta else (-_LARGEST, _LARGEST)
        bad = np.flatnonzero((by_name[name] < low) | (by_name[name] > high))
        if len(bad):
            expected = "0 to pi/2" if theta else f"-{_LARGEST:g} to {_LARGEST:g}"
            message = f"{name} is {by_name[name][bad[0]]:g} rad, outside {expected}"
            raise FormatError(path, message, f"line {rows[bad[0]]}")


def _scan(by_name: dict[str, Values], columns: list[str], values: Values, notes: list[str]) -> xr.Dataset:
    degrees = {n: np.round(np.degrees(v), DECIMALS) for n, v in by_name.items() if n in ANGLES}
    beyond = sum(int(np.count_nonzero(degrees[n] > 90)) for n in ("theta_i", "theta_s"))
    theta_i, theta_r = (np.minimum(degrees[n], 90.0) for n in ("theta_i", "theta_s"))
    phi_i = degrees.get("phi_i", np.zeros(len(theta_i)))
    phi = np.round(degrees["phi_s"] - phi_i, DECIMALS)
    phi = np.where((phi < 0) | (phi > 360), np.round(phi % 360.0, DECIMALS), phi)
    times = len(columns)
    scan = make_scan(
        np.tile(theta_i, times),
        np.tile(theta_r, times),
        values.ravel(),
        np.tile(phi, times),
        phi_i=np.tile(phi_i % 360.0, times) if np.any(phi_i) else None,
        coordinates={n: np.repeat(v, len(theta_i)) for n, v in _sets(columns).items()},
        provenance="\n".join(notes),
    )
    if beyond:
        scan = add_history(scan, f"{beyond} polar angles of pi/2 rounded up in the file read as 90 deg")
    return scan


def _sets(columns: list[str]) -> dict[str, npt.NDArray]:
    """The coordinate that distinguishes the columns of values: wavelength [nm], channel, or none."""
    matches = [_WAVELENGTH.fullmatch(c) for c in columns]
    if all(matches) and all(0 < float(m[1]) < 1e9 for m in matches if m):
        return {"wavelength": np.array([float(m[1]) for m in matches if m])}
    if len(columns) == 1 and columns[0].lower().startswith(INTEGRATED.lower()):
        return {}
    return {"channel": np.array(columns)}


def _write(scan: xr.Dataset, path: Path) -> None:
    if unit(scan) != ABSOLUTE:
        raise ValueError("an ASTM file holds a BRDF in 1/sr, and the scan is relative: calibrate it first")
    flat = flatten(scan)
    if np.isnan(flat["brdf"].values).any():
        raise ValueError(
            "the scan has gaps, and an ASTM file can hold none: leave them out or let gonio.convert fill them"
        )
    columns, parts = _columns(flat)
    rows, values = _aligned(parts)
    angles = {n: rows[n].values if n in rows.coords else np.zeros(rows.sizes["direction"]) for n in ("phi_i", "phi")}
    stored = [rows["theta_i"].values, angles["phi_i"], rows["theta_r"].values, angles["phi"] + angles["phi_i"]]
    table = np.column_stack([*(np.radians(a) for a in stored), *values]).tolist()
    with path.open("w", encoding="utf-8", newline="\n") as file:
        for line in remark_lines(flat.attrs.get("provenance", "")):
            print(f"COMMENT {line}" if line.startswith(("VARS", "NUM_POINTS")) else line, file=file)
        print(f"NUM_POINTS {len(table)}\nVARS {','.join([*ANGLES, *columns])}", file=file)
        file.writelines(",".join(map(repr, row)) + "\n" for row in table)


def _columns(flat: xr.Dataset) -> tuple[list[str], list[xr.Dataset]]:
    """The names of the columns of values, and the rows of each."""
    dimensions = [n for n in ("wavelength", "channel") if n in flat.coords]
    if len(dimensions) > 1:
        raise ValueError("an ASTM file has wavelengths or channels, not both: select one channel")
    if not dimensions:
        return [INTEGRATED], [flat]
    labels = np.broadcast_to(flat[dimensions[0]].values, flat.sizes["direction"])
    keys = list(dict.fromkeys(labels.tolist()))
    names = [f"{k!r}nm" for k in keys] if dimensions == ["wavelength"] else [str(k) for k in keys]
    if bad := [n for n in names if not n.strip() or n != n.strip() or re.search(r"[,\[\]\r\n]", n) or n in ANGLES]:
        raise ValueError(f"{bad[0]!r} is no name that a column of an ASTM file can have: rename the channel")
    if dimensions == ["channel"] and "wavelength" in _sets(names):
        raise ValueError(f"channels named {', '.join(names)} would be read as wavelengths: rename them")
    return names, [flat.isel(direction=np.flatnonzero(labels == k)) for k in keys]


def _aligned(parts: list[xr.Dataset]) -> tuple[xr.Dataset, list[Values]]:
    """The first part, and the values of every part at its directions. Raises ValueError where a part has others."""
    first, *others = parts
    order = _places(first)
    values = [first["brdf"].values]
    for part in others:
        places = _places(part)
        at = {place: k for k, place in enumerate(places)}
        if places == order:
            values.append(part["brdf"].values)
        elif len(at) == len(order) == len(places) and at.keys() == set(order):
            values.append(part["brdf"].values[[at[place] for place in order]])
        else:
            raise ValueError(
                "the channels have different directions, and an ASTM file has one list: gonio.convert, or one a file"
            )
    return first, values


def _places(part: xr.Dataset) -> list[tuple[float, ...]]:
    names = [n for n in ("theta_i", "theta_r", "phi", "phi_i") if n in part.coords]
    return list(zip(*(part[n].values.tolist() for n in names), strict=True))


FORMAT = Format(
    name="astm",
    title="ASTM columns",
    suffix=".astm",
    recognises=_recognises,
    read=_read,
    write=_write,
    holds=Holds(anisotropic=True, sets=("wavelength", "channel")),
)
