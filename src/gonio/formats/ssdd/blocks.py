"""Reading the blocks of an SSDD file: their entries and tables as stored, checked against the size of the file.

The specification is SsddFileFormatSpecification.md, version 0.3, of the public project libbsdf. A table is text or
float32 (little-endian); PARAM0 runs fastest, then PARAM1, PARAM2 and PARAM3.
"""

import math
import mmap
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import numpy.typing as npt

from gonio.door.binary import mapped
from gonio.door.text import MOST_VALUES, clip, number
from gonio.files import FormatError

Values = npt.NDArray[np.float64]

KINDS = ("brdf", "btdf", "specular_reflectance", "specular_transmittance")
COLOURS = {"monochrome": ("",), "rgb": ("R", "G", "B"), "xyz": ("X", "Y", "Z"), "spectrum": ()}
SYSTEMS = ("spherical", "specular", "half_difference", "distorted_spherical")  # each followed by _coordinate_system
STEP = 1e-9  # least step in a list: that of closer numbers is lost to rounding when 180 is added
LISTS = ("WAVELENGTH_LIST", *(f"PARAM{k}_LIST" for k in range(5)))
_OF_A_BLOCK = (*LISTS, "COLOR_MODEL", "PARAM_TYPE", "REDUCTION_TYPE", "DATA", "VERSION")
LONGEST_LINE = 1_000_000  # bytes; a list of angles is one long line
_BATCH = 65_536  # bytes of a table that are read at once
_LINE_END = re.compile(rb"\r\n|\n|\r")
_REMARK = re.compile(r"(?:^|\s)#(?:\s|$)")


@dataclass
class SsddBlock:
    """One block of an SSDD file: the entries of its head, and its values (PARAM3, PARAM2, PARAM1, PARAM0, colour)."""

    kind: str
    colours: str = ""
    system: str = ""
    reductions: frozenset[str] = frozenset()
    lists: dict[str, Values] = field(default_factory=dict)
    values: Values = field(default_factory=lambda: np.empty(0))
    where: str = ""

    @property
    def params(self) -> list[Values]:
        """PARAM0 to PARAM3 [deg]; a single 0 where a list is missing."""
        return [self.lists.get(f"PARAM{k}_LIST", np.zeros(1)) for k in range(4)]

    @property
    def sets(self) -> dict[str, npt.NDArray]:
        """The coordinate that distinguishes the colours: wavelength [nm], channel, or none."""
        if self.colours == "spectrum":
            return {"wavelength": self.lists["WAVELENGTH_LIST"]}
        return {} if self.colours == "monochrome" else {"channel": np.array(COLOURS[self.colours])}


