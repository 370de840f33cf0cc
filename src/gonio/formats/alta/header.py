"""The header of ALTA's data files: keys in lines that start with `#`, as ALTA's data_storage.cpp reads them.

DIM has the numbers of coordinates and of values in a row, PARAM_IN the name of the coordinates (parametrisations.py),
PARAM_OUT what the values are, VS whether intervals follow the values; the other keys are those of binary files.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

from gonio.door.text import clip
from gonio.files import FormatError
from gonio.formats.alta.parametrisations import PARAMETRISATIONS, Parametrisation

KEYS = ("DIM", "PARAM_IN", "PARAM_OUT", "VS", "FORMAT", "VERSION", "PRECISION", "SAMPLE_COUNT", "ENDIAN")
CHANNELS = {"RGB_COLOR": ("R", "G", "B"), "XYZ_COLOR": ("X", "Y", "Z")}
WITH_COSINE = "INV_STERADIAN_COSINE_FACTOR"
OUTPUTS = ("INV_STERADIAN", WITH_COSINE, *CHANNELS)
MOST_COLUMNS = 1_000
STREAM, END = b"#BEGIN_STREAM", b"#END_STREAM"


def recognises(head: bytes, binary: bool) -> bool:
    """Whether the lines that start with # have ALTA's keys, and state binary numbers exactly where `binary` is set."""
    start = head.removeprefix(b"\xef\xbb\xbf").replace(b"\r", b"\n").partition(STREAM)[0]
    words = [line[1:].split() for line in start.split(b"\n") if line.startswith(b"#")]
    keys = {row[0] for row in words if row}
    if not start.lstrip().startswith(b"#") or b"DIM" not in keys or not keys & {b"PARAM_IN", b"PARAM_OUT"}:
        return False
    return ([b"FORMAT", b"binary"] in words) == binary


@dataclass(frozen=True)
class AltaHeader:
    """The keys of the lines that start with #, each with its value and its line, and the remarks among them."""

    path: Path
    values: dict[str, tuple[str, int]] = field(default_factory=dict)
    remarks: list[str] = field(default_factory=list)

    def take(self, line: int, text: str) -> None:
        """Read one line of the header: a key, a remark or an empty line. Raises FormatError for a repeated key."""
        words = text[1:].split(None, 1)
        if words and text[1] != " " and words[0] in KEYS:
            if words[0] in self.values:
                raise FormatError(self.path, f"#{words[0]} occurs twice", f"line {line}")
            self.values[words[0]] = ("".join(words[1:]).strip(), line)
        elif words and text.encode() != END:
            self.remarks.append(text[1:].strip())

    def wrong(self, key: str, what: str) -> FormatError:
        """The error to raise for the value of `key`, with its line."""
        return FormatError(self.path, what, f"line {self.values.get(key, ('', 1))[1]}")

    def described(self, key: str) -> str:
        """The key and its value, for a message."""
        return f"#{key} is {clip(self.text(key))!r}" if key in self.values else f"there is no #{key}"

    def text(self, key: str, default: str = "") -> str:
        """The value of a key."""
        return self.values.get(key, (default, 1))[0]

    def whole_number(self, key: str, least: int, most: int, default: str = "") -> int:
        """The value of a key as a number from `least` to `most`. Raises FormatError for another value."""
        text = self.text(key, default)
        if not text.isascii() or not text.isdigit() or len(text) > 20 or not least <= int(text) <= most:
            raise self.wrong(key, f"{self.described(key)}: it must be a whole number from {least} to {most}")
        return int(text)

    @property
    def dim(self) -> tuple[int, int]:
        """The numbers of coordinates and of values in a row."""
        words = self.text("DIM").split()
        if len(words) != 2 or not all(w.isascii() and w.isdigit() and 0 < len(w) < 5 for w in words):
            raise self.wrong("DIM", f"{self.described('DIM')}: it must be the numbers of coordinates and values")
        if not 1 <= int(words[1]) <= MOST_COLUMNS:
            raise self.wrong("DIM", f"#DIM says {words[1]} values, outside 1 to {MOST_COLUMNS}")
        return int(words[0]), int(words[1])

    @property
    def parametrisation(self) -> Parametrisation:
        """The coordinates that PARAM_IN names. Raises FormatError for an unknown name, and where DIM disagrees."""
        name = self.text("PARAM_IN")
        if name not in PARAMETRISATIONS:
            remedy = f"it must be one of {', '.join(PARAMETRISATIONS)}; ALTA's data2data converts to these"
            raise self.wrong("PARAM_IN", f"{self.described('PARAM_IN')}: {remedy}")
        parametrisation = PARAMETRISATIONS[name]
        if self.dim[0] != parametrisation.size:
            raise self.wrong("DIM", f"#DIM says {self.dim[0]} coordinates, and {name} has {parametrisation.size}")
        return parametrisation

    @property
    def channels(self) -> tuple[str, ...]:
        """The names of the values in a row, none where there is one value. Raises FormatError for another PARAM_OUT."""
        output, count = self.text("PARAM_OUT"), self.dim[1]
        if output not in OUTPUTS:
            raise self.wrong("PARAM_OUT", f"{self.described('PARAM_OUT')}: it must be one of {', '.join(OUTPUTS)}")
        names = CHANNELS.get(output, tuple(str(k + 1) for k in range(count)) if count > 1 else ())
        if names and len(names) != count:
            raise self.wrong("DIM", f"#DIM says {count} values, and {output} has {len(names)}")
        return names


def header_of(path: Path, numbered: Iterable[tuple[int, str]]) -> tuple[AltaHeader, Iterator[tuple[int, str]]]:
    """The header, and an iterator over the lines from the first row on."""
    header, rest = AltaHeader(path), iter(numbered)
    for line, text in rest:
        if text.strip() and not text.startswith("#"):
            return header, _first_and(line, text, rest)
        header.take(line, text)
    return header, rest


def _first_and(line: int, text: str, rest: Iterator[tuple[int, str]]) -> Iterator[tuple[int, str]]:
    yield line, text
    yield from rest
