"""ISO 25178-72 files (.x3p): a ZIP archive with main.xml and the heights in binary; lengths in metres."""

import hashlib
import io
import math
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gonio.door.containers.zip_members import Archive
from gonio.door.elements import Element, parse_stream
from gonio.door.packed import ZIP
from gonio.door.text import MOST_VALUES, clip
from gonio.files import FormatError
from gonio.topography.heights import Grid

INDEX = "main.xml"
LARGEST_INDEX = 2**22  # bytes of XML
UM = 1e6  # um in a metre
TYPES = {"I": "<i2", "L": "<i4", "F": "<f4", "D": "<f8"}
KEPT = ("Date", "Manufacturer", "Model", "Serial", "Version", "ProbingSystem", "Comment", "Creator")


def recognises(head: bytes) -> bool:
    """Whether a file that begins with these bytes may be one: an archive, whose names `is_x3p` asks for."""
    return head.startswith(ZIP)


def is_x3p(path: Path) -> bool:
    """Whether an archive holds the index of an X3P file. Raises FormatError for a damaged one."""
    return INDEX in Archive(path)


def read(path: Path) -> Grid:
    """The heights of a file. Raises FormatError with the line of main.xml or the byte of the archive."""
    archive = Archive(path)
    root, _ = parse_stream(path / INDEX, io.BytesIO(archive.read(INDEX, LARGEST_INDEX)))
    axes = root.child("Record1").child("Axes")
    sizes = root.child("Record3").child("MatrixDimension")
    columns, rows, layers = (_count(sizes.child(name)) for name in ("SizeX", "SizeY", "SizeZ"))
    if layers != 1:
        raise sizes.wrong(f"SizeZ is {layers}: gonio reads one layer of heights")
    if columns * rows > MOST_VALUES:
        raise sizes.wrong(f"promises {columns * rows} heights, more than {MOST_VALUES}: cut out a part")
    across = axes.child("CX"), axes.child("CY")
    for axis in across:
        if (kind := axis.word("AxisType")) != "I":
            raise axis.wrong(f"{axis.tag} is of the type {clip(kind)}: gonio reads points in equal steps, I")
    dx, dy = (_number(axis.child("Increment")) * UM for axis in across)
    z = _heights(archive, root, axes.child("CZ"), (rows, columns))
    return Grid(z, dx, dy, f"line {sizes.line} of {INDEX}", _provenance(root))


def _heights(archive: Archive, root: Element, axis: Element, shape: tuple[int, int]) -> npt.NDArray[np.float64]:
    link = root.child("Record3").find("DataLink")
    if link is None:
        raise root.child("Record3").wrong("lists its points as text, and gonio reads heights in binary: save it so")
    kind = axis.word("DataType")
    if kind not in TYPES:
        raise axis.wrong(f"DataType is {clip(kind)}, and {', '.join(TYPES)} are known")
    dtype = np.dtype(TYPES[kind])
    raw = _member(archive, link, "PointDataLink", math.prod(shape) * dtype.itemsize)
    _check_sum(link, "MD5ChecksumPointData", raw)
    step = axis.find("Increment")
    start = axis.find("Offset")
    scale = _number(step) if step is not None and step.text.strip() else 1.0
    offset = _number(start) if start is not None and start.text.strip() else 0.0
    with np.errstate(over="ignore", invalid="ignore"):
        z = (np.frombuffer(raw, dtype).astype(float) * scale + offset).reshape(shape) * UM
    if link.find("ValidPointsLink") is not None and link.child("ValidPointsLink").text.strip():
        bits = _member(archive, link, "ValidPointsLink", -(-math.prod(shape) // 8))
        _check_sum(link, "MD5ChecksumValidPoints", bits)
        valid = np.unpackbits(np.frombuffer(bits, np.uint8), count=math.prod(shape), bitorder="little")
        z[valid.reshape(shape) == 0] = np.nan
    return z


def _member(archive: Archive, link: Element, tag: str, size: int) -> bytes:
    """The bytes of the member that an element names. Raises FormatError where it has another size."""
    name = link.word(tag)
    if name not in archive:
        raise link.child(tag).wrong(f"{tag} names {clip(name)}, which the archive does not hold")
    if archive.size(name) != size:
        what = f"{clip(name)} has {archive.size(name)} bytes, and the matrix needs {size}"
        raise FormatError(archive.path, what, f"byte {archive.at(name)}")
    return archive.read(name, size)


def _check_sum(link: Element, tag: str, raw: bytes) -> None:
    stated = link.find(tag)
    if stated is None or not stated.text.strip():
        return
    if hashlib.md5(raw, usedforsecurity=False).hexdigest() != stated.text.strip().lower():
        raise stated.wrong("the heights have another checksum than the file says: it is damaged, get it again")


def _count(element: Element) -> int:
    text = element.text.strip()
    if not (text.isascii() and text.isdecimal() and len(text) < 10 and int(text)):
        raise element.wrong(f"{element.tag} is {clip(text)!r}, not a count")
    return int(text)


def _number(element: Element) -> float:
    text = element.text.strip()
    try:
        value = math.nan if "_" in text else float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise element.wrong(f"{element.tag} is {clip(text)!r}, not a finite number")
    return value


def _provenance(root: Element) -> str:
    """What Record2 says of the measurement, a line each."""
    record = root.find("Record2")
    places = [record, *record.children] if record else []
    said = [f"{one.tag}: {' '.join(one.text.split())}" for p in places for one in p.children if one.tag in KEPT]
    return "\n".join(line for line in said if not line.endswith(": "))
