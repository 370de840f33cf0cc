"""Rows of numbers in a text file, converted to an array in bulk, each with its line."""

from array import array
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gonio.door.text import MOST_VALUES, number
from gonio.files import FormatError

AT_ONCE = 50_000  # words that are kept as text: they take many times the memory of the numbers
MOST_LISTED = 10  # names that a message lists


class Rows:
    """Rows with one number for each of `names`, which messages use; numbers named in `gaps` may be `nan`.

    Every method raises FormatError with the line of the first row that is wrong.
    """

    def __init__(self, path: Path, names: Iterable[str], gaps: Iterable[str] = ()) -> None:
        self.path, self.names = path, tuple(names)
        self._wide = len(self.names)
        may_miss = frozenset(gaps)
        self._may_miss = [name in may_miss for name in self.names]
        self._lines, self._words = array("q"), list[str]()
        self._parts: list[npt.NDArray[np.float64]] = []

    def add(self, line: int, words: list[str]) -> None:
        """Add the words of one line."""
        if len(words) != self._wide:
            listed = f": {', '.join(self.names)}" if self._wide <= MOST_LISTED else ""
            raise FormatError(self.path, f"has {len(words)} numbers, not {self._wide}{listed}", f"line {line}")
        self._lines.append(line)
        self._words += words
        if len(self._words) >= AT_ONCE:
            self._take()

    def _take(self) -> None:
        """Convert the words so far to numbers: all at once, and one by one only where one of them is wrong."""
        wide = self._wide
        if len(self._lines) * wide > MOST_VALUES:
            raise FormatError(self.path, f"holds more than {MOST_VALUES} numbers", f"line {self._lines[-1]}")
        try:
            table = np.array(list(map(float, self._words))).reshape(-1, wide)
        except ValueError:
            table = np.full((len(self._words) // wide, wide), np.inf)
        if not np.isfinite(table).all() or "_" in "".join(self._words):
            first = len(self._lines) - len(table)
            for k, word in enumerate(self._words):
                if not (self._may_miss[k % wide] and word.lower() == "nan"):
                    number(self.path, self._lines[first + k // wide], word, self.names[k % wide])
        self._parts.append(table)
        self._words = []

    def table(self) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
        """The line of each row, and the numbers (rows, names). Raises FormatError where there is no row."""
        self._take()
        if not self._lines:
            raise FormatError(self.path, "holds no rows of numbers", "line 1")
        return np.array(self._lines), np.concatenate(self._parts)
