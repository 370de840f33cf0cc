"""A small workbook of an RT-300S, written record by record as Excel 97 lays it out."""

import struct
from collections.abc import Sequence
from pathlib import Path

LABELS = (" Method", " Date", " Azimuth", " Incidence", " Receive", " RT", " RT/nm")
FREE, END, TABLE = 0xFFFFFFFF, 0xFFFFFFFE, 0xFFFFFFFD


def record(kind: int, body: bytes) -> bytes:
    return struct.pack("<HH", kind, len(body)) + body


def short_text(text: str) -> bytes:
    return struct.pack("<HB", len(text), 0) + text.encode("latin-1")


def sheet(columns: Sequence[Sequence[float]]) -> bytes:
    """Columns of azimuth, incidence, receive and RT under the labels; numbers in each of the ways Excel stores them."""
    cells = [record(0x0809, struct.pack("<HHHHII", 0x0600, 0x10, 0, 0, 0, 0))]
    cells += [record(0x00FD, struct.pack("<HHHI", row, 0, 0, row)) for row in range(len(LABELS))]
    for i, (azimuth, _, receive, rt) in enumerate(columns, start=1):
        cells.append(record(0x00FD, struct.pack("<HHHI", 0, i, 0, len(LABELS))))
        cells.append(record(0x027E, struct.pack("<HHHI", 1, i, 0, 40000 << 2 | 2)))
        cells.append(record(0x027E, struct.pack("<HHHI", 2, i, 0, (int(azimuth) << 2 | 2) & 0xFFFFFFFF)))
        cells.append(record(0x0203, struct.pack("<HHHd", 4, i, 0, receive)))
        cells.append(record(0x0203, struct.pack("<HHHd", 5, i, 0, rt)))
    packed = b"".join(struct.pack("<HI", 0, int(column[1]) * 100 << 2 | 3) for column in columns)
    cells.append(record(0x00BD, struct.pack("<HH", 3, 1) + packed + struct.pack("<H", len(columns))))
    return b"".join([*cells, record(0x000A, b"")])


def workbook(sheets: Sequence[Sequence[Sequence[float]]]) -> bytes:
    """A compound file: header, allocation table, directory, the stream."""
    texts = b"".join(map(short_text, (*LABELS, "BRDF_LD")))
    shared = record(0x00FC, struct.pack("<II", len(LABELS) + 1, len(LABELS) + 1) + texts)
    bodies = [sheet(columns) for columns in sheets]
    names = [f"Sheet{i + 1}".encode() for i in range(len(bodies))]
    begin = record(0x0809, struct.pack("<HHHHII", 0x0600, 0x05, 0, 0, 0, 0))
    length = len(begin) + len(shared) + 4 + sum(4 + 8 + len(name) for name in names)
    listed = b""
    for name, body in zip(names, bodies, strict=True):
        listed += record(0x0085, struct.pack("<IHBB", length, 0, len(name), 0) + name)
        length += len(body)
    stream = begin + listed + shared + record(0x000A, b"") + b"".join(bodies)
    stream = stream.ljust(max(4096, -(-len(stream) // 512) * 512), b"\0")
    sectors = len(stream) // 512
    table = [TABLE, END, *range(3, 2 + sectors), END]
    entries = _entry("Root Entry", 5, END, 0) + _entry("Workbook", 2, 2, len(stream)) + 2 * _entry("", 0, 0, 0)
    header = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(16) + struct.pack("<HHHHH", 0x3E, 3, 0xFFFE, 9, 6) + bytes(10)
    header += struct.pack("<IIIIIIIII", 1, 1, 0, 4096, END, 0, END, 0, 0) + struct.pack("<108I", *[FREE] * 108)
    allocation = struct.pack(f"<{128}I", *table, *[FREE] * (128 - len(table)))
    return header + allocation + entries + stream


def _entry(name: str, kind: int, start: int, size: int) -> bytes:
    raw = name.encode("utf-16-le") + b"\0\0" if name else b""
    head = raw.ljust(64, b"\0") + struct.pack("<HBBIII", len(raw), kind, 1, FREE, FREE, FREE)
    return head + bytes(36) + struct.pack("<IIQ", start, size, 0)[:12]


COLUMNS = ((-90.0, 10.0, -80.0, 0.0125), (-90.0, 10.0, 0.0, 0.25), (-90.0, 10.0, 10.0, 0.5), (0.0, 30.0, 45.0, 0.3))


def samples(folder: Path) -> list[Path]:
    path = folder / "rt300s.xls"
    path.write_bytes(workbook([COLUMNS[:2], COLUMNS[2:]]))
    return [path]
