"""An array of numbers as NumPy stores it (.npy, format versions 1 to 3); arrays of Python objects are refused."""

import ast
import re
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from gonio.door.binary import Bytes
from gonio.door.text import MOST_VALUES, clip

MAGIC = b"\x93NUMPY"
LONGEST_HEADER = 10_000  # bytes, as NumPy itself has it
NUMBER = re.compile(r"[<>|=]?[fiu][1248]")  # floating point and whole numbers: nothing that runs code
KEYS = {"descr", "fortran_order", "shape"}


def read(path: Path) -> npt.NDArray[Any]:
    """The array of numbers of a file, mapped into memory. Raises FormatError with the byte of what is wrong."""
    data = Bytes(path)
    data.array(np.uint8, (len(MAGIC),), "the signature of NumPy")
    version = data.number(np.uint8, "the version")
    data.number(np.uint8, "the minor version")
    if version not in (1, 2, 3):
        raise data.wrong(f"is version {version} of NumPy's format, and 1 to 3 are known", len(MAGIC))
    length = data.number("<u2" if version == 1 else "<u4", "the length of the header")
    if length > LONGEST_HEADER:
        raise data.wrong(f"has a header of {length} bytes: no array of numbers has one longer than {LONGEST_HEADER}")
    at = data.at
    header = _header(data, data.text(length, "the header"), at)
    descr, shape = header["descr"], header["shape"]
    if not isinstance(descr, str) or not NUMBER.fullmatch(descr) or descr[-2:] == "f1":
        raise data.wrong(f"holds elements of the type {clip(repr(descr))}: save the heights as an array of numbers", at)
    counts = isinstance(shape, tuple) and all(type(n) is int and 0 < n <= MOST_VALUES for n in shape)
    if not counts or len(shape) > 8:
        raise data.wrong(f"has the shape {clip(repr(shape))}, which no array of numbers has", at)
    total = 1
    for n in shape:
        total *= n
    if total > MOST_VALUES:
        raise data.wrong(f"has {total} values, more than {MOST_VALUES}: cut out a part of it", at)
    in_columns = bool(header["fortran_order"])
    values = data.array(np.dtype(descr), shape[::-1] if in_columns else shape, f"the array of {total} numbers")
    return values.T if in_columns else values


def _header(data: Bytes, text: str, at: int) -> dict[str, Any]:
    try:
        header = ast.literal_eval(text.strip())
    except (ValueError, SyntaxError, TypeError, MemoryError, RecursionError) as error:
        raise data.wrong("the header is no dictionary of NumPy", at) from error
    if not isinstance(header, dict) or set(header) != KEYS:
        raise data.wrong("the header does not say type, order and shape alone", at)
    return header
