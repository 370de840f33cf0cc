"""Readers of raw readings: files of what a detector read, before anything is divided by anything.

Each reader says how it knows its files and gives the Dataset that `gonio.reduction.readings` declares. READERS lists
them; a new one is one more entry.
"""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import xarray as xr

from gonio.door.text import head
from gonio.files import FormatError
from gonio.raw import blacklab, journal, table

HEAD = 65_536  # bytes that a reader may look at: a table may begin with many lines of remarks


class Reader(NamedTuple):
    """One kind of raw file: its title, whether a file that begins with some bytes is one, and how it is read."""

    title: str
    recognises: Callable[[bytes], bool]
    read: Callable[[Path], xr.Dataset]


READERS = (
    Reader("gonio's journal of a measurement", journal.recognises, journal.read),
    Reader("Black Lab readings", blacklab.recognises, blacklab.read),
    Reader("table of readings", table.recognises, table.read),
)


def reader_of(path: str | Path) -> Reader | None:
    """The reader of a file; None for a file that holds no raw readings. Raises FormatError as `door.text.head` does."""
    path = Path(path)
    if path.is_dir():
        return None
    start = head(path, HEAD)
    return next((reader for reader in READERS if reader.recognises(start)), None)


def reader_of_raw(path: str | Path) -> Reader | None:
    """The reader of a file that holds raw readings and no scan beside them; None for any other. Raises as above."""
    reader = reader_of(path)
    is_both = reader is not None and reader.read is table.read and table.is_scan_too(head(Path(path), HEAD))
    return None if is_both else reader


def read_readings(path: str | Path) -> xr.Dataset:
    """The raw readings of a file; FormatError, with the place and the remedy, for a file that holds none."""
    path = Path(path)
    if (reader := reader_of(path)) is None:
        known = " or ".join(reader.title for reader in READERS)
        raise FormatError(path, f"holds no raw readings that gonio knows: {known}")
    return reader.read(path)