class _Lines:
    """A cursor over a file in which lines of text and binary tables alternate."""

    def __init__(self, path: Path, data: mmap.mmap) -> None:
        self.path, self.data = path, data
        self.at = 3 if data[:3] == b"\xef\xbb\xbf" else 0
        self.line, self.start, self.is_counting = 0, 0, True

    @property
    def where(self) -> str:
        """The place for messages: the line, or after a binary table the byte."""
        return f"line {max(self.line, 1)}" if self.is_counting else f"byte {self.start}"

    def wrong(self, what: str) -> FormatError:
        """The error to raise for what is wrong at this place."""
        return FormatError(self.path, what, self.where)

    def next(self) -> str | None:
        """The next line without its end, None at the end of the file."""
        if self.at >= len(self.data):
            return None
        self.start = self.at
        self.line += 1
        line_end = _LINE_END.search(self.data, self.at, self.at + LONGEST_LINE)
        if line_end is None and len(self.data) - self.at > LONGEST_LINE:
            raise self.wrong(f"is longer than {LONGEST_LINE} bytes: this is no line of text")
        end, self.at = line_end.span() if line_end else (len(self.data), len(self.data))
        raw = self.data[self.start : end]
        if b"\0" in raw:
            raise self.wrong("holds zero bytes where text was expected")
        try:
            return raw.decode("utf-8")
        except UnicodeDecodeError as error:
            raise self.wrong("is not UTF-8 text") from error

    def entries(self, remarks: list[str]) -> Iterator[str]:
        """The lines with an entry, without its remark; a remark on a line of its own is appended to `remarks`."""
        while (text := self.next()) is not None:
            entry, *remark = _REMARK.split(text, maxsplit=1)
            if entry.strip():
                yield entry.strip()
            elif remark and remark[0].strip():
                remarks.append(remark[0].strip())

    def binary(self, count: int) -> Values:
        """A table of `count` numbers in float32, after a check of the size of the file."""
        self.start, self.is_counting = self.at, False
        remaining = len(self.data) - self.at
        if 4 * count > remaining:
            raise self.wrong(f"the table needs {4 * count} bytes, and the file has {remaining} left there")
        raw = self.data[self.at : self.at + 4 * count]
        self.at += 4 * count
        values = np.frombuffer(raw, dtype="<f4")
        if bad := np.flatnonzero(~np.isfinite(values)).tolist():
            raise FormatError(self.path, f"a value is {values[bad[0]]}", f"byte {self.start + 4 * bad[0]}")
        return values.astype(float)

    def ascii(self, rows: int, width: int) -> Values:
        """A table of text, `rows` lines of `width` numbers, as one array (rows * width,)."""
        if rows * 2 * width > len(self.data) - self.at + 1:
            raise self.wrong(f"the lists promise {rows} lines of values, more than the file is long")
        values: list[float] = []
        source = self.entries([])
        k = 0
        while k < rows:
            if batch := self._batch(rows - k, width):
                values += batch
                k += len(batch) // width
                continue
            words = next(source, "").split()
            if len(words) != width:
                problem = f"{len(words)} values where a colour has {width}" if words else "the file ends"
                raise self.wrong(f"{problem}, in line {k + 1} of the {rows} lines of the table")
            values += self.numbers(words, f"value in line {k + 1} of the table")
            k += 1
        return np.array(values)

    def _batch(self, rows: int, width: int) -> list[float]:
        """The values of many lines at once, which is fast; none, without moving, where a line is not as expected."""
        chunk = self.data[self.at : self.at + _BATCH]
        if chunk.count(b"\r") != chunk.count(b"\r\n") or b"_" in chunk:
            return []
        values: list[float] = []
        length = lines = 0
        for raw in chunk.split(b"\n")[:-1]:
            if len(values) == rows * width:
                break
            length += len(raw) + 1
            lines += 1
            words = raw.split() if not raw.startswith(b"#") else []
            if (words and b"#" in raw) or len(words) not in (0, width):
                return []
            try:
                values += map(float, words)
            except ValueError:
                return []
        if not all(map(math.isfinite, values)):
            return []
        if values:
            self.at += length
            self.line += lines
        return values

    def numbers(self, words: list[str], expected: str) -> list[float]:
        """The finite numbers that the words are."""
        try:
            values = list(map(float, words))
        except ValueError:
            values = [math.nan]
        if not all(map(math.isfinite, values)) or "_" in "".join(words):
            try:
                return [number(self.path, self.line, word, expected) for word in words]
            except FormatError as error:
                raise self.wrong(error.what) from error
        return values


def read_blocks(path: Path) -> tuple[list[SsddBlock], list[str]]:
    """The blocks of a file, each kind once, and its lines of provenance. Raises FormatError with the line or byte."""
    with mapped(path) as data:
        lines = _Lines(path, data)
        notes: list[str] = []
        blocks: list[SsddBlock] = []
        source = lines.entries(notes)
        version = next(source, "").split()
        if len(version) != 2 or version[0] != "VERSION" or not re.fullmatch(r"\d{1,4}\.\d{1,4}", version[1]):
            raise lines.wrong("the first entry is not VERSION and a number such as 0.3")
        for entry in source:
            key, _, rest = entry.partition(" ")
            if key == "DATA_TYPE":
                kind = _one_of(lines, key, rest, KINDS)
                if kind in [b.kind for b in blocks]:
                    raise lines.wrong(f"a second block {kind}: a file has one of each kind")
                blocks.append(_block(lines, kind, notes))
            elif re.fullmatch(r"[A-Z][A-Z0-9_]*", key) and key not in _OF_A_BLOCK:
                notes.append(f"{key} {rest.strip()}")
            else:
                raise lines.wrong(f"{clip(entry)!r} where an entry or DATA_TYPE was expected")
        if not blocks:
            raise lines.wrong("the file ends without a DATA_TYPE")
    return blocks, notes


def _one_of(lines: _Lines, key: str, rest: str, allowed: tuple[str, ...]) -> str:
    if rest.strip() not in allowed:
        raise lines.wrong(f"{key} is {clip(rest.strip())!r}, not one of {', '.join(allowed)}")
    return rest.strip()


