"""Reading and writing scans: one module or package for each file format, and a registry of them.

A module declares its format as a `Format` at its end; `formats` imports all modules here and collects them.
A file to read is recognised by its first bytes, never by its name. A file to write gets the format of its suffix.
"""

import functools
import importlib
import logging
import pkgutil
from pathlib import Path

import xarray as xr

from gonio.door import text
from gonio.files import FormatError, replacing
from gonio.formats.format import Format
from gonio.measured.dataset import DIRECTIONS, add_history, is_degree, modes, unit
from gonio.measured.polarimetry.degree import labelled
from gonio.measured.sound import missing
from gonio.model import NearestNames
from gonio.outside import printable
from gonio.tables.request import Request

HEAD = 4096  # bytes that a format may look at to recognise a file
LAST = 100  # rank of the format that accepts any text which no other format recognises


@functools.cache
def formats() -> NearestNames[Format]:
    """Every format by name, in the order in which `recognise` asks them."""
    declared = set()
    for module in pkgutil.iter_modules(__path__):
        contents = vars(importlib.import_module(f"{__name__}.{module.name}"))
        declared |= {value for value in contents.values() if isinstance(value, Format)}
    return NearestNames("format", {f.name: f for f in sorted(declared, key=lambda f: (f.rank, f.name))})


def recognise(path: str | Path) -> Format:
    """The format of a file, from its content. Raises FormatError where the file is missing, empty or unknown."""
    path = Path(path)
    head = _head(path)
    if not head:
        raise FormatError(path, "is empty", "byte 0")
    for candidate in formats().values():
        if candidate.rank >= LAST and (other := _other_file(head)):
            remedy = f", or read it by {Request().command(path)}" if other.endswith(AS_CSV) else ""
            raise FormatError(path, f"is {other}{remedy}", "byte 0")
        if candidate.recognises(head):
            return candidate
    known = ", ".join(f.title for f in formats().values())
    raise FormatError(path, f"is none of the formats that gonio reads: {known}", "byte 0")


NO_BRDF = "gonio knows no BRDF in it"
AS_CSV = "save its table as CSV"
OTHER_FILES = {
    b"PK\x03\x04": f"a workbook or document (.xlsx, .ods, .docx): {AS_CSV}",
    b"\xd0\xcf\x11\xe0": f"a workbook or document of Microsoft Office 97 of no known instrument: {AS_CSV}",
    b"\xff\xfe": "text in UTF-16: save it as UTF-8",
    b"\xfe\xff": "text in UTF-16: save it as UTF-8",
    b"\x93NUMPY": f"an array of NumPy (.npy): {NO_BRDF}",
    b"aISO-1.0": "a height map (SDF): gonio topography tells what it says",
    b"bISO-1.0": "a height map (SDF): gonio topography tells what it says",
    b"%PDF": f"a PDF document: {NO_BRDF}",
    b"\x89PNG": f"a PNG picture: {NO_BRDF}",
    b"v/1\x01": f"an OpenEXR picture: {NO_BRDF}",
    b"{": f"a JSON document without the metadata and data of a BiRD file: {NO_BRDF}",
    b"[": f"a JSON list: {NO_BRDF}",
    b"<": f"an XML or HTML document that is no WindowElement of Radiance: {NO_BRDF}",
}


def _other_file(head: bytes) -> str:
    """A description of a known kind of file that holds no BRDF; empty for a file that may be a table of text."""
    start = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    return next((description for magic, description in OTHER_FILES.items() if start.startswith(magic)), "")


def _head(path: Path) -> bytes:
    """The first bytes of a file; for a directory the sorted names in it, one a line, each after a slash."""
    if path.is_dir():
        names = sorted(entry.name for entry in path.iterdir())
        head = "".join(f"/{name}\n" for name in names).encode("utf-8", "surrogateescape")[:HEAD]
        if any(f.recognises(head) for f in formats().values() if f.rank < LAST):
            return head
        raise FormatError(path, "is a directory: name a file in it")
    return text.head(path, HEAD)


