"""Lines, words and numbers of text files with their place in the file, and limits against hostile files."""

import math
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gonio.door import packed
from gonio.files import FormatError

LONGEST_LINE = 65_536  # bytes; a longer line is not a row of numbers
_LINE_END = re.compile(rb"\r\n|\n|\r")
MOST_VALUES = 50_000_000  # numbers that a header may promise; a larger count is damage or malice


def head(path: Path, length: int, archives: bool = False) -> bytes:
    """The first bytes of a file, by which it is recognised.

    Raises FormatError for a path that is no regular file, because a pipe would be read for ever and a device without
    end, and for a file that is compressed or an archive; ZIP archives pass with `archives`, for readers of such files.
    """
    if not path.exists():
        raise FormatError(path, "there is no such file")
    if path.is_dir():
        raise FormatError(path, "is a directory: name a file in it")
    if not path.is_file():
        raise FormatError(path, "is not a regular file, but a pipe or a device: save what it holds as a file first")
    with path.open("rb") as file:
        start = file.read(max(length, packed.LENGTH))
    if not (archives and start.startswith(packed.ZIP)):
        packed.refuse_packed(path, start)
    return start[:length]


def whole(path: Path, largest: int) -> str:
    """A file of at most `largest` bytes as text, without a byte-order mark.

    Raises FormatError for a longer file, an empty one, zero bytes, and for bytes that are not UTF-8.
    """
    raw = head(path, largest + 1)
    if len(raw) > largest:
        raise FormatError(path, f"is larger than {largest // 1_000_000} MB", f"byte {largest}")
    if b"\0" in raw:
        raise FormatError(path, "holds zero bytes: this is no text file; save it as UTF-8 text", f"byte {raw.index(0)}")
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        at = f"line {raw.count(10, 0, error.start) + 1}, byte {error.start}"
        raise FormatError(path, "is not UTF-8 text: save the file as UTF-8", at) from error
    if not text.strip():
        raise FormatError(path, "is empty")
    return text


def lines(path: Path, *, longest: int = LONGEST_LINE, encoding: str = "utf-8") -> Iterator[tuple[int, str]]:
    r"""Numbers from 1 and lines without their ends (\n, \r\n or \r), read and decoded one after another on demand.

    Raises FormatError for zero bytes, for bytes that are not `encoding`, and for a line of more than `longest` bytes.
    """
    number = 0
    with path.open("rb") as file:
        rest = b""
        while True:
            chunk = file.read(LONGEST_LINE)
            pieces = _LINE_END.split(rest + chunk)
            # A carriage return at the end of the chunk may be half of a line end: it is kept for the next chunk.
            rest = pieces.pop() if chunk else b""
            if chunk and not rest and pieces and chunk.endswith(b"\r"):
                rest = pieces.pop() + b"\r"
            for piece in pieces:
                number += 1
                yield number, _checked(path, number, piece, longest, encoding)
            if len(rest) > longest:
                _checked(path, number + 1, rest, longest, encoding)
            if not chunk:
                return


def _checked(path: Path, number: int, raw: bytes, longest: int, encoding: str) -> str:
    if b"\0" in raw:
        raise FormatError(path, "holds zero bytes: this is no text file", f"line {number}")
    if len(raw) > longest:
        raise FormatError(path, f"is longer than {longest} bytes: this is no row of numbers", f"line {number}")
    return _decoded(path, number, raw, encoding)


def _decoded(path: Path, number: int, raw: bytes, encoding: str) -> str:
    if number == 1:
        raw = raw.removeprefix(b"\xef\xbb\xbf")
    try:
        return raw.decode(encoding)
    except UnicodeDecodeError as error:
        at = f"line {number}, byte {error.start + 1}"
        raise FormatError(path, f"is not {encoding.upper()} text: save the file as {encoding.upper()}", at) from error


def clip(text: str, most: int = 40) -> str:
    """The text, cut to `most` characters for a message."""
    return text if len(text) <= most else text[: most - 2] + ".."


