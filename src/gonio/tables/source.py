"""A table as rows of cells, each with its line: of text, whose separator and decimal mark are found, or a workbook."""

import csv
import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from gonio.door import spreadsheet
from gonio.door.text import LONGEST_LINE, clip, head
from gonio.files import FormatError
from gonio.tables import vocabulary as v

MOST_BYTES = 256 * 2**20
LONGEST_NUMBER = 100  # characters
SAMPLE = 400  # lines by which separator and decimal mark are found
SEPARATORS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "strokes", " ": "white space"}
MARKS = {".": "points", ",": "commas"}  # before the decimals
REMARKS = ("#", "%", "!", "//")  # what begins a line that is none of the table
_NUMBERS = {
    ".": re.compile(r"[-+]?(\d+(\.\d*)?|\.\d+)(e[-+]?\d{1,4})?"),
    ",": re.compile(r"[-+]?(\d+(,\d+)?|,\d+)(e[-+]?\d{1,4})?"),
}
_GAPS = frozenset(v.GAPS)

Cell = float | str | None  # a number, a text, or nothing


@dataclass(frozen=True)
class Row:
    """One row: its line in the file (from 1), its cells, its text as a whole, and whether a mark makes it a remark."""

    line: int
    cells: tuple[Cell, ...]
    text: str
    is_remark: bool = False

    @property
    def filled(self) -> list[Cell]:
        """The cells that are not empty."""
        return [c for c in self.cells if c is not None]

    @property
    def numbers(self) -> int:
        """How many cells are numbers."""
        return sum(isinstance(c, float) for c in self.cells)


@dataclass(frozen=True)
class Sheet:
    """The rows of one sheet, those of wholly empty cells left out, and how they were written."""

    name: str
    rows: list[Row]
    how: str


def number(text: str, mark: str = ".") -> float | None:
    """The number that a text is, None where it is none. One mark for decimals and none for thousands."""
    plain = text.strip().replace("\u2212", "-").lower()
    if len(plain) > LONGEST_NUMBER or not _NUMBERS[mark].fullmatch(plain):
        return None
    value = float(plain.replace(",", "."))
    return value if math.isfinite(value) else None


def sheets(path: Path) -> list[Sheet]:
    """The sheets of a file that hold anything. Raises FormatError with the place."""
    start = head(path, 8)
    if not start:
        raise FormatError(path, "is empty", "byte 0")
    if start.startswith(spreadsheet.MAGIC):
        found = [_of_workbook(path, sheet) for sheet in spreadsheet.sheets(path)]
        if not found:
            raise FormatError(path, "holds no cells", "byte 0")
        return found
    text, encoding = _decoded(path)
    lines = re.split(r"\r\n|\n|\r", text)
    if long := next((n for n, line in enumerate(lines, start=1) if len(line) > LONGEST_LINE), 0):
        raise FormatError(path, f"is longer than {LONGEST_LINE} characters: this is no row of a table", f"line {long}")
    separator, mark = sniffed(path, lines[:SAMPLE])
    how = f"text separated by {SEPARATORS[separator]}, decimal {MARKS[mark]}{encoding}"
    return [Sheet("", list(_rows(path, lines, separator, mark)), how)]


def _of_workbook(path: Path, sheet: spreadsheet.Sheet) -> Sheet:
    """A sheet; numbers that stand there as texts are numbers, with the one mark that all of them allow."""
    texts = [c for row in sheet.rows for c in row if isinstance(c, str)]
    with_mark = {m: sum(number(t, m) is not None for t in texts) for m in MARKS}
    mark = max(MARKS, key=lambda m: with_mark[m])
    if min(with_mark.values()) < max(with_mark.values()) and with_mark["."] and with_mark[","]:
        whole = sum(number(t, ".") is not None and number(t, ",") is not None for t in texts)
        if min(with_mark.values()) > whole:
            raise FormatError(path, f"sheet {clip(sheet.name)!r} has decimal points and decimal commas", "line 1")
    rows = (
        Row(i, tuple(_cell(c, mark) if isinstance(c, str) else c for c in row), " ".join(_text(c) for c in row).strip())
        for i, row in enumerate(sheet.rows, start=1)
    )
    return Sheet(sheet.name, [row for row in rows if row.filled], f"sheet {sheet.name!r} of a workbook")


def _text(cell: float | str) -> str:
    return f"{cell:.15g}" if isinstance(cell, float) else cell


def _cell(text: str, mark: str) -> Cell:
    text = text.strip()
    if text.lower() in _GAPS:
        return None
    value = number(text, mark)
    return text if value is None else value


