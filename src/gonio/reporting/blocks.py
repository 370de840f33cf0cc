"""What a report is made of: sections of facts, tables, notes and figures, as text for people and as data for programs.

A number is written once: the text that people read is what the data hold, to the same digits.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar

MOST_ROWS = 120  # of a table; a spectrum has a value of each parameter at each wavelength
MOST_COLUMNS, ROOM = 4, 30  # of a table, and characters of a row, that a telephone has room for
LEAST_POWER, MOST_POWER = -4, 6  # of ten, from which and up to which a number is written without one
LONG = 14  # rows from which a table is folded on a screen


@dataclass(frozen=True)
class Cell:
    """One entry. data: what a program reads, the text itself where None. is_number: set to the right of its column."""

    text: str
    data: Any = None
    is_number: bool = False

    @property
    def value(self) -> Any:
        """The entry for a program; a dash is null."""
        return self.data if self.data is not None or self.is_number else self.text


NOT_STATED = Cell("not stated", None)


def number(value: float, digits: int = 4, unit: str = "") -> Cell:
    """A number with so many significant digits, and a unit behind it; a dash where there is none."""
    if not math.isfinite(value):
        return Cell("–" if math.isnan(value) else "∞" if value > 0 else "−∞", None, True)
    text = f"{value:.{digits - 1}e}"
    power = int(text.partition("e")[2])
    if LEAST_POWER <= power < MOST_POWER:
        text = f"{float(text):.{max(digits - 1 - power, 0)}f}"
    text = "0" if value == 0 else text.replace("e-0", "e-").replace("e+0", "e+")
    return Cell(f"{text} {unit}".rstrip(), float(text), True)


def angle(value: float) -> Cell:
    """An angle [deg] as files have it, to a thousandth."""
    text = f"{round(float(value), 3) + 0.0:g}"
    return Cell(text, float(text), True)


def count(value: int) -> Cell:
    """A whole number."""
    return Cell(str(int(value)), int(value), True)


def percent(part: float, digits: int = 3) -> Cell:
    """A part of one in percent; the data hold the percentage, in `%` as well."""
    return number(100 * part, digits, "%")


@dataclass(frozen=True)
class Facts:
    """Labels with what is known of each."""

    kind: ClassVar = "facts"
    rows: Sequence[tuple[str, Cell]]
    title: str = ""

    @property
    def is_long(self) -> bool:
        """Whether they are folded on a screen, under their title."""
        return len(self.rows) > LONG and bool(self.title)

    def data(self) -> dict[str, Any]:
        """By label."""
        return {label: cell.value for label, cell in self.rows}


@dataclass(frozen=True)
class Table:
    """Rows under heads. name: the key of its data. left: how many columns from the left are text."""

    kind: ClassVar = "table"
    name: str
    caption: str
    heads: Sequence[str]
    rows: Sequence[Sequence[Cell]]
    left: int = 1

    @property
    def shown(self) -> Sequence[Sequence[Cell]]:
        """The rows that are printed."""
        return self.rows[:MOST_ROWS]

    @property
    def is_wide(self) -> bool:
        """Whether a telephone shows each row as a list."""
        lengths = (sum(len(cell.text) for cell in row) for row in self.shown)
        return len(self.heads) > MOST_COLUMNS or max(lengths, default=0) > ROOM

    @property
    def beyond(self) -> int:
        """How many rows are not printed."""
        return len(self.rows) - len(self.shown)

    @property
    def is_long(self) -> bool:
        """Whether it is folded on a screen."""
        return len(self.rows) > LONG

    def data(self) -> list[dict[str, Any]]:
        """The rows that are printed, each by head."""
        return [{head: cell.value for head, cell in zip(self.heads, row, strict=True)} for row in self.shown]


@dataclass(frozen=True)
class Notes:
    """Sentences. name: the key of its data. plain: a paragraph each, and no list."""

    kind: ClassVar = "notes"
    name: str
    lines: Sequence[str]
    plain: bool = False

    def data(self) -> list[str]:
        """The sentences."""
        return list(self.lines)


@dataclass(frozen=True)
class Lines:
    """Lines of a file or of a history, as they stand there, under a title."""

    kind: ClassVar = "lines"
    name: str
    title: str
    lines: Sequence[str]

    def data(self) -> list[str]:
        """The lines."""
        return list(self.lines)


@dataclass(frozen=True)
class Picture:
    """One drawing: its svg element, and what it shows in words."""

    svg: str
    caption: str


@dataclass(frozen=True)
class Pictures:
    """Drawings side by side under one legend in words."""

    kind: ClassVar = "pictures"
    legend: str
    pictures: Sequence[Picture]


@dataclass(frozen=True)
class Section:
    """A part of the report. name: the key of its data, and its anchor."""

    name: str
    title: str
    blocks: Sequence[Any] = field(default_factory=list)

    def data(self) -> dict[str, Any]:
        """Its facts by label, and its tables and notes by name."""
        out: dict[str, Any] = {}
        for block in self.blocks:
            if isinstance(block, Facts):
                out |= block.data()
            elif not isinstance(block, Pictures):
                out[block.name] = block.data()
        return out


def filled(blocks: Iterator[Any]) -> list[Any]:
    """The blocks that hold anything."""
    return [b for b in blocks if getattr(b, "rows", None) or getattr(b, "lines", None) or getattr(b, "pictures", None)]


def data(sections: Sequence[Section]) -> Mapping[str, Any]:
    """All sections by name."""
    return {section.name: found for section in sections if (found := section.data())}
