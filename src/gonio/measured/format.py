"""What a file format is to gonio."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import xarray as xr


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
