"""ISO 25178-71 surface data files (.sdf), in text (aISO-1.0) and binary (bISO-1.0); lengths in metres."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gonio.door.binary import Bytes
from gonio.door.rows import Rows
from gonio.door.text import MOST_VALUES, clip, head, lines, number, remark_lines
from gonio.files import FormatError
from gonio.topography.heights import Grid

TEXT, BINARY = b"aISO-1.0", b"bISO-1.0"
UM = 1e6  # um in a metre
# DataType: how the numbers are stored, and the number that stands for a missing point, where there is one.
TYPES = {
    0: ("<u1", None),
    1: ("<u2", 2**16 - 1),
    2: ("<u4", 2**32 - 1),
    3: ("<f4", None),
    4: ("<i1", None),
    5: ("<i2", -(2**15)),
    6: ("<i4", -(2**31)),
    7: ("<f8", None),
}
NEEDED = ("NumPoints", "NumProfiles", "Xscale", "Yscale", "Zscale", "DataType")
BAD = {"BAD", "NM", "NAN"}  # how a missing point is written in text
END = "*"
LONGEST_LINE = 2**21  # bytes: a profile of 100 000 points on one line
MOST_HEADER = 1000  # lines


def recognises(start: bytes) -> bool:
    """Whether a file that begins with these bytes is one."""
    return start.startswith(BINARY) or start.lstrip(b"\xef\xbb\xbf \t\r\n").startswith(TEXT)


def read(path: Path) -> Grid:
    """The heights of a file. Raises FormatError with the line or the byte."""
    return _binary(path) if head(path, len(BINARY)) == BINARY else _text(path)


def _text(path: Path) -> Grid:
    numbered = lines(path, longest=LONGEST_LINE)
    header, end = _header(path, numbered)
    if missing := [name for name in NEEDED if name not in header]:
        raise FormatError(path, f"the header does not say {missing[0]}", f"line {end}")
    counts = {name: _count(path, name, *header[name]) for name in ("NumPoints", "NumProfiles")}
    scales = {name: number(path, header[name][0], header[name][1], name) for name in ("Xscale", "Yscale", "Zscale")}
    packing = header.get("Compression", (end, "0"))
    if packing[1] not in ("0", ""):
        raise FormatError(path, "is compressed, as only its maker reads it: save it without", f"line {packing[0]}")
    columns, total = counts["NumPoints"], counts["NumPoints"] * counts["NumProfiles"]
    if total > MOST_VALUES:
        place = f"line {header['NumPoints'][0]}"
        raise FormatError(path, f"promises {total} heights, more than {MOST_VALUES}: cut out a part", place)
    rows = Rows(path, ["a height"], gaps=["a height"])
    last = _heights(path, numbered, rows, total, end)
    z = rows.table()[1].reshape(-1, columns) * (scales["Zscale"] * UM) if total else np.empty((0, 0))
    said = "\n".join(f"{name}: {value}" for name, (_, value) in header.items())
    trailer = "\n".join(remark_lines("\n".join(last)))
    return Grid(
        z, scales["Xscale"] * UM, scales["Yscale"] * UM, f"line {header['Xscale'][0]}", f"{said}\n{trailer}".strip()
    )


def _header(path: Path, numbered: Iterator[tuple[int, str]]) -> tuple[dict[str, tuple[int, str]], int]:
    """The entries up to the first `*` by name, each with its line; and the line of the `*`."""
    header: dict[str, tuple[int, str]] = {}
    line = 1
    for line, text in numbered:
        words = text.strip()
        if words == END:
            return header, line
        if line > MOST_HEADER:
            raise FormatError(path, f"the header has no end (a line with *) within {MOST_HEADER} lines", f"line {line}")
        name, equals, value = words.partition("=")
        if equals:
            header[name.strip()] = (line, value.strip())
        elif words and words.encode("ascii", "replace") != TEXT:
            raise FormatError(path, f"{clip(words)!r} is no entry of a header, name = value", f"line {line}")
    raise FormatError(path, "ends within its header, before the line with *", f"line {line}")


def _count(path: Path, name: str, line: int, text: str) -> int:
    if not re.fullmatch(r"\+?[0-9]{1,9}", text) or not int(text):
        raise FormatError(path, f"{name} is {clip(text)!r}, not a number of points", f"line {line}")
    return int(text)


def _heights(path: Path, numbered: Iterator[tuple[int, str]], rows: Rows, total: int, line: int) -> list[str]:
    """Add so many heights to the rows; the lines after the `*` that follows them."""
    found = 0
    for line, text in numbered:
        words = text.split()
        if words == [END]:
            break
        found += len(words)
        if found > total:
            raise FormatError(path, f"holds more than the {total} heights that the header promises", f"line {line}")
        for word in words:
            rows.add(line, ["nan" if word.upper() in BAD else word])
    if found < total:
        raise FormatError(path, f"holds {found} of the {total} heights that the header promises", f"line {line}")
    return [text for _, text in numbered if text.strip() != END]


def _binary(path: Path) -> Grid:
    data = Bytes(path)
    data.array(np.uint8, (len(BINARY),), "the signature")
    named = [data.array(np.uint8, (length,), "the header").tobytes() for length in (10, 12, 12)]
    at = data.at
    columns, rows = (data.number("<u2", name) for name in ("NumPoints", "NumProfiles"))
    scale_at = data.at
    dx, dy, dz, _ = data.array("<f8", (4,), "the scales").tolist()
    packed, kind, _ = (int(b) for b in data.array(np.uint8, (3,), "the kind of the data"))
    if not np.isfinite([dx, dy, dz]).all():
        raise data.wrong("a scale is not a finite number", scale_at)
    if packed:
        raise data.wrong("is compressed, as only its maker reads it: save it without", scale_at + 32)
    if kind not in TYPES:
        raise data.wrong(f"DataType is {kind}, and 0 to 7 are known", scale_at + 33)
    if not columns or not rows:
        raise data.wrong(f"has {columns} points in each of {rows} profiles", at)
    dtype, missing = TYPES[kind]
    stored = data.array(dtype, (rows, columns), f"the {rows} profiles of {columns} points")
    with np.errstate(over="ignore", invalid="ignore"):
        z = stored.astype(float) * (dz * UM)
    if missing is not None:
        z[stored == missing] = np.nan
    words = (raw.decode("latin-1").strip(" \0") for raw in named)
    said = dict(zip(("ManufacID", "CreateDate", "ModDate"), words, strict=True))
    provenance = "\n".join(f"{name}: {value}" for name, value in said.items() if value)
    return Grid(z, dx * UM, dy * UM, f"byte {at}", provenance)
