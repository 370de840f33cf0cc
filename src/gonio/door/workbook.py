"""The cells of an Excel 97 workbook (.xls), as instruments export them: numbers, texts and the values of formulas.

A compound file (mscfb) holds the stream `Workbook`, whose records (msxls) hold the cells. Every length and every chain
of sectors is checked against the file before it is followed, so that a damaged file is refused with the byte.
"""

import struct
from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gonio.files import FormatError

MAGIC = b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1"
MOST_BYTES = 16 * 2**20  # enough for 11 sheets of 254 columns with every wavelength in steps of 1 nm
SMALLEST = 4096  # bytes; a smaller stream is stored elsewhere, and no sheet of a goniometer is so small
BOF, EOF, BOUNDSHEET, SST, CONTINUE, FILEPASS, DATEMODE = 0x0809, 0x000A, 0x0085, 0x00FC, 0x003C, 0x002F, 0x0022
NUMBER, RK, MULRK, LABELSST, LABEL, FORMULA = 0x0203, 0x027E, 0x00BD, 0x00FD, 0x0204, 0x0006
BIFF8 = 0x0600

Cells = dict[tuple[int, int], "Cell"]


class Cell(NamedTuple):
    """A number or a text, and the byte of the file where its record begins."""

    value: float | str
    at: int


def sheets(path: Path) -> dict[str, Cells]:
    """The cells of each sheet by (row, column) from 0. Raises FormatError with the byte of what is damaged."""
    size = path.stat().st_size
    if size > MOST_BYTES:
        raise FormatError(path, f"has {size} bytes: no workbook of a goniometer is larger than {MOST_BYTES}", "byte 0")
    content = path.read_bytes()
    try:
        return _Workbook(path, content).sheets()
    except (struct.error, IndexError) as error:  # a record or header that is too short for its kind
        raise FormatError(path, "a record is cut short", f"byte {len(content)}") from error