def read(path: str | Path) -> xr.Dataset:
    """Read a scan from a file of any known format, which is recognised by its content.

    Parameters
    ----------
    path : str or Path
        The file, or the folder of a Zarr store.

    Returns
    -------
    xarray.Dataset
        `brdf` [1/sr, relative values in "a.u.", or degrees of polarisation in "1"] over directions in degrees, with
        `uncertainty` and `mask` where the file has them, and what was done to the data in the attribute `history`.

    Raises
    ------
    FormatError
        A ValueError: the file is damaged, or of no known format. It names the file, the place in it and the remedy.
    FileNotFoundError
        There is no such file.

    """
    recognised = recognise(path)
    scan = labelled_in(path, recognised.read(Path(path)))
    logging.getLogger(__name__).info(
        "read %s as %s: %s values", printable(str(path)), recognised.title, scan["brdf"].size
    )
    return add_history(scan, f"read from {Path(path).name} as {recognised.title}")


def labelled_in(path: str | Path, scan: xr.Dataset) -> xr.Dataset:
    """A scan that was read; one of degrees of polarisation says of each which it is, or raises FormatError."""
    if not is_degree(scan):
        return scan
    try:
        return labelled(scan)
    except ValueError as error:
        raise FormatError(Path(path), str(error), "column polarisation") from None


def writer(path: str | Path, to: str = "") -> Format:
    """The format to write: the one named `to`, else the one of the path's suffix.

    Raises ValueError where `to` names a format that is only read, and where no format or several have the suffix.
    """
    writable = {f.name: f for f in formats().values() if f.write}
    if to:
        if formats()[to].write is None:
            raise ValueError(f"{to} is only read; gonio writes {', '.join(writable)}")
        return writable[to]
    path = Path(path)
    candidates = [f for f in writable.values() if f.suffix == path.suffix.lower()]
    if len(candidates) > 1:
        raise ValueError(
            f"{path}: several formats are called {path.suffix}: say {' or '.join(f.name for f in candidates)}"
        )
    if not candidates:
        known = ", ".join(dict.fromkeys(f.suffix for f in writable.values()))
        raise ValueError(f"{path}: no format is written to {path.suffix or 'a name without suffix'}; use {known}")
    return candidates[0]


def write(scan: xr.Dataset, path: str | Path, force: bool = False, to: str = "") -> Format:
    """Write a scan in the format of the path's suffix, or in the format named `to`.

    Parameters
    ----------
    scan : xarray.Dataset
        The scan. What a format cannot hold is refused here; `gonio.convert` makes a scan that it can hold.
    path : str or Path
        Where the file is written.
    force : bool
        Whether a file that exists is replaced.
    to : str
        The name of a format, where the suffix does not tell: `gonio formats` lists them.

    Returns
    -------
    Format
        The format that was written.

    Raises
    ------
    FileExistsError
        The file exists, and `force` is not set.
    ValueError
        The format is not known, is only read, or cannot hold the scan as it is; or the Dataset is no scan: without
        `brdf` or an angle, or with angles that do not say that they are in degrees.

    """
    _refuse_no_scan(scan)
    path = Path(path)
    chosen = writer(path, to)
    assert chosen.write is not None
    if other := sorted(modes(scan) - {*chosen.holds.modes}):
        raise ValueError(f"the scan is of {' and '.join(other)}, and {chosen.title} of {chosen.holds.modes[0]} alone")
    with replacing(path, force) as temporary:
        chosen.write(scan, temporary)
    return chosen


def _refuse_no_scan(scan: xr.Dataset) -> None:
    """ValueError with the remedy for a Dataset that could not be read again after it was written."""
    if lacking := missing(scan):
        raise ValueError(
            f"the Dataset has no {lacking}: a scan needs brdf and the coordinates theta_i, theta_r and phi"
        )
    for name in (n for n in DIRECTIONS if n in scan.variables):
        if scan[name].attrs.get("units") != "degree":
            units = scan[name].attrs.get("units")
            said = f"is in {units!r}" if units else "does not say its unit"
            raise ValueError(f"{name} {said}: give degrees, and set scan[{name!r}].attrs['units'] = 'degree'")
    unit(scan)  # raises where the BRDF does not say its own
