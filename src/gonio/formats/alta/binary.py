"""Binary files of the library ALTA: the header of its text files, then float64 numbers after `#BEGIN_STREAM`.

    #FORMAT binary
    #PRECISION ieee754-double
    #SAMPLE_COUNT 2
    #ENDIAN little

The layout is that of ALTA's own reader (data_storage.cpp). ALTA has no suffix for these files; .altab is gonio's. Files
with intervals (#VS) are refused, because how they are stored is not documented.
"""

from pathlib import Path

import numpy as np
import xarray as xr

from gonio.door.binary import Bytes
from gonio.door.text import MOST_VALUES, clip
from gonio.files import FormatError
from gonio.formats.alta.header import END, STREAM, header_of, recognises
from gonio.formats.alta.text import BOUNDS, scan_of, stored
from gonio.formats.format import Format, Holds

ORDERS = {"little": "<f8", "big": ">f8"}
LONGEST_HEADER = 65_536  # bytes


def _read(path: Path) -> xr.Dataset:
    file = Bytes(path)
    head = file.array(np.uint8, (min(file.size, LONGEST_HEADER),), "the header", 0).tobytes()
    raw, mark, rest = head.partition(STREAM)
    if not mark:
        raise file.wrong("has no #BEGIN_STREAM", len(head))
    try:
        text = raw.decode("utf-8").removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        raise file.wrong("the header is no UTF-8 text", error.start) from error
    header, after = header_of(path, enumerate(text.split("\n"), start=1))
    if (other := next(after, None)) is not None:
        raise FormatError(path, f"{clip(other[1])!r} is no line of a header", f"line {other[0]}")
    if header.whole_number("VS", 0, 2, "0"):
        raise header.wrong("VS", "intervals (#VS) in a binary file are not read: save it as text with ALTA's data2data")
    for key, known in (("PRECISION", ("ieee754-double",)), ("VERSION", ("0",)), ("ENDIAN", tuple(ORDERS))):
        if header.text(key) not in known:
            raise header.wrong(key, f"{header.described(key)}: it must be {' or '.join(known)}")
    rows, wide = header.whole_number("SAMPLE_COUNT", 1, MOST_VALUES), sum(header.dim)
    file.at = start = len(raw) + len(mark) + (2 if rest.startswith(b"\r\n") else 1)
    order = ORDERS[header.text("ENDIAN")]
    table = file.array(order, (rows, wide), f"{rows} rows of {wide} numbers").astype(float)
    if file.array(np.uint8, (min(file.size - file.at, 64),), "the end", file.at).tobytes().strip() not in (b"", END):
        raise file.wrong(f"the {rows} rows of #SAMPLE_COUNT are not followed by {END.decode()}")
    if not (finite := np.isfinite(table)).all():
        raise file.wrong("the number is not finite", start + 8 * int((~finite).argmax()))
    return scan_of(header, table, lambda k: f"byte {start + 8 * wide * k}", None)


def _write(scan: xr.Dataset, path: Path) -> None:
    """Write the scan without its intervals. Raises ValueError as for a text file."""
    header, comments, table = stored(scan.drop_vars(BOUNDS, errors="ignore"))
    header |= {"FORMAT": "binary", "VERSION": "0", "PRECISION": "ieee754-double"}
    header |= {"SAMPLE_COUNT": str(len(table)), "ENDIAN": "little"}
    lines_of = [f"#{key} {value}" for key, value in header.items()] + [f"# {line}".rstrip() for line in comments]
    start = "".join(f"{line}\n" for line in lines_of).encode()
    path.write_bytes(start + STREAM + b"\n" + table.astype("<f8").tobytes() + b"\n" + END + b"\n")


FORMAT = Format(
    name="alta-binary",
    title="ALTA binary",
    suffix=".altab",
    recognises=lambda head: recognises(head, binary=True),
    read=_read,
    write=_write,
    holds=Holds(anisotropic=True, sets=("channel",)),
)