class _Container:
    """A compound file (mscfb): sectors, the allocation table that chains them, and the directory of streams."""

    def __init__(self, path: Path, content: bytes) -> None:
        self.path, self.content = path, content
        if content[:8] != MAGIC:
            raise self.wrong("is no compound file", 0)
        shift = struct.unpack_from("<H", content, 30)[0] if len(content) >= 512 else 0
        if shift not in (9, 12):
            raise self.wrong("a compound file has sectors of 512 or 4096 bytes", 30)
        self.sector = 1 << shift
        self.count = max(len(content) - self.sector, 0) // self.sector  # whole sectors after the header
        self.table = self._table()

    def wrong(self, what: str, at: int) -> FormatError:
        """The error to raise for what is wrong at byte `at` of the file."""
        return FormatError(self.path, what, f"byte {at}")

    def at(self, sector: int) -> int:
        """The byte at which a sector begins."""
        return (sector + 1) * self.sector

    def _numbers(self, sector: int) -> npt.NDArray[np.uint32]:
        if sector >= self.count:
            raise self.wrong(f"the allocation table names sector {sector}, and the file has {self.count}", 76)
        return np.frombuffer(self.content, dtype="<u4", count=self.sector // 4, offset=self.at(sector))

    def _table(self) -> npt.NDArray[np.uint32]:
        """The allocation table: the next sector of each. The header lists its own sectors, a chain lists the rest."""
        wanted, extra = struct.unpack_from("<I", self.content, 44)[0], struct.unpack_from("<I", self.content, 68)[0]
        listed = list(struct.unpack_from("<109I", self.content, 76))
        for _ in range(self.count):
            if extra >= self.count or len(listed) >= wanted:
                break
            more = self._numbers(extra)
            listed += more[:-1].tolist()
            extra = int(more[-1])
        if not 0 < wanted <= min(self.count, len(listed)):
            raise self.wrong(f"the allocation table has {wanted} sectors, and the file {self.count}", 44)
        return np.concatenate([self._numbers(sector) for sector in listed[:wanted]])

    def chain(self, start: int, expected: str) -> list[int]:
        """The sectors of a chain. Raises FormatError where it leaves the file or is a circle."""
        sectors: list[int] = []
        sector = start
        while sector < 0xFFFFFFFA:
            if sector >= min(self.count, len(self.table)) or len(sectors) > self.count:
                at = self.at(sectors[-1]) if sectors else 48
                raise self.wrong(f"the chain of {expected} leaves the file or runs in a circle", at)
            sectors.append(sector)
            sector = int(self.table[sector])
        return sectors

    def stream(self, *names: str) -> tuple[bytes, list[int]]:
        """The bytes of the first stream with one of these names, and its sectors."""
        for sector in self.chain(struct.unpack_from("<I", self.content, 48)[0], "the directory"):
            for at in range(self.at(sector), self.at(sector) + self.sector, 128):
                length = struct.unpack_from("<H", self.content, at + 64)[0]
                name = self.content[at : at + max(min(length, 64) - 2, 0)].decode("utf-16-le", "replace")
                if name in names and self.content[at + 66] == 2:
                    return self._bytes(at, name)
        raise self.wrong(f"holds no stream {' or '.join(names)}: this is no Excel workbook", 48)

    def _bytes(self, at: int, name: str) -> tuple[bytes, list[int]]:
        start, size = struct.unpack_from("<II", self.content, at + 116)
        if size < SMALLEST:
            raise self.wrong(f"the stream {name} has {size} bytes: too few for a sheet of measurements", at + 120)
        sectors = self.chain(start, f"the stream {name}")
        if size > len(sectors) * self.sector:
            raise self.wrong(f"the stream {name} should have {size} bytes, and the file is cut off", at + 120)
        parts = (self.content[self.at(s) : self.at(s) + self.sector] for s in sectors)
        return b"".join(parts)[:size], sectors


class _Workbook:
    """The stream of a workbook (msxls): records of the workbook itself, then those of its sheets."""

    def __init__(self, path: Path, content: bytes) -> None:
        self.file = _Container(path, content)
        self.stream, self.sectors = self.file.stream("Workbook", "Book")
        self.bytes_left = 0  # of the stream; each byte belongs to one sheet

    def wrong(self, what: str, at: int) -> FormatError:
        """The error to raise for what is wrong at byte `at` of the stream."""
        return self.file.wrong(what, self.place(at))

    def place(self, at: int) -> int:
        """The byte of the file for a byte of the stream."""
        sector, rest = divmod(min(at, len(self.stream) - 1), self.file.sector)
        return self.file.at(self.sectors[sector]) + rest

    def records(self, start: int) -> list[tuple[int, int, bytes]]:
        """Kind, place in the stream and body of the records from BOF at `start` to the next EOF."""
        records: list[tuple[int, int, bytes]] = []
        at = start
        while True:
            if at + 4 > len(self.stream):
                raise self.wrong("the workbook ends within a sheet", at)
            kind, length = struct.unpack_from("<HH", self.stream, at)
            if at + 4 + length > len(self.stream):
                raise self.wrong(f"a record of {length} bytes is longer than the rest of the workbook", at)
            if not records and (kind != BOF or length < 4):
                raise self.wrong("no beginning of a sheet is there", at)
            records.append((kind, at, self.stream[at + 4 : at + 4 + length]))
            if kind == EOF:
                return records
            at += 4 + length

    def sheets(self) -> dict[str, Cells]:
        """The cells of each sheet. Raises FormatError for older versions, passwords and days counted from 1904."""
        listed = self.records(0)
        if struct.unpack_from("<H", listed[0][2])[0] != BIFF8:
            raise self.wrong("is older than Excel 97: save it as .xls of Excel 97 or later", 0)
        if locked := [at for kind, at, _ in listed if kind == FILEPASS]:
            raise self.wrong("is locked by a password: save it without one", locked[0])
        if late := [at for kind, at, body in listed if kind == DATEMODE and body[:2] == b"\1\0"]:
            raise self.wrong("counts its days from 1904: save it with those from 1900", late[0])
        texts = self._shared_texts(listed)
        sheets: dict[str, Cells] = {}
        self.bytes_left = len(self.stream)
        for kind, at, body in listed:
            if kind == BOUNDSHEET and len(body) >= 8 and body[5] == 0:
                name = _text(body[8:], body[6], body[7])
                start = struct.unpack_from("<I", body)[0]
                if name in sheets or start >= len(self.stream) or len(sheets) > 255:
                    raise self.wrong("a sheet is listed twice, or lies beyond the file", at)
                sheets[name] = self._cells(start, texts)
        if not sheets:
            raise self.wrong("holds no sheet", 0)
        return sheets

    def _cells(self, start: int, texts: list[str]) -> Cells:
        cells: Cells = {}
        records = self.records(start)
        self.bytes_left -= records[-1][1] - start
        if self.bytes_left < 0:
            raise self.wrong("two sheets overlap", start)
        for kind, at, body in records:
            if kind not in (NUMBER, RK, MULRK, LABELSST, LABEL, FORMULA):
                continue
            if len(body) < 10:
                raise self.wrong("a cell is cut short", at)
            row, column = struct.unpack_from("<HH", body)
            for i, value in enumerate(self._values(kind, at, body, texts)):
                cells[row, column + i] = Cell(value, self.place(at))
        return cells

    def _values(self, kind: int, at: int, body: bytes, texts: list[str]) -> list[float | str]:
        if kind == RK:
            return [_packed(struct.unpack_from("<I", body, 6)[0])]
        if kind == MULRK:
            return [_packed(struct.unpack_from("<I", body, i)[0]) for i in range(6, len(body) - 5, 6)]
        if kind == LABELSST:
            index = struct.unpack_from("<I", body, 6)[0]
            if index >= len(texts):
                raise self.wrong(f"a cell names text {index}, and the workbook has {len(texts)}", at)
            return [texts[index]]
        if kind == LABEL:
            length = struct.unpack_from("<H", body, 6)[0]
            return [_text(body[9:], length, body[8])]
        if len(body) < 14:
            raise self.wrong("a cell is cut short", at)
        is_number = kind == NUMBER or body[12:14] != b"\xff\xff"  # the value of a formula may be a text or an error
        return [struct.unpack_from("<d", body, 6)[0]] if is_number else []

    def _shared_texts(self, records: list[tuple[int, int, bytes]]) -> list[str]:
        """The shared texts, to which cells refer. A text may continue from one record into the next."""
        first = next((i for i, (kind, _, _) in enumerate(records) if kind == SST), None)
        if first is None:
            return []
        parts = [records[first][2]]
        for kind, _, body in records[first + 1 :]:
            if kind != CONTINUE:
                break
            parts.append(body)
        try:
            return _Texts(parts).all()
        except (struct.error, IndexError) as error:
            raise self.wrong("the texts of the workbook are cut short", records[first][1]) from error


class _Texts:
    """A cursor over the record of shared texts and the records that continue it."""

    def __init__(self, parts: list[bytes]) -> None:
        self.parts, self.part, self.at = parts, 0, 0

    def all(self) -> list[str]:
        """All texts, in order."""
        count = struct.unpack("<II", self._take(8))[1]
        most = sum(map(len, self.parts)) // 3  # a text takes at least three bytes
        return [self._next_text() for _ in range(min(count, most))]

    def _take(self, length: int) -> bytes:
        """`length` bytes, over as many records as they take."""
        taken = b""
        while len(taken) < length:
            if self.at >= len(self.parts[self.part]):
                self.part, self.at = self.part + 1, 0
            piece = self.parts[self.part][self.at : self.at + length - len(taken)]
            taken, self.at = taken + piece, self.at + len(piece)
        return taken

    def _next_text(self) -> str:
        length, flags = struct.unpack("<HB", self._take(3))
        runs = struct.unpack("<H", self._take(2))[0] if flags & 8 else 0
        extra = struct.unpack("<I", self._take(4))[0] if flags & 4 else 0
        text = ""
        while len(text) < length:
            if self.at >= len(self.parts[self.part]):  # the text continues in the next record, after new flags
                self.part, self.at = self.part + 1, 0
                flags = self._take(1)[0]
            width = 2 if flags & 1 else 1
            available = min(length - len(text), (len(self.parts[self.part]) - self.at) // width)
            if available <= 0:
                raise IndexError("a character is cut in two")
            text += _text(self._take(available * width), available, flags)
        extra_bytes = 4 * runs + extra
        if extra_bytes > sum(map(len, self.parts)):
            raise IndexError("marks beyond the record")
        self._take(extra_bytes)
        return text


def _text(raw: bytes, length: int, flags: int) -> str:
    """`length` characters of one or two bytes each."""
    if flags & 1:
        return raw[: 2 * length].decode("utf-16-le", "replace")
    return raw[:length].decode("latin-1")


def _packed(bits: int) -> float:
    """A number in 30 bits (RK): an integer or the upper bits of a double; a flag means that it is stored times 100."""
    if bits & 2:
        value = float((bits >> 2) - (1 << 30) if bits & 0x80000000 else bits >> 2)
    else:
        value = float(struct.unpack("<d", struct.pack("<Q", (bits & 0xFFFFFFFC) << 32))[0])
    return value / 100 if bits & 1 else value
