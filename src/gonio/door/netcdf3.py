"""NetCDF's classic format (CDF-1 and, with 64-bit offsets, CDF-2), read by its published grammar.

Every count is checked against the size of the file before anything of its size is allocated. Errors have the byte
offset.
"""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.door.binary import Bytes
from gonio.door.text import MOST_VALUES, clip

MAGIC = (b"CDF\x01", b"CDF\x02")
TYPES = {1: "i1", 2: "S1", 3: ">i2", 4: ">i4", 5: ">f4", 6: ">f8"}
_DIMENSIONS, _VARIABLES, _ATTRIBUTES = 10, 11, 12
_KINDS = {_DIMENSIONS: "dimensions", _VARIABLES: "variables", _ATTRIBUTES: "attributes"}
MOST_ENTRIES = 10_000  # dimensions, variables or attributes in one list
MOST_DIMS = 16
STREAMING = -1  # number of records in a file that its writer did not close


@dataclass(frozen=True)
class Length:
    """The length of a dimension. The unlimited dimension (`grows`) is as long as the file has records."""

    value: int
    grows: bool


@dataclass(frozen=True)
class DeclaredVariable:
    """A variable as the header declares it; its values begin at byte `begin`."""

    name: str
    dims: tuple[str, ...]
    attrs: dict[str, Any]
    dtype: str
    begin: int

    def grows(self, lengths: dict[str, Length]) -> bool:
        """Whether its first dimension is the unlimited one, so that its values are spread over the records."""
        return bool(self.dims) and lengths[self.dims[0]].grows

    def record_size(self, lengths: dict[str, Length]) -> int:
        """Bytes of one record."""
        return math.prod(lengths[name].value for name in self.dims[1:]) * np.dtype(self.dtype).itemsize


def read(path: Path) -> tuple[xr.Dataset, dict[str, int]]:
    """The Dataset as stored, without decoding, and the byte at which the values of each variable begin.

    Raises FormatError with the byte offset.
    """
    raw = Bytes(path)
    is_long = raw.array(np.uint8, (4,), "the signature")[3] == 2
    records = raw.number(">i4", "the number of records")
    lengths = _dimensions(raw, records)
    attrs = _attributes(raw)
    declared = _variables(raw, lengths, ">i8" if is_long else ">i4")
    stored = {v.name: (v.dims, _values(raw, v, lengths, declared), v.attrs) for v in declared}
    return xr.Dataset(stored, attrs=attrs), {v.name: v.begin for v in declared}


def _entries(raw: Bytes, kind: int) -> int:
    """The number of entries of a list of one kind, 0 where the list is absent."""
    at = raw.at
    tag, count = raw.number(">i4", f"the list of {_KINDS[kind]}"), raw.number(">i4", f"the number of {_KINDS[kind]}")
    if tag != kind and (tag, count) != (0, 0):
        raise raw.wrong(f"tag {tag} where the list of {_KINDS[kind]} was expected, tag {kind}", at)
    if not 0 <= count <= MOST_ENTRIES:
        raise raw.wrong(f"{count} {_KINDS[kind]}, outside 0 to {MOST_ENTRIES}", at + 4)
    return count


def _padded(raw: Bytes, length: int) -> None:
    raw.array(np.uint8, (-length % 4,), "padding to four bytes")


def _name(raw: Bytes, of: str) -> str:
    at = raw.at
    length = raw.number(">i4", f"the length of the name of {of}")
    text = raw.text(length, f"the name of {of}")
    _padded(raw, length)
    if not text or not text.isprintable():
        raise raw.wrong(f"the name of {of} is {clip(text)!r}", at)
    return text


def _dimensions(raw: Bytes, records: int) -> dict[str, Length]:
    dimensions: dict[str, Length] = {}
    for _ in range(_entries(raw, _DIMENSIONS)):
        at = raw.at
        name, length = _name(raw, "a dimension"), raw.number(">i4", "the length of a dimension")
        if name in dimensions or not 0 <= length <= MOST_VALUES:
            problem = "occurs twice" if name in dimensions else f"has the length {length}, outside 0 to {MOST_VALUES}"
            raise raw.wrong(f"the dimension {clip(name)!r} {problem}", at)
        if length == 0 and any(other.grows for other in dimensions.values()):
            raise raw.wrong(f"{clip(name)!r} is a second unlimited dimension", at)
        if length == 0 and not 0 <= records <= MOST_VALUES:
            never = "was never written" if records == STREAMING else f"is {records}, outside 0 to {MOST_VALUES}"
            raise raw.wrong(f"the number of records {never}: close the file in the program that writes it", 4)
        dimensions[name] = Length(length or records, grows=length == 0)
    return dimensions


