"""Where the tables of a sheet are: headings, the rows below each, and the text above, which may state constants."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from gonio.door.text import clip
from gonio.tables import vocabulary as v
from gonio.tables.headings import Constant, constants, parsed
from gonio.tables.request import Asker
from gonio.tables.source import Cell, Row, Sheet, number

LONG, MATRIX = "long", "matrix"


@dataclass
class Part:
    """One table: its kind, headings (empty texts for none), units below them, rows, and what the text above says.

    line: of the headings. numbers: whether each heading is a number alone. titles: lines of text above the headings.
    """

    kind: str
    line: int
    headings: list[str]
    units: list[str] = field(default_factory=list)
    rows: list[Row] = field(default_factory=list)
    titles: list[str] = field(default_factory=list)
    constants: dict[str, Constant] = field(default_factory=dict)
    sheet: str = ""
    is_remark: bool = False  # whether the headings stand in a line that a mark makes a remark

    @property
    def width(self) -> int:
        """The number of columns up to the last with a heading or a value."""
        return max(len(self.headings), 1)

    def column(self, k: int) -> list[Cell]:
        """The cells of one column."""
        return [row.cells[k] if k < len(row.cells) else None for row in self.rows]


def parts(sheet: Sheet, asker: Asker) -> list[Part]:
    """The tables of a sheet, each with at least one row; empty where the sheet holds none."""
    wanted = asker.request.layout
    kind = {"long": LONG, "matrix": MATRIX}.get(wanted, "")
    reader = _Parts(sheet, asker, kind)
    found = [part for part in reader.read() if part.rows]
    for part in found:
        _trim(part, asker)
    return found


class _Parts:
    """A walk down the rows of a sheet."""

    def __init__(self, sheet: Sheet, asker: Asker, kind: str) -> None:
        self.sheet, self.asker, self.kind = sheet, asker, kind
        self.rows = sheet.rows
        self.named = {name.casefold() for name in asker.request.columns}
        self.titles: list[Row] = []
        self.constants: dict[str, Constant] = {}
        self.done: list[Part] = []
        self.part: Part | None = None

    def read(self) -> list[Part]:
        at = 0
        while at < len(self.rows):
            at += self._take(at)
        return self.done

    def _take(self, at: int) -> int:
        """Take the row at a place; returns how many rows that were."""
        row = self.rows[at]
        if found := self._stated(at):
            self.constants = self.constants | {c.target: c for c in found}  # what a new block does not state goes on
            self.titles.append(row)
            self.part = None
            return 1
        if row.is_remark or (kind := self._heading(at)) == "":
            self._plain(at)
            return 1
        below = self._units(at)
        self._begin(kind, row, list(map(_text, row.cells)), below)
        return 1 + bool(below)

    def _stated(self, at: int) -> list[Constant]:
        """The constants of a row that states nothing else, unless it is the heading of a matrix of one column."""
        row = self.rows[at]
        if row.numbers == len(row.filled) and not row.is_remark:
            return []
        found = constants(row.text)
        is_below = at + 1 < len(self.rows) and self.rows[at + 1].numbers == len(self.rows[at + 1].filled) > 1
        if found and self.kind == MATRIX and is_below and len(row.filled) == 2:
            return []
        return found

    def _plain(self, at: int) -> None:
        """A row that is neither heading nor constant: a row of the table, or a line of text."""
        row = self.rows[at]
        if row.is_remark or (len(row.filled) == 1 and not row.numbers):
            self.titles.append(row)
        elif self.part is not None:
            if [c for c in map(_text, row.cells) if c] == [h for h in self.part.headings if h]:
                return  # the headings once more
            self.part.rows.append(row)
        elif row.numbers and row.numbers >= len(row.filled) - 1 and (self.done or self._is_bare(at)):
            self._again(row)
        else:
            self.titles.append(row)

    def _is_bare(self, at: int) -> bool:
        """Whether a table without headings begins here: a row of numbers, and no heading anywhere below."""
        row = self.rows[at]
        return row.numbers == len(row.filled) > 1 and not any(
            self._heading(k) for k in range(at, min(at + 50, len(self.rows)))
        )

    def _again(self, row: Row) -> None:
        """A table without headings of its own: those of the one before hold, or those of a remark, or none."""
        if self.done:
            last = self.done[-1]
            self._begin(last.kind, row, last.headings, last.units)
        else:
            width = len(row.cells)
            remark = next((r for r in reversed(self.titles) if self._names_columns(r, width)), None)
            names = [_text(c) for c in remark.cells] if remark else [""] * width
            self._begin(LONG, row, names, [])
        assert self.part is not None
        self.part.rows.append(row)

    def _names_columns(self, row: Row, width: int) -> bool:
        """Whether a remark is a row of headings."""
        known = sum(self._is_known(c) for c in row.filled if isinstance(c, str))
        return row.is_remark and len(row.filled) == width and known > 0 and not constants(row.text)

    def _begin(self, kind: str, row: Row, headings: list[str], units: list[str]) -> None:
        stated = dict(self.constants)
        titles = [title.text for title in self.titles]
        self.part = Part(kind, row.line, headings, units, [], titles, stated, self.sheet.name)
        self.done.append(self.part)
        self.titles = []

    def _heading(self, at: int) -> str:
        """The kind of table whose headings a row holds; empty where it holds none."""
        row = self.rows[at]
        below = next((r for r in self.rows[at + 1 : at + 3] if not r.is_remark and r.numbers), None)
        if below is None or row.is_remark:
            return ""
        if self.kind != LONG and self._heads_matrix(row, below):
            return MATRIX
        if self.kind == MATRIX or row.numbers == len(row.filled) or len(row.filled) < 2:
            return ""
        known = sum(self._is_known(c) for c in row.filled if isinstance(c, str))
        # A row of data may begin with a name: only a word that is understood makes a heading of a row with numbers.
        texts = len(row.filled) - row.numbers
        fits = len(row.filled) >= len(below.filled) - 1 and below.numbers >= 1 and below.numbers > row.numbers
        return LONG if fits and known >= 1 and texts >= 2 else ""

    def _is_known(self, cell: str) -> bool:
        return cell.strip().casefold() in self.named or bool(parsed(cell).target)

    def _heads_matrix(self, row: Row, below: Row) -> bool:
        """Whether a row is a corner and angles: numbers, with a unit or a name of an angle or without."""
        first, *rest = row.cells
        filled = [c for c in rest if c is not None]
        if not filled or (isinstance(first, float) and self.kind != MATRIX):
            return False
        if self.part is not None and row.numbers == len(row.filled) and (first is not None or self.part.kind != MATRIX):
            return False  # a row of the table that is being read
        if any(angle_of(c) is None for c in filled) or below.numbers < len(below.filled):
            return False
        if self.kind == MATRIX:
            return True
        # Headings such as 450 beside names of two angles are wavelengths of a long table.
        names_axis = first is None or any(parsed(name).target in v.ANGLES for name in corner(first)) or len(filled) > 1
        return names_axis and len(below.filled) >= 2 and below.cells[0] is not None

    def _units(self, at: int) -> list[str]:
        """The units of a row below the headings that holds nothing else; none where there is no such row."""
        if at + 2 >= len(self.rows):
            return []
        row = self.rows[at + 1]
        if row.numbers or row.is_remark or not row.filled:
            return []
        found = [v.unit_of(_text(c).strip("[]()")) for c in row.cells]
        return found if all(u or not _text(c) for u, c in zip(found, row.cells, strict=True)) else []


def corner(cell: Cell) -> list[str]:
    """The names in the corner of a matrix: of its rows, and of its columns where two are there."""
    text = _text(cell).replace("\\", "/")
    if parsed(text).target:
        return [text]
    return [name.strip() for name in text.split("/") if name.strip()]


def angle_of(cell: Cell) -> Constant | None:
    """The angle that heads a column of a matrix: a number, which a unit may follow and a name precede.

    Its text is the name of the quantity where one stands before: `BRF 10 deg`.
    """
    if isinstance(cell, float):
        return Constant("", cell, "", "")
    text = v.plain(_text(cell)).strip()
    first, *rest = re.split(r"[\s_]+", text, maxsplit=1)
    if rest and v.squeezed(first) in v.QUANTITY_NAMES:
        of_rest = angle_of(rest[0])
        return replace(of_rest, text=first) if of_rest else None
    for unit in v.SUFFIXES:
        before = text[: -len(unit)].strip()
        if text.casefold().endswith(unit) and v.UNITS[v.unit_of(unit)].kind == v.ANGLE:
            value = number(before) if number(before) is not None else number(before, ",")
            if value is not None:
                return Constant("", value, v.unit_of(unit), "")
    named = constants(text)
    return replace(named[0], text="") if len(named) == 1 and named[0].target in v.INCIDENT else _reflected(text)


def _reflected(text: str) -> Constant | None:
    """`AOS 10` or `detector = 10 deg`."""
    name, value = text.rstrip("°").rstrip(), None
    head = name.rstrip("0123456789.+-")
    value = number(name[len(head) :])
    heading = parsed(head.strip(" =:"))
    return (
        Constant(heading.target, value, heading.unit, "")
        if value is not None and heading.target in v.REFLECTED
        else None
    )


def _text(cell: Cell) -> str:
    return "" if cell is None else f"{cell:.15g}" if isinstance(cell, float) else cell


def _trim(part: Part, asker: Asker) -> None:
    """Leave out the wholly empty columns at the end, and refuse values without a heading and rows too long."""
    filled = [k for row in part.rows for k, c in enumerate(row.cells) if c is not None]
    last = max([k for k, h in enumerate(part.headings) if h] + ([] if any(part.headings) else filled), default=-1)
    del part.headings[last + 1 :]
    for row in part.rows:
        if extra := [c for c in row.cells[last + 1 :] if c is not None]:
            what = f"has {len(row.filled)} values where the headings are {last + 1}"
            hint = "; are these decimal commas with commas between columns?" if asker.path.suffix != ".xlsx" else ""
            raise asker.wrong(f"{what} ({clip(_text(extra[0]))!r} has none){hint}", row.line)


def texts(found: list[Part]) -> Iterator[str]:
    """Every line of text above the tables."""
    for part in found:
        yield from part.titles
