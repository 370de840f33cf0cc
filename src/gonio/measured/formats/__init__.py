"""Reading and writing scans: one file a format, found by content."""

import functools
import importlib
import pkgutil
from pathlib import Path

import xarray as xr

from gonio.files import FormatError, replacing
from gonio.measured.dataset import add_history
from gonio.measured.format import Format
from gonio.model import NearestNames

HEAD = 4096  # bytes that a format may look at to recognise a file


@functools.cache
def formats() -> NearestNames[Format]:
    """Every format by name, in the order in which they are asked."""
    found = set()
    for module in pkgutil.iter_modules(__path__):
        contents = vars(importlib.import_module(f"{__name__}.{module.name}"))
        found |= {value for value in contents.values() if isinstance(value, Format)}
    return NearestNames("format", {f.name: f for f in sorted(found, key=lambda f: (f.rank, f.name))})


def recognise(path: str | Path) -> Format:
    """The format of a file, by its content; FormatError with the remedy where there is none."""
    path = Path(path)
    if not path.exists():
        raise FormatError(path, "there is no such file")
    if not path.is_file():
        raise FormatError(path, "is a directory: name a file in it" if path.is_dir() else "is not a regular file")
    with path.open("rb") as file:
        head = file.read(HEAD)
    if not head:
        raise FormatError(path, "is empty")
    for candidate in formats().values():
        if candidate.recognises(head):
            return candidate
    known = ", ".join(f.title for f in formats().values())
    raise FormatError(path, f"is none of the formats that gonio reads: {known}", "byte 0")


def read(path: str | Path) -> xr.Dataset:
    """Read a scan in whatever format it is; FormatError names file, place and remedy."""
    found = recognise(path)
    scan = found.read(Path(path))
    return add_history(scan, f"read from {Path(path).name} as {found.title}")


def write(scan: xr.Dataset, path: str | Path, force: bool = False) -> Format:
    """Write a scan in the format of the name's suffix; ValueError for a suffix that no format writes."""
    path = Path(path)
    writable = {f.suffix: f for f in formats().values() if f.write}
    if path.suffix not in writable:
        raise ValueError(
            f"{path}: no format is written to {path.suffix or 'a name without suffix'}; use {' or '.join(writable)}"
        )
    chosen = writable[path.suffix]
    assert chosen.write is not None
    with replacing(path, force) as temporary:
        chosen.write(scan, temporary)
    return chosen