def _decoded(path: Path) -> tuple[str, str]:
    """The text of a file, and in words an encoding that is not UTF-8."""
    raw = head(path, MOST_BYTES + 1)
    if len(raw) > MOST_BYTES:
        raise FormatError(path, f"is larger than {MOST_BYTES // 2**20} MB", f"byte {MOST_BYTES}")
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        try:
            return raw.decode("utf-16"), ", UTF-16"
        except UnicodeDecodeError as error:
            raise FormatError(path, "is no whole text in UTF-16", f"byte {error.start}") from error
    if b"\0" in raw:
        raise FormatError(path, "holds zero bytes: this is no table of text", f"byte {raw.index(0)}")
    try:
        return raw.decode("utf-8-sig"), ""
    except UnicodeDecodeError:
        try:
            return raw.decode("cp1252"), ", Windows-1252"
        except UnicodeDecodeError as error:
            raise FormatError(path, "is text in no known encoding: save it as UTF-8", f"byte {error.start}") from error


def _split(path: Path, lines: list[str], separator: str) -> Iterator[tuple[int, list[str], str]]:
    """Line, cells as texts and the whole text of each row that is not empty."""
    if separator == " ":
        for n, line in enumerate(lines, start=1):
            if line.strip():
                yield n, _words(line), line.strip()
        return
    reader = csv.reader((line + "\n" for line in lines), delimiter=separator, skipinitialspace=True)
    before = 0
    try:
        for cells in reader:
            here, before = before + 1, reader.line_num
            # A line without a separator, such as a title, is one cell whatever quotes are in it.
            if any(cell.strip() for cell in cells):
                yield here, cells, " ".join(cell.strip() for cell in cells if cell.strip())
    except csv.Error as error:
        raise FormatError(path, f"is no table: {error}", f"line {max(reader.line_num, 1)}") from error


def _words(line: str) -> list[str]:
    """The cells of a line whose separator is white space: two blanks or tabs part cells with blanks in them."""
    wide = [cell for cell in re.split(r"\s{2,}|\t", line.strip()) if cell]
    words = line.split()
    if any(number(w, m) is not None for w in words for m in MARKS) or len(wide) == 1:
        # In a heading, a unit in brackets belongs to the name before it.
        joined = re.sub(r" (?=[\[(][^\])]{0,40}[\])])", "\0", " ".join(words))
        joined = re.sub(r"[\[(][^\])]{0,40}[\])]", lambda m: re.sub(r"\s", "\0", m[0]), joined)
        return [cell.replace("\0", " ") for cell in joined.split()]
    return wide


def _rows(path: Path, lines: list[str], separator: str, mark: str) -> Iterator[Row]:
    for line, cells, text in _split(path, lines, separator):
        is_remark = text.startswith(REMARKS)
        if is_remark:
            text = text.lstrip("".join(REMARKS)).strip()
            first = cells[0].strip().lstrip("".join(REMARKS))
            cells = [first, *cells[1:]] if first or separator != " " else cells[1:]
        row = Row(line, tuple(_cell(c, mark) for c in cells), text, is_remark)
        if row.filled:
            yield row


def sniffed(path: Path, lines: list[str]) -> tuple[str, str]:
    """Separator and decimal mark: those that make the most cells of the first lines numbers in rows of one width.

    Raises FormatError where there is no such row, and where two readings are as good and differ.
    """
    ways = [(s, m) for s in SEPARATORS for m in MARKS if not s == m == ","]
    scores = {way: _score(path, lines, *way) for way in ways}
    best = max(scores.values(), key=lambda score: score[0])
    if not best[0]:
        raise FormatError(path, "holds no rows of numbers: is it a table?", "line 1")
    equal = [way for way in ways if scores[way][0] == best[0]]
    if len({scores[way][1] for way in equal}) > 1:
        said = " or ".join(f"separated by {SEPARATORS[s]} with decimal {MARKS[m]}" for s, m in equal)
        raise FormatError(path, f"is {said}, and the numbers differ: write decimal points and tabs", "line 1")
    if best[2] and ("," in {s for s, _ in equal}):
        what = "has decimal commas and commas between its columns, which cannot be told apart"
        raise FormatError(path, f"{what}: write decimal points, or save it with semicolons or tabs", f"line {best[2]}")
    return equal[0]


def _score(path: Path, lines: list[str], separator: str, mark: str) -> tuple[int, tuple[float, ...], int]:
    """How many numbers stand in rows of the usual width, these numbers, and the line of a heading half as wide."""
    widths: dict[int, list[float]] = {}
    texts: dict[int, tuple[int, int]] = {}
    for line, cells, text in _split(path, lines, separator):
        if text.startswith(REMARKS):
            continue
        filled = [c for c in cells if c.strip()]
        values = [n for c in filled if (n := number(c, mark)) is not None]
        if len(filled) > 1 and len(values) >= len(filled) - 1:
            widths.setdefault(len(cells), []).extend(values)
        elif len(filled) > 1 and not values:
            texts[len(filled)] = (line, len(filled))
    if not widths:
        return 0, (), 0
    width, values = max(widths.items(), key=lambda item: len(item[1]))
    halved = texts.get(width // 2, (0, 0))[0] if width % 2 == 0 and width not in texts else 0
    whole = all(value == int(value) for value in values)
    return len(values), tuple(values), halved if whole and width > 2 else 0
