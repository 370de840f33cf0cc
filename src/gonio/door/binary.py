"""A cursor over a binary file: it checks every size against the file before it reads or allocates."""

import hashlib
import math
import mmap
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from gonio.files import FormatError


@contextmanager
def mapped(path: Path) -> Iterator[mmap.mmap]:
    """The bytes of a file that is not empty, mapped into memory: none is read before it is asked for."""
    with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
        yield content


class Bytes:
    """The bytes of a file, memory-mapped, and the place `at` of the cursor. Arrays are views into the file.

    Every method raises FormatError with the byte offset, and with what was expected there.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.at = path, 0
        self.size = path.stat().st_size
        self._map = np.memmap(path, dtype=np.uint8, mode="r") if self.size else np.empty(0, dtype=np.uint8)

    def wrong(self, what: str, at: int | None = None) -> FormatError:
        """The error to raise for what is wrong at the cursor, or at byte `at`."""
        return FormatError(self.path, what, f"byte {self.at if at is None else at}")

    def array(
        self, dtype: npt.DTypeLike, shape: tuple[int, ...], expected: str, at: int | None = None
    ) -> npt.NDArray[Any]:
        """An array, read at the cursor, or at byte `at` without moving; its size is checked against the file first."""
        start = self.at if at is None else at
        length = (
            math.prod(shape) * np.dtype(dtype).itemsize
        )  # Python's integers do not overflow: a size of 2^62 does not wrap
        if min((*shape, start), default=start) < 0 or start + length > self.size:
            remaining = max(self.size - start, 0)
            raise self.wrong(f"{expected} needs {length} bytes, and the file has {remaining} left there", start)
        if at is None:
            self.at += length
        return self._map[start : start + length].view(dtype).reshape(shape)

    def number(self, dtype: npt.DTypeLike, expected: str) -> int:
        """One integer of this type."""
        return int(self.array(dtype, (1,), expected)[0])

    def text(self, length: int, expected: str) -> str:
        """`length` bytes as UTF-8 text."""
        start = self.at
        raw = self.array(np.uint8, (length,), expected).tobytes()
        try:
            return raw.decode("utf-8")
        except UnicodeDecodeError as error:
            raise self.wrong(f"{expected} is no UTF-8 text", start + error.start) from error


def sha256(path: Path) -> str:
    """The SHA-256 of a file in hexadecimal, by which a report names exactly the bytes that were read.

    Empty for a folder, such as a Zarr store, which has none of its own.
    """
    if not path.is_file():
        return ""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
