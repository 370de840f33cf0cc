"""Reading and writing scans: one file a format, found by content."""

import functools
import importlib
import pkgutil
from pathlib import Path

import xarray as xr

from gonio.files import FormatError, replacing
from gonio.formats.format import Format
from gonio.measured.dataset import add_history
from gonio.model import NearestNames

HEAD = 4096  # bytes that a format may look at to recognise a file
LAST = 100  # rank of the format that takes whatever no other does


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
    head = _head(path)
    if not head:
        raise FormatError(path, "is empty", "byte 0")
    for candidate in formats().values():
        if candidate.rank >= LAST and (stranger := _stranger(head)):
            raise FormatError(path, f"is {stranger}: gonio knows no BRDF in it", "byte 0")
        if candidate.recognises(head):
            return candidate
    known = ", ".join(f.title for f in formats().values())
    raise FormatError(path, f"is none of the formats that gonio reads: {known}", "byte 0")


STRANGERS = {
    b"PK\x03\x04": "a ZIP archive, or a workbook of Excel 2007 or later (.xlsx)",
    b"%PDF": "a PDF document",
    b"\x89PNG": "a PNG picture",
    b"v/1\x01": "an OpenEXR picture",
    b"\xd0\xcf\x11\xe0": "a workbook or document of Microsoft Office 97 of no known instrument",
    b"{": "a JSON document without the metadata and data of a BiRD file",
    b"[": "a JSON list",
    b"<": "an XML or HTML document that is no WindowElement of Radiance",
}


def _stranger(head: bytes) -> str:
    """What a file is that no format with a signature recognises, in words; empty for what may be a table."""
    start = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    return next((what for magic, what in STRANGERS.items() if start.startswith(magic)), "")


def _head(path: Path) -> bytes:
    """The first bytes of a file, or the sorted names in a directory, one a line, each with a stroke in front."""
    if path.is_dir():
        names = sorted(entry.name for entry in path.iterdir())
        head = "".join(f"/{name}\n" for name in names).encode()[:HEAD]
        if any(f.recognises(head) for f in formats().values() if f.rank < LAST):
            return head
        raise FormatError(path, "is a directory: name a file in it")
    if not path.is_file():
        raise FormatError(path, "is not a regular file")
    with path.open("rb") as file:
        return file.read(HEAD)


def read(path: str | Path) -> xr.Dataset:
    """Read a scan in whatever format it is; FormatError names file, place and remedy."""
    found = recognise(path)
    scan = found.read(Path(path))
    return add_history(scan, f"read from {Path(path).name} as {found.title}")


def writer(path: str | Path, to: str = "") -> Format:
    """The format to write: the one named, or the one of the name's suffix; ValueError where that is none or several."""
    writable = {f.name: f for f in formats().values() if f.write}
    if to:
        if formats()[to].write is None:
            raise ValueError(f"{to} is only read; gonio writes {', '.join(writable)}")
        return writable[to]
    path = Path(path)
    meant = [f for f in writable.values() if f.suffix == path.suffix.lower()]
    if len(meant) > 1:
        raise ValueError(f"{path}: several formats are called {path.suffix}: say {' or '.join(f.name for f in meant)}")
    if not meant:
        known = ", ".join(dict.fromkeys(f.suffix for f in writable.values()))
        raise ValueError(f"{path}: no format is written to {path.suffix or 'a name without suffix'}; use {known}")
    return meant[0]


def write(scan: xr.Dataset, path: str | Path, force: bool = False, to: str = "") -> Format:
    """Write a scan in the format of the name's suffix, or the format named `to`; nothing is written over but by force.

    Raises ValueError for a suffix that no format or several write, and for a scan that the format cannot hold as it is;
    `gonio.convert` says what must change and changes it.
    """
    path = Path(path)
    chosen = writer(path, to)
    assert chosen.write is not None
    with replacing(path, force) as temporary:
        chosen.write(scan, temporary)
    return chosen
