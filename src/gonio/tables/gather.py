"""The cells of a table as arrays, one entry for each value, whatever the layout."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from gonio.door.text import clip
from gonio.tables import vocabulary as v
from gonio.tables.columns import FURTHER, Column, columns, values_of
from gonio.tables.layouts import MATRIX, Part
from gonio.tables.matrix import Axes, axes
from gonio.tables.request import Asker
from gonio.tables.source import Cell

MOST_SHOWN = 5  # bad rows in a message
NEEDED = (*v.ANGLES, "wavelength")  # a row without these is no row


@dataclass(frozen=True)
class Source:
    """Where a target comes from, as the mapping shows it: a column or a line, its unit, and what else it says."""

    target: str
    text: str
    unit: str = ""
    quantity: str = ""
    coverage: float = 1.0
    of: str = ""
    is_relative: bool = False
    mode: str = ""
    key: str = ""  # how --columns names it; empty where it is no column

    @property
    def kind(self) -> str:
        """The kind of the unit; empty where none is stated."""
        return v.UNITS[self.unit].kind if self.unit else ""


@dataclass
class Gathered:
    """Arrays (values,) by target, as they stand in the table; further variables; and the sources of each."""

    data: dict[str, np.ndarray] = field(default_factory=dict)
    further: dict[str, np.ndarray] = field(default_factory=dict)
    lines: np.ndarray = field(default_factory=lambda: np.array([], dtype=np.int64))
    sources: dict[str, Source] = field(default_factory=dict)
    ignored: list[str] = field(default_factory=list)


def gathered(parts: list[Part], asker: Asker) -> Gathered:
    """All tables as one. Raises FormatError where they are not of one kind."""
    some = [_of_matrix(part, asker) if part.kind == MATRIX else _of_long(part, asker) for part in parts]
    first = some[0]
    for part, other in zip(parts[1:], some[1:], strict=True):
        unlike = set(first.data) ^ set(other.data) | set(first.further) ^ set(other.further)
        units = {t for t in first.sources if t in other.sources and not _alike(first.sources[t], other.sources[t])}
        if unlike or units:
            named = ", ".join(sorted(unlike or units))
            raise asker.wrong(f"this table and the first of the file differ in {clip(named, 100)}", part.line)
    if len(some) == 1:
        return first
    return Gathered(
        {name: np.concatenate([one.data[name] for one in some]) for name in first.data},
        {name: _concatenated([one.further[name] for one in some]) for name in first.further},
        np.concatenate([one.lines for one in some]),
        {t: s if t not in parts[0].constants else _several(t, s, parts) for t, s in first.sources.items()},
        first.ignored,
    )


def _alike(one: Source, other: Source) -> bool:
    return (one.unit, one.quantity, one.coverage, one.of) == (other.unit, other.quantity, other.coverage, other.of)


def _several(target: str, source: Source, parts: list[Part]) -> Source:
    texts = list(dict.fromkeys(part.constants[target].text for part in parts if target in part.constants))
    shown = ", ".join(repr(clip(t)) for t in texts[:3]) + (" .." if len(texts) > 3 else "")
    return Source(target, f"the lines {shown}" if len(texts) > 1 else source.text, source.unit)


def _concatenated(arrays: list[np.ndarray]) -> np.ndarray:
    if len({a.dtype.kind for a in arrays}) > 1:
        arrays = [a.astype(str) for a in arrays]
    return np.concatenate(arrays)


def _of_long(part: Part, asker: Asker) -> Gathered:
    found = columns(part, asker)
    part.rows = [row for row in part.rows if row.filled]
    values = list(values_of(found))
    out = Gathered(lines=np.tile([row.line for row in part.rows], len(values)))
    repeats = len(values)
    for c in found:
        if c.target in v.VALUES or c.target in v.UNCERTAINTIES:
            continue
        if c.target == v.IGNORE:
            out.ignored.append(c.name)
        elif c.target == FURTHER:
            out.further[_unused(c, out.further)] = np.tile(_numbers_or_texts(part.column(c.place)), repeats)
        elif c.target in v.TEXTS:
            out.data[c.target] = np.tile(_texts(part.column(c.place)), repeats)
            out.sources[c.target] = source_of(c)
        else:
            out.data[c.target] = np.tile(_numbers(part, c, asker), repeats)
            out.sources[c.target] = source_of(c)
    out.data["brdf"] = np.concatenate([_numbers(part, c, asker) for c in values])
    out.sources["brdf"] = _of_values(values, part, asker)
    _add_sets(out, values, len(part.rows))
    _add_uncertainties(out, part, [c for c in found if c.target in v.UNCERTAINTIES], values, asker)
    _add_constants(out, part)
    return out


def source_of(column: Column, text: str = "") -> Source:
    """What a column says of its target."""
    heading = column.heading
    return Source(
        column.target,
        text or f"column {column.name}",
        heading.unit,
        "signal" if column.target == "signal" else heading.quantity,
        heading.coverage,
        column.of,
        heading.is_relative,
        heading.mode if column.target == "brdf" else "",
        column.key,
    )


def _of_values(values: list[Column], part: Part, asker: Asker) -> Source:
    """The one source of all columns of values, which must agree in unit and quantity."""
    first = source_of(values[0])
    for other in values[1:]:
        if (other.heading.unit, other.heading.quantity) != (first.unit, values[0].heading.quantity):
            what = f"the columns {values[0].name} and {other.name} are of two units or quantities"
            raise asker.wrong(f"{what}: name those of one by --values", part.line)
    if len(values) == 1:
        return first
    shown = ", ".join(c.name for c in values[:4]) + (" .." if len(values) > 4 else "")
    return source_of(values[0], f"columns {shown}")


def _add_sets(out: Gathered, values: list[Column], rows: int) -> None:
    """The wavelength or the channel of each column of values, where the headings state it."""
    if values[0].heading.wavelength is not None:
        out.data["wavelength"] = np.repeat([c.heading.wavelength or 0.0 for c in values], rows)
        out.sources["wavelength"] = Source("wavelength", "the headings of the values", "nm")
    elif values[0].channel:
        out.data["channel"] = np.repeat([c.channel for c in values], rows)
        out.sources["channel"] = Source("channel", "the headings of the values")


def _add_uncertainties(out: Gathered, part: Part, found: list[Column], values: list[Column], asker: Asker) -> None:
    for target in v.UNCERTAINTIES:
        mine = {c.heading.wavelength: c for c in found if c.target == target}
        if not mine:
            continue
        chosen = [mine.get(value.heading.wavelength, mine.get(None)) for value in values]
        first = next(iter(mine.values()))
        if None in mine and len(values) > 1 and not (first.heading.is_relative or first.heading.kind == v.PERCENT):
            what = f"the one column {first.name} cannot be the uncertainty of {len(values)} columns of values"
            raise asker.wrong(f"{what}, unless it is in percent", part.line)
        blank = np.full(len(part.rows), np.nan)
        out.data[target] = np.concatenate([blank if c is None else _numbers(part, c, asker) for c in chosen])
        out.sources[target] = source_of(
            first, "" if len(mine) == 1 else "columns " + ", ".join(c.name for c in mine.values())
        )


def _add_constants(out: Gathered, part: Part) -> None:
    for target, constant in part.constants.items():
        rivals = {"theta_i": "elevation_i", "elevation_i": "theta_i"}.get(target, target)
        if target not in out.data and rivals not in out.data:
            out.data[target] = np.full(len(out.lines), constant.value)
            out.sources[target] = Source(target, f"the text {clip(constant.text)!r}", constant.unit)


def _of_matrix(part: Part, asker: Asker) -> Gathered:
    found: Axes = axes(part, asker)
    cells = [[row.cells[k] if k < len(row.cells) else None for k in found.places] for row in part.rows]
    rows = _checked([row.cells[0] for row in part.rows], [r.line for r in part.rows], found.rows.target, False, asker)
    flat = [cell for row in cells for cell in row]
    lines = np.repeat([row.line for row in part.rows], len(found.places))
    out = Gathered(lines=lines)
    out.data[found.rows.target] = np.repeat(rows, len(found.places))
    out.data[found.columns.target] = np.tile(found.angles, len(part.rows))
    out.data["brdf"] = _checked(flat, lines.tolist(), "a value", True, asker)
    out.sources = {
        found.rows.target: Source(found.rows.target, found.rows.text, found.rows.unit),
        found.columns.target: Source(found.columns.target, found.columns.text, found.columns.unit),
        "brdf": Source("brdf", "the cells of the matrix", found.unit, found.quantity),
    }
    _add_constants(out, part)
    return out


def _numbers(part: Part, column: Column, asker: Asker) -> np.ndarray:
    name = column.target if column.target in (*v.ANGLES, "wavelength", "mask") else f"column {column.name}"
    may_miss = column.target not in (*NEEDED, "mask")
    return _checked(part.column(column.place), [row.line for row in part.rows], name, may_miss, asker)


def _checked(cells: list[Cell], lines: list[int], name: str, may_miss: bool, asker: Asker) -> np.ndarray:
    """The cells as numbers, NaN for those that may be empty. Raises one FormatError for the first bad rows."""
    bad = [
        (line, f"{name} is {clip(c)!r}, not a number" if isinstance(c, str) else f"{name} is empty")
        for c, line in zip(cells, lines, strict=True)
        if isinstance(c, str) or (c is None and not may_miss) or (isinstance(c, float) and math.isinf(c))
    ]
    if bad:
        rest = "".join(f"; line {line}: {what}" for line, what in bad[1:MOST_SHOWN])
        more = f"; and {len(bad) - MOST_SHOWN} more" if len(bad) > MOST_SHOWN else ""
        raise asker.wrong(f"{bad[0][1]}{rest}{more}: correct or delete these rows", bad[0][0])
    return np.array([math.nan if c is None else c for c in cells], dtype=float)


def _texts(cells: list[Cell]) -> np.ndarray:
    return np.array(["" if c is None else f"{c:.15g}" if isinstance(c, float) else c for c in cells])


def _numbers_or_texts(cells: list[Cell]) -> np.ndarray:
    if any(isinstance(c, str) for c in cells):
        return _texts(cells)
    return np.array([math.nan if c is None else c for c in cells], dtype=float)


def _unused(column: Column, taken: dict[str, np.ndarray]) -> str:
    """A name for a further variable that no other has, and that no reader takes for a column it knows."""
    name = " ".join(column.heading.text.split()).replace(",", " ") or f"column {column.place + 1}"
    names: Iterator[str] = (f"{name}{'' if n == 1 else f' {n}'}" for n in range(1, len(taken) + 2))
    return next(n for n in names if n not in taken)