def _attributes(raw: Bytes) -> dict[str, Any]:
    attributes: dict[str, Any] = {}
    for _ in range(_entries(raw, _ATTRIBUTES)):
        at = raw.at
        name, kind = _name(raw, "an attribute"), _type(raw)
        length = raw.number(">i4", f"the length of the attribute {clip(name)!r}")
        if name in attributes:
            raise raw.wrong(f"the attribute {clip(name)!r} occurs twice", at)
        if kind == "S1":
            attributes[name] = raw.text(length, f"the attribute {clip(name)!r}").rstrip(
                "\0"
            )  # an empty text is stored as one zero byte
        else:
            values = raw.array(kind, (length,), f"the attribute {clip(name)!r}")
            native = values.astype(values.dtype.newbyteorder("="))
            attributes[name] = native[0] if length == 1 else native
        _padded(raw, length * np.dtype(kind).itemsize)
    return attributes


def _type(raw: Bytes) -> str:
    at = raw.at
    number = raw.number(">i4", "a type")
    if number not in TYPES:
        raise raw.wrong(f"type {number} is none of NetCDF's, 1 to {len(TYPES)}", at)
    return TYPES[number]


def _variables(raw: Bytes, lengths: dict[str, Length], offset: str) -> list[DeclaredVariable]:
    variables: dict[str, DeclaredVariable] = {}
    room = raw.size
    for _ in range(_entries(raw, _VARIABLES)):
        at = raw.at
        name = _name(raw, "a variable")
        dims = _dims(raw, f"{clip(name)!r}", list(lengths))
        attrs, kind = _attributes(raw), _type(raw)
        raw.number(
            ">i4", f"the size of {clip(name)!r}"
        )  # it follows from the dimensions, and is wrong for large variables
        begin = raw.number(offset, f"the place of {clip(name)!r}")
        if name in variables:
            raise raw.wrong(f"the variable {clip(name)!r} occurs twice", at)
        room -= math.prod(lengths[dim].value for dim in dims) * np.dtype(kind).itemsize
        if room < 0 or begin < at:
            raise raw.wrong(f"the variable {clip(name)!r} needs more bytes than there are, or lies in the header", at)
        variables[name] = DeclaredVariable(name, dims, attrs, kind, begin)
    return list(variables.values())


def _dims(raw: Bytes, of: str, names: list[str]) -> tuple[str, ...]:
    at = raw.at
    rank = raw.number(">i4", f"the number of dimensions of {of}")
    if not 0 <= rank <= MOST_DIMS:
        raise raw.wrong(f"{of} has {rank} dimensions, outside 0 to {MOST_DIMS}", at)
    numbers = raw.array(">i4", (rank,), f"the dimensions of {of}").tolist()
    if not all(0 <= number < len(names) for number in numbers) or len(set(numbers)) < rank:
        raise raw.wrong(f"{of} has a dimension that is not declared, or one twice", at)
    return tuple(names[number] for number in numbers)


def _values(
    raw: Bytes, variable: DeclaredVariable, lengths: dict[str, Length], declared: list[DeclaredVariable]
) -> np.ndarray:
    """The values in the byte order of the machine; those along the unlimited dimension are gathered from records."""
    expected, shape = f"the variable {clip(variable.name)!r}", tuple(lengths[name].value for name in variable.dims)
    if not variable.grows(lengths):
        values = raw.array(variable.dtype, shape, expected, at=variable.begin)
        return values.astype(values.dtype.newbyteorder("="))
    sizes = {v.name: v.record_size(lengths) for v in declared if v.grows(lengths)}
    step = sum(size + -size % 4 for size in sizes.values()) if len(sizes) > 1 else sizes[variable.name]
    record_bytes, records = sizes[variable.name], shape[0]
    span = (records - 1) * step + record_bytes if records and record_bytes else 0
    block = raw.array(np.uint8, (span,), expected, at=variable.begin)
    rows = (
        np.lib.stride_tricks.as_strided(block, (records, record_bytes), (step, 1))
        if span
        else block.reshape(0, record_bytes or 1)
    )
    values = np.ascontiguousarray(rows).view(variable.dtype).reshape(shape)
    return values.astype(values.dtype.newbyteorder("="))