def _block(lines: _Lines, kind: str, notes: list[str]) -> SsddBlock:
    """Read the entries from DATA_TYPE to DATA, and the table."""
    block = SsddBlock(kind)
    for entry in lines.entries(notes):
        key, _, rest = entry.partition(" ")
        if key in LISTS:
            if key in block.lists:
                raise lines.wrong(f"{key} occurs twice")
            block.lists[key] = np.array(lines.numbers(rest.split(), f"a number of {key}"))
            _check_list(lines, key, block.lists[key])
        elif key == "COLOR_MODEL":
            block.colours = _one_of(lines, key, rest, tuple(COLOURS))
        elif key == "PARAM_TYPE":
            full = tuple(f"{name}_coordinate_system" for name in SYSTEMS)
            block.system = _one_of(lines, key, rest, full).removesuffix("_coordinate_system")
        elif key == "REDUCTION_TYPE":
            for word in rest.split():
                _one_of(lines, key, word, ("bilateral_symmetry", "reciprocity"))
            block.reductions = frozenset(rest.split())
        elif key == "DATA":
            mode = _one_of(lines, key, rest, ("ascii", "binary"))
            block.where = lines.where
            return _with_table(lines, block, mode)
        elif re.fullmatch(r"[A-Z][A-Z0-9_]*", key) and key not in ("VERSION", "DATA_TYPE"):
            notes.append(f"{key} {rest.strip()}")
        else:
            raise lines.wrong(f"{clip(entry)!r} where an entry of the block {kind} or DATA was expected")
    raise lines.wrong(f"the file ends in the head of the block {kind}, before DATA")


def _check_list(lines: _Lines, key: str, values: Values) -> None:
    if not len(values):
        raise lines.wrong(f"{key} is empty")
    if key != "PARAM4_LIST" and np.any(np.diff(values) < STEP):
        raise lines.wrong(f"the numbers of {key} do not ascend by {STEP:g} or more")
    low, high = (-90, 90) if key == "PARAM4_LIST" else (0, 1e9 if key == "WAVELENGTH_LIST" else 360)
    if values.min() < low or values.max() > high or (key == "WAVELENGTH_LIST" and values[0] == 0):
        raise lines.wrong(f"{key} has numbers outside {low} to {high:g}")


def _with_table(lines: _Lines, block: SsddBlock, mode: str) -> SsddBlock:
    """The block with its table, which is read after a check of its size."""
    _check_block(lines, block)
    params = [1 if block.kind.startswith("specular") and k > 1 else len(p) for k, p in enumerate(block.params)]
    width = len(block.lists["WAVELENGTH_LIST"]) if block.colours == "spectrum" else len(COLOURS[block.colours])
    shape = (*params[::-1], width)
    count = int(np.prod([int(n) for n in shape], dtype=object))
    if count > MOST_VALUES:
        raise lines.wrong(f"the lists promise {count} values, more than {MOST_VALUES}")
    values = lines.binary(count) if mode == "binary" else lines.ascii(count // width, width)
    block.values = values.reshape(shape)
    return block


def _check_block(lines: _Lines, block: SsddBlock) -> None:
    if not block.colours or "PARAM0_LIST" not in block.lists:
        raise lines.wrong(f"the block {block.kind} has no {'PARAM0_LIST' if block.colours else 'COLOR_MODEL'}")
    if block.colours == "spectrum" and "WAVELENGTH_LIST" not in block.lists:
        raise lines.wrong("a spectrum without WAVELENGTH_LIST")
    is_specular = block.kind.startswith("specular")
    if not is_specular and not block.system:
        raise lines.wrong(f"the block {block.kind} has no PARAM_TYPE")
    ranges = {"specular": (90, 360, 180, 360)}.get(block.system, (90, 360, 90, 360))
    for k, (params, high) in enumerate(zip(block.params, ranges, strict=True)):
        if params[-1] > high:
            raise lines.wrong(f"PARAM{k}_LIST reaches {params[-1]:g} deg, beyond {high}")
    if "PARAM4_LIST" in block.lists:
        if block.system not in ("specular", "distorted_spherical"):
            raise lines.wrong("PARAM4_LIST belongs to specular and distorted spherical coordinates")
        if len(block.lists["PARAM4_LIST"]) != len(block.params[0]):
            raise lines.wrong("PARAM4_LIST has not as many angles as PARAM0_LIST")
    if "reciprocity" in block.reductions and block.system != "half_difference":
        raise lines.wrong("reciprocity belongs to half_difference_coordinate_system")
    high = 360 if not block.reductions else 90 if len(block.reductions) == 2 else 180
    if not is_specular and block.params[3][-1] > high:
        raise lines.wrong(f"PARAM3_LIST reaches {block.params[3][-1]:g} deg, beyond the {high} of its REDUCTION_TYPE")
    if block.system == "spherical" and block.reductions and len(block.params[1]) > 1:
        raise lines.wrong(
            "bilateral_symmetry of data that depend on PARAM1, the incoming azimuth: none follows from it"
        )
