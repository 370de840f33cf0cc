"""The tensor_file container of RGL's (.bsdf) and KAIST's (.pbsdf) measurements: named little-endian arrays.

First come `tensor_file` and a zero byte, the version (two bytes) and the number of fields; for each field the length of
its name, the name, the number of dimensions, the type (1 to 11, see TYPES), offset and shape; then the arrays, each at
its offset. The layout is that of Mitsuba's tensor.cpp.
"""

import math
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from gonio.door.binary import Bytes
from gonio.door.text import MOST_VALUES, clip

MAGIC = b"tensor_file\0"
VERSION = (1, 0)
TYPES = {
    number: np.dtype(name)
    for number, name in enumerate(("u1", "i1", "<u2", "<i2", "<u4", "<i4", "<u8", "<i8", "<f2", "<f4", "<f8"), start=1)
}
MOST_FIELDS, MOST_DIMENSIONS, LONGEST_NAME = 256, 8, 256
ALIGNMENT = 8  # bytes; that of the public writers

Array = npt.NDArray[Any]


class Fields:
    """The arrays of one file by name, as views into it, and the byte at which each begins."""

    def __init__(self, path: Path, most: int = MOST_VALUES) -> None:
        """Read the header. Raises FormatError with the byte offset for sizes that exceed the file, or `most` values."""
        self.bytes = Bytes(path)
        self.arrays: dict[str, Array] = {}
        self.starts: dict[str, int] = {}
        self._header(most)

    def _header(self, most: int) -> None:
        source = self.bytes
        if source.array(np.uint8, (len(MAGIC),), "the file's name").tobytes() != MAGIC:
            raise source.wrong("this is no tensor file: it does not begin with tensor_file", 0)
        version = tuple(source.array(np.uint8, (2,), "the version").tolist())
        if version != VERSION:
            raise source.wrong(
                f"version {version[0]}.{version[1]} of the container is unknown; 1.0 is read", len(MAGIC)
            )
        at = source.at
        count = source.number("<u4", "the number of fields")
        if not 1 <= count <= MOST_FIELDS:
            raise source.wrong(f"{count} fields are outside 1 to {MOST_FIELDS}", at)
        for _ in range(count):
            self._field(most)

    def _field(self, most: int) -> None:
        source, at = self.bytes, self.bytes.at
        length = source.number("<u2", "the length of a field's name")
        if not 1 <= length <= LONGEST_NAME:
            raise source.wrong(f"a field's name has {length} bytes, outside 1 to {LONGEST_NAME}", at)
        name = source.text(length, "a field's name")
        shown = clip(repr(name))
        dimensions = source.number("<u2", f"the dimensions of {shown}")
        if dimensions > MOST_DIMENSIONS:
            raise source.wrong(f"{shown} has {dimensions} dimensions, more than {MOST_DIMENSIONS}", source.at - 2)
        kind = source.number("u1", f"the type of {shown}")
        if kind not in TYPES:
            raise source.wrong(f"the type of {shown} is {kind}, outside 1 to {len(TYPES)}", source.at - 1)
        start = source.number("<u8", f"the offset of {shown}")
        shape = tuple(source.array("<u8", (dimensions,), f"the shape of {shown}").tolist())
        if name in self.arrays:
            raise source.wrong(f"the field {shown} occurs twice", at)
        if math.prod(shape) > most:
            raise source.wrong(f"{shown} has {math.prod(shape)} values, more than {most}", source.at)
        if not math.prod(shape) and shape != (0,):
            raise source.wrong(f"{shown} holds no value: its shape is {shape}", source.at)
        self.arrays[name] = source.array(TYPES[kind], shape, shown, at=start)
        self.starts[name] = start

    def get(self, name: str, kind: str, dimensions: int, least: int = 1) -> Array:
        """A field. Raises FormatError unless it has this type and number of dimensions, each at least `least` long."""
        if name not in self.arrays:
            raise self.bytes.wrong(
                f"there is no field {name}; there are {clip(', '.join(map(repr, self.arrays)), 100)}", 0
            )
        array = self.arrays[name]
        if array.dtype != np.dtype(kind) or array.ndim != dimensions or min(array.shape) < least:
            description = f"{array.dtype} of shape {array.shape}"
            raise self.wrong(name, f"{description} where {dimensions} dimensions of {np.dtype(kind)} were expected")
        return array

    def wrong(self, name: str, what: str, index: int = 0) -> Exception:
        """The error to raise for what is wrong in a field, at the flat `index` of a value."""
        return self.bytes.wrong(f"{name}: {what}", self.starts[name] + index * self.arrays[name].dtype.itemsize)

    def check(self, name: str, good: npt.NDArray[np.bool_], what: str) -> None:
        """Raise FormatError for the first value of the field that is not `good`; `what` describes it."""
        if not good.all():
            index = int(np.argmin(good.ravel()))
            raise self.wrong(name, f"a value is {self.arrays[name].ravel()[index]}, {what}", index)


def write_fields(path: Path, fields: Mapping[str, Array]) -> None:
    """Write arrays by name, in this order, each at a multiple of ALIGNMENT bytes."""
    numbers = {kind: number for number, kind in TYPES.items()}
    stored = {name: np.ascontiguousarray(values) for name, values in fields.items()}
    stored = {name: values.astype(values.dtype.newbyteorder("<"), copy=False) for name, values in stored.items()}
    at = len(MAGIC) + 2 + 4 + sum(2 + len(n.encode()) + 2 + 1 + 8 + 8 * v.ndim for n, v in stored.items())
    header, starts = [MAGIC, struct.pack("<BBI", *VERSION, len(stored))], []
    for name, values in stored.items():
        at = -(-at // ALIGNMENT) * ALIGNMENT
        label = name.encode()
        header.append(struct.pack("<H", len(label)) + label)
        header.append(struct.pack("<HBQ", values.ndim, numbers[values.dtype], at))
        header.append(struct.pack(f"<{values.ndim}Q", *values.shape))
        starts.append(at)
        at += values.nbytes
    with path.open("wb") as file:
        file.write(b"".join(header))
        for start, values in zip(starts, stored.values(), strict=True):
            file.write(bytes(start - file.tell()))
            values.tofile(file)
