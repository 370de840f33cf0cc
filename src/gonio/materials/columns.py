"""Columns of text: wavelength, n and perhaps k, divided by commas, tabs or spaces, under a header or none.

    # any remark
    wavelength_nm,n,k
    632.8,0.2700,3.4081

Sections `wl,n` and `wl,k` one after the other, as refractiveindex.info exports them, are read too. A header without a
unit, and no header at all, mean um, unless a wavelength above 50 makes that doubtful.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

from gonio.files import FormatError
from gonio.materials.curves import EITHER, Curve, joined, number, tabulated
from gonio.materials.material import Material

WAVELENGTH = {"wl", "w", "wavelength", "wavelengths", "lambda", "lam", "λ"}
# The second entry of each pair of one sign is the Greek letter, the first the micro sign.
MICROMETRE = {"um", "µm", "μm", "micron", "microns", "micrometre", "micrometres", "micrometer", "micrometers"}
NANOMETRE = {"nm", "nanometre", "nanometres", "nanometer", "nanometers"}
DOUBTFUL_UM = 50.0  # a larger number without a unit is as likely nm
_LINE_ENDS = re.compile(r"\r\n|\r|\n")  # splitlines would count form feeds, which no editor does
_DIVIDERS = re.compile(r"\s*[,\t]\s*|\s+")
_Rows = list[tuple[int, float, float]]


@dataclass
class _Section:
    """The rows under one header: their wavelengths by um (None: not said), and the columns after it."""

    per_um: float | None
    names: tuple[str, ...]
    rows: dict[str, _Rows] = field(default_factory=dict)


def read(path: Path, text: str) -> Material:
    """A Material from columns of text; FormatError names the line."""
    sections: list[_Section] = []
    remarks: list[str] = []
    for line, raw in enumerate(_LINE_ENDS.split(text), start=1):
        cells = _DIVIDERS.split(raw.strip())
        if cells == [""]:
            continue
        if cells[0].startswith("#"):
            remarks.append("".join(c for c in raw.strip().lstrip("# ") if c.isprintable()))
        elif number(cells[0]) is None and (not sections or _is_header(raw)):
            sections.append(_header(path, line, raw))
        else:
            if not sections:
                sections.append(_unnamed(path, line, cells, remarks))
            _add(path, line, cells, sections[-1])
    if not any(section.rows for section in sections):
        raise FormatError(path, f"holds no row of numbers: {EITHER}")
    return joined(path, _curve(path, sections, "n"), _curve(path, sections, "k"), "", " ".join(remarks))


def _words(text: str) -> list[str]:
    return [word for word in re.split(r"[\W_]+", text.lower()) if word]


def _is_header(text: str) -> bool:
    words = _words(text)
    return bool(words) and words[0] in WAVELENGTH and bool({"n", "k"} & set(words))


def _header(path: Path, line: int, text: str) -> _Section:
    words, where = _words(text), f"line {line}"
    strange = [w for w in words if w not in WAVELENGTH | MICROMETRE | NANOMETRE | {"n", "k"}]
    if strange or not _is_header(text):
        divided = "; divide columns by commas, not semicolons" if ";" in text else ""
        said = f"the header names {strange[0][:40]!r}" if strange else "the header names no wavelength with n or k"
        raise FormatError(path, f"{said}: {EITHER}{divided}", where)
    names = tuple(w for w in words if w in ("n", "k"))
    if len(set(names)) < len(names):
        raise FormatError(path, f"the header names {names[0]} twice: keep one", where)
    units = {1000.0 if w in NANOMETRE else 1.0 for w in words if w in NANOMETRE | MICROMETRE}
    if len(units) > 1:
        raise FormatError(path, "the header names um and nm: keep the unit of the wavelengths", where)
    return _Section(units.pop() if units else None, names)


def _unnamed(path: Path, line: int, cells: list[str], remarks: list[str]) -> _Section:
    """The section of a file that begins with numbers; a header may stand in the remark above, as savetxt writes it."""
    if remarks and _is_header(remarks[-1]):
        return _header(path, line, remarks[-1])
    if len(cells) not in (2, 3):
        raise FormatError(path, f"{len(cells)} columns without a header: {EITHER}", f"line {line}")
    return _Section(None, ("n", "k")[: len(cells) - 1])


def _add(path: Path, line: int, cells: list[str], section: _Section) -> None:
    where = f"line {line}"
    wanted = ("wavelength", *section.names)
    if len(cells) != len(wanted):
        raise FormatError(path, f"{len(cells)} cells where {len(wanted)} are expected: {', '.join(wanted)}", where)
    values = []
    for name, cell in zip(wanted, cells, strict=True):
        value = number(cell)
        if value is None:
            comma = "; write decimals with a point" if ";" in cell else ""
            raise FormatError(path, f"{name} is {cell[:40]!r}, not a finite number{comma}", where)
        values.append(value)
    if section.per_um is None and values[0] > DOUBTFUL_UM:
        what = f"wavelength {values[0]:g} without a unit, um or nm? Name it in the header: wavelength_nm,n,k"
        raise FormatError(path, what, where)
    for name, value in zip(section.names, values[1:], strict=True):
        section.rows.setdefault(name, []).append((line, values[0] / (section.per_um or 1.0), value))


def _curve(path: Path, sections: list[_Section], name: str) -> Curve | None:
    holding = [section.rows[name] for section in sections if name in section.rows]
    if len(holding) > 1:
        raise FormatError(path, f"gives {name} in two sections: keep one", f"line {holding[1][0][0]}")
    return tabulated(path, name, holding[0]) if holding else None
