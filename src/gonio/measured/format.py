"""What a file format is to gonio, and the error that names file, place and remedy."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import xarray as xr


class FormatError(ValueError):
    """A file that cannot be read: which, where in it (a line or a byte offset), what was expected."""

    def __init__(self, path: str | Path, what: str, where: str = "") -> None:
        self.path, self.where, self.what = Path(path), where, what
        super().__init__(f"{path}, {where}: {what}" if where else f"{path}: {what}")


@dataclass(frozen=True)
class Format:
    """One file format, declared at the end of the file that reads it.

    `recognises` sees the first bytes of a file, never its name. Formats are asked in the order of `rank`, so that a
    format without a signature of its own comes last. `write(scan, path)` may be None: a format that is only read.
    """

    name: str
    title: str
    suffix: str
    recognises: Callable[[bytes], bool]
    read: Callable[[Path], xr.Dataset]
    write: Callable[[xr.Dataset, Path], None] | None = None
    rank: int = 0
