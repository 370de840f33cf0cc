"""Lines that carry their own checksum, of a file that a crash may have cut short: which of them are sound."""

import zlib
from pathlib import Path
from typing import NamedTuple

from gonio.door.text import head
from gonio.files import FormatError

LARGEST = 1_000_000_000  # bytes: more readings than years of measuring give
DIGITS = 8  # of the CRC-32 in hexadecimal


class SoundLines(NamedTuple):
    """The texts of the lines up to the first that is not sound, their length in the file [bytes], and what follows."""

    texts: list[str]
    length: int
    tail: bytes


def line_of(text: str) -> bytes:
    """A line: eight hexadecimal digits of the CRC-32 (zlib) of the text, a space, the text, and the line's end."""
    raw = text.encode()
    return f"{zlib.crc32(raw):0{DIGITS}x} ".encode() + raw + b"\n"


def sound_lines(path: Path) -> SoundLines:
    """The lines of a file that their checksums prove whole, from the first on; all after a broken one is the tail.

    Raises FormatError where there is no such file, or for a file of more than LARGEST bytes.
    """
    raw = head(path, LARGEST + 1)
    if len(raw) > LARGEST:
        raise FormatError(path, f"is larger than {LARGEST // 1_000_000} MB", f"byte {LARGEST}")
    texts: list[str] = []
    start = 0
    while (end := raw.find(b"\n", start)) >= 0:
        digits, space, text = raw[start:end].partition(b" ")
        if not space or digits != f"{zlib.crc32(text):0{DIGITS}x}".encode():
            break
        try:
            texts.append(text.decode())
        except UnicodeDecodeError:
            break
        start = end + 1
    return SoundLines(texts, start, raw[start:])
