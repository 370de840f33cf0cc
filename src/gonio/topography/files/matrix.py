"""Heights as a matrix of numbers: in text, one row a line, and as an array of NumPy (.npy).

Text may begin with lines of remarks (#). Gwyddion writes into them the size of the field and the unit of the heights;
other matrices say neither, and whoever reads them gives both.
"""

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from gonio.door.containers import npy
from gonio.door.rows import Rows
from gonio.door.text import clip, lines, remark_lines
from gonio.files import FormatError
from gonio.options import one_of
from gonio.topography.heights import Grid

UNITS = {"m": 1e6, "mm": 1e3, "um": 1.0, "µm": 1.0, "μm": 1.0, "nm": 1e-3, "pm": 1e-6}  # um
NAMES = ("m", "mm", "um", "nm", "pm")  # as they are asked for
GAPS = {"nan", "bad", "nm", "na", "--", "---"}  # how a missing point is written
SEPARATORS = re.compile(r"[,;\t ]")
LONGEST_LINE = 2**21  # bytes
SIDE = re.compile(r"(Width|Height):\s*([0-9.eE+-]+)\s*(\S+)")
MOST_COLUMNS = 100_000


@dataclass(frozen=True)
class Stated:
    """What is known of a file that does not say it: pitch along x and y [um], 0 for none; unit of its heights."""

    dx: float = 0.0
    dy: float = 0.0
    unit: str = ""

    def __post_init__(self) -> None:
        if self.unit and self.unit not in UNITS:
            raise ValueError(f"the unit of heights {self.unit!r} is not known: give {one_of(NAMES)}")
        if not all(np.isfinite(step) and step >= 0 for step in (self.dx, self.dy)):
            raise ValueError(f"a pitch of {self.dx:g} x {self.dy:g} um is none: give a number above 0")

    def grid(self, z: np.ndarray, path: Path, place: str, provenance: str, own: "Stated") -> Grid:
        """The heights in um, with what is stated, or else what the file itself says, `own`.

        Raises FormatError where neither says the pitch.
        """
        dx, dy = (self.dx or own.dx), (self.dy or self.dx or own.dy)
        if not dx:
            what = "does not say how far its points are apart: give the pitch in um (pitch=0.5, --pitch 0.5)"
            raise FormatError(path, what, place)
        with np.errstate(over="ignore", invalid="ignore"):
            return Grid(z * UNITS[self.unit or own.unit or "um"], dx, dy, place, provenance)


def is_array(head: bytes) -> bool:
    """Whether a file that begins with these bytes is an array of NumPy."""
    return head.startswith(npy.MAGIC)


def read_array(path: Path, stated: Stated) -> Grid:
    """The heights of an array of NumPy. Raises FormatError with the byte."""
    stored = npy.read(path)
    if stored.ndim != 2:
        raise FormatError(path, f"holds an array of {stored.ndim} dimensions, and a map has two", "byte 8")
    with np.errstate(invalid="ignore"):  # of damaged bytes, which may be signalling NaN
        z = np.array(stored, dtype=float)
    return stated.grid(z, path, "byte 8", "", Stated())


def is_text(head: bytes) -> bool:
    """Whether the first line of a file that is no remark begins with a number."""
    if b"\0" in head:
        return False
    text = head.decode("utf-8", "replace").lstrip("\ufeff")
    for line in text.splitlines():
        if line.strip() and not line.lstrip().startswith("#"):
            first = next((word for word in SEPARATORS.split(line.strip()) if word), "")
            return bool(re.match(r"[+-]?\.?[0-9]", first)) or first.lower() in GAPS
    return False


def read_text(path: Path, stated: Stated) -> Grid:
    """The heights of a matrix in text, separated by commas, semicolons, tabs or spaces. FormatError with the line."""
    rows, remarks, separator, first = None, list[str](), "", 1
    for line, text in lines(path, longest=LONGEST_LINE):
        if text.lstrip().startswith("#"):
            remarks.append(text.lstrip("# \t"))
            continue
        if not text.strip():
            continue
        if rows is None:
            separator, first = _separator(text), line
        words = [word.strip() for word in text.strip().rstrip(separator.strip()).split(separator or None)]
        words = ["nan" if not word or word.lower() in GAPS else word for word in words]
        if rows is None:
            if len(words) > MOST_COLUMNS:
                raise FormatError(path, f"has {len(words)} columns, more than {MOST_COLUMNS}", f"line {line}")
            names = [f"the height in column {k + 1}" for k in range(len(words))]
            rows = Rows(path, names, gaps=names)
        rows.add(line, words)
    if rows is None:
        raise FormatError(path, "holds no rows of heights", "line 1")
    z = rows.table()[1]
    own = _said(path, remarks, z.shape)
    return stated.grid(z, path, f"line {first}", "\n".join(remark_lines("\n".join(remarks))), own)


def _separator(text: str) -> str:
    """What separates the numbers of a line; empty for white space."""
    return next((mark for mark in (";", "\t", ",") if mark in text.strip()), "")


def _said(path: Path, remarks: list[str], shape: tuple[int, ...]) -> Stated:
    """What the remarks of Gwyddion say: Width and Height of the field, and `Value units`."""
    found: dict[str, float] = {}
    unit = ""
    for remark in remarks:
        if match := SIDE.fullmatch(remark.strip()):
            found[match[1]] = _length(path, match[2], match[3])
        elif remark.strip().startswith("Value units:"):
            unit = remark.partition(":")[2].strip()
            if unit not in UNITS:
                raise FormatError(path, f"values are in {clip(unit)!r}, and heights are lengths", "line 1")
    if set(found) != {"Width", "Height"}:
        return Stated(unit=unit)
    return Stated(found["Width"] / shape[1], found["Height"] / shape[0], unit)


def _length(path: Path, text: str, unit: str) -> float:
    try:
        value = float(text) * UNITS[unit]
    except (ValueError, KeyError):
        value = 0.0
    if not (np.isfinite(value) and value > 0):
        raise FormatError(path, f"{clip(f'{text} {unit}')!r} is no width of a field", "line 1")
    return value
