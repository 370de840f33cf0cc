"""What readers of text files share: lines and numbers with their place in the file, and limits against hostile ones."""

import math
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gonio.files import FormatError

LONGEST_LINE = 65_536  # bytes; a longer line is no row of numbers
_LINE_END = re.compile(rb"\r\n|\n|\r")
MOST_VALUES = 50_000_000  # numbers that a header may promise; more is damage or malice


def lines(path: Path, *, longest: int = LONGEST_LINE, encoding: str = "utf-8") -> Iterator[tuple[int, str]]:
    r"""Line numbers from 1 and lines without their ends (\n, \r\n or \r), decoded as they are asked for.

    Raises FormatError for zero bytes, for what is no text in `encoding`, and for a line beyond `longest` bytes.
    """
    number = 0
    with path.open("rb") as file:
        rest = b""
        while True:
            chunk = file.read(LONGEST_LINE)
            pieces = _LINE_END.split(rest + chunk)
            # A carriage return that ends the chunk may be half of a line end: it waits for the next chunk.
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
    """The text, cut where it is too long for a message."""
    return text if len(text) <= most else text[: most - 2] + ".."


class Words:
    """The words of a text file, one after another or a line at a time, each with its line.

    `comment` starts a remark that reaches to the end of its line; `separators` part words beside white space.
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
        """The next word, which stays; empty at the end of the file."""
        return self._words[-1] if self._fill() else ""

    def rest(self) -> list[str]:
        """The other words of this line, none where the last one was the line's last; never those of the next line."""
        words, self._words = self._words[::-1], []
        return words

    def row(self) -> list[str]:
        """The words of the next line that has any; empty at the end of the file."""
        return self.rest() if self._fill() else []

    def word(self, expected: str) -> str:
        if not self._fill():
            raise self.wrong(f"the file ends where {expected} was expected")
        return self._words.pop()

    def keyword(self, *allowed: str) -> str:
        """The next word, one of `allowed` in any case, as it is spelt there."""
        listed = " or ".join(allowed)
        found = self.word(listed)
        for name in allowed:
            if found.lower() == name.lower():
                return name
        raise self.wrong(f"{clip(found)!r} where {listed} was expected")

    def number(self, expected: str) -> float:
        return self.as_number(self.word(expected), expected)

    def numbers(self, count: int, expected: str) -> list[float]:
        """So many numbers, over as many lines as they take."""
        found: list[float] = []
        while len(found) < count:
            if not self._fill():
                raise self.wrong(f"the file ends after {len(found)} of {count} numbers of {expected}")
            wanted = min(count - len(found), len(self._words))
            found += [self.as_number(self._words.pop(), expected) for _ in range(wanted)]
        return found

    def table(self, count: int, expected: str) -> npt.NDArray[np.float64]:
        """So many numbers as an array (count,), a line at a time: what `numbers` is for large tables."""
        found: list[float] = []
        while len(found) < count:
            if not self._fill():
                raise self.wrong(f"the file ends after {len(found)} of {count} numbers of {expected}")
            wanted = min(count - len(found), len(self._words))
            words = self._words[: -wanted - 1 : -1]
            del self._words[-wanted:]
            try:
                numbers = list(map(float, words))
            except ValueError:
                numbers = []
            if not numbers or "_" in "".join(words) or not all(map(math.isfinite, numbers)):
                label = f"of the {count} numbers of {expected}, number"
                numbers = [self.as_number(w, f"{label} {len(found) + k + 1}") for k, w in enumerate(words)]
            found += numbers
        return np.array(found)

    def count(self, expected: str, least: int = 1, most: int = MOST_VALUES) -> int:
        """A whole number, within what a file can hold."""
        text = self.word(expected)
        if not text.lstrip("+").isdecimal() or len(text) > 20:
            raise self.wrong(f"{expected} is {clip(text)!r}, not a count")
        if not least <= int(text) <= most:
            raise self.wrong(f"{expected} is {text}, outside {least} to {most}")
        return int(text)

    def as_number(self, text: str, expected: str) -> float:
        return number(self.path, self.line, text, expected)


def number(path: Path, line: int, text: str, expected: str) -> float:
    """A finite number; FormatError names the line and what the number was for."""
    try:
        value = math.nan if "_" in text else float(text)  # Python's own 1_000 is no number of an instrument
    except ValueError:
        value = math.nan
        if "," in text and text.replace(",", ".", 1).replace(".", "", 1).lstrip("+-").isalnum():
            what = f"{expected} is {clip(text)!r}: write decimal points, not commas"
            raise FormatError(path, what, f"line {line}") from None
    if not math.isfinite(value):
        raise FormatError(path, f"{expected} is {clip(text)!r}, not a finite number", f"line {line}")
    return value


def remark_lines(text: str) -> list[str]:
    """The lines of remarks as a text file can hold them: no control characters, no empty line, no space around."""
    found = ("".join(c for c in line if c.isprintable() or c == "\t").strip() for line in text.splitlines())
    return [line for line in found if line]