class Words:
    """A cursor over the words of a text file, one at a time or a line at a time, which knows the line.

    `comment` starts a remark up to the end of its line, kept in `remarks`; `separators` act as white space.
    Every method raises FormatError with the line, and with what was expected there.
    """

    def __init__(self, path: Path, source: Iterator[tuple[int, str]], comment: str = "#", separators: str = "") -> None:
        self.path, self.line = path, 0
        self.remarks: list[str] = []
        self._source, self._comment = source, comment
        self._separators = str.maketrans(dict.fromkeys(separators, " "))
        self._words: list[str] = []  # the rest of the line, the next word last

    def _fill(self) -> bool:
        while not self._words:
            entry = next(self._source, None)
            if entry is None:
                return False
            self.line, text = entry
            if self._comment and self._comment in text:
                text, _, remark = text.partition(self._comment)
                self.remarks.append(remark.strip())
            self._words = text.translate(self._separators).split()[::-1]
        return True

    def wrong(self, what: str) -> FormatError:
        """The error to raise for what is wrong at this place."""
        return FormatError(self.path, what, f"line {max(self.line, 1)}")

    def peek(self) -> str:
        """The next word, without moving past it; empty at the end of the file."""
        return self._words[-1] if self._fill() else ""

    def rest(self) -> list[str]:
        """The words that remain on this line; none after the last word of a line."""
        words, self._words = self._words[::-1], []
        return words

    def row(self) -> list[str]:
        """The words of the next line that has any; empty at the end of the file."""
        return self.rest() if self._fill() else []

    def word(self, expected: str) -> str:
        """The next word."""
        if not self._fill():
            raise self.wrong(f"the file ends where {expected} was expected")
        return self._words.pop()

    def keyword(self, *allowed: str) -> str:
        """The next word, which must be one of `allowed` in any case; returned as spelt in `allowed`."""
        listed = " or ".join(allowed)
        word = self.word(listed)
        for name in allowed:
            if word.lower() == name.lower():
                return name
        raise self.wrong(f"{clip(word)!r} where {listed} was expected")

    def number(self, expected: str) -> float:
        """The next word as a finite number."""
        return self.as_number(self.word(expected), expected)

    def numbers(self, count: int, expected: str) -> list[float]:
        """`count` numbers, over as many lines as they take."""
        numbers: list[float] = []
        while len(numbers) < count:
            if not self._fill():
                raise self.wrong(f"the file ends after {len(numbers)} of {count} numbers of {expected}")
            wanted = min(count - len(numbers), len(self._words))
            numbers += [self.as_number(self._words.pop(), expected) for _ in range(wanted)]
        return numbers

    def table(self, count: int, expected: str) -> npt.NDArray[np.float64]:
        """`count` numbers as an array (count,): as `numbers`, but a line at a time, which is fast for large tables."""
        values: list[float] = []
        while len(values) < count:
            if not self._fill():
                raise self.wrong(f"the file ends after {len(values)} of {count} numbers of {expected}")
            wanted = min(count - len(values), len(self._words))
            words = self._words[: -wanted - 1 : -1]
            del self._words[-wanted:]
            try:
                numbers = list(map(float, words))
            except ValueError:
                numbers = []
            if not numbers or "_" in "".join(words) or not all(map(math.isfinite, numbers)):
                label = f"of the {count} numbers of {expected}, number"
                numbers = [self.as_number(w, f"{label} {len(values) + k + 1}") for k, w in enumerate(words)]
            values += numbers
        return np.array(values)

    def count(self, expected: str, least: int = 1, most: int = MOST_VALUES) -> int:
        """The next word as a whole number from `least` to `most`."""
        text = self.word(expected)
        if not text.lstrip("+").isdecimal() or len(text) > 20:
            raise self.wrong(f"{expected} is {clip(text)!r}, not a count")
        if not least <= int(text) <= most:
            raise self.wrong(f"{expected} is {text}, outside {least} to {most}")
        return int(text)

    def as_number(self, text: str, expected: str) -> float:
        """A word of this line as a finite number."""
        return number(self.path, self.line, text, expected)


def number(path: Path, line: int, text: str, expected: str) -> float:
    """A finite number. Raises FormatError with the line and with `expected`, what the number is."""
    try:
        value = math.nan if "_" in text else float(text)  # float accepts 1_000, which no instrument writes
    except ValueError:
        value = math.nan
        if "," in text and text.replace(",", ".", 1).replace(".", "", 1).lstrip("+-").isalnum():
            message = f"{expected} is {clip(text)!r}: write decimal points, not commas"
            raise FormatError(path, message, f"line {line}") from None
    if not math.isfinite(value):
        raise FormatError(path, f"{expected} is {clip(text)!r}, not a finite number", f"line {line}")
    return value


def remark_lines(text: str) -> list[str]:
    """The lines of a text as remarks of a file: without control characters, empty lines and surrounding space."""
    cleaned = ("".join(c for c in line if c.isprintable() or c == "\t").strip() for line in text.splitlines())
    return [line for line in cleaned if line]
