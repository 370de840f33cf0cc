"""The grammar that the four kinds of Integra's text files share: `;;` comments, keywords, one table per channel.

Keywords are in any case. The grammar is that of the public reader libbsdf (DdrReader.cpp, SdrReader.cpp); Integra's own
description is not public.
"""

import functools
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.text import MOST_VALUES, Words, clip, lines, remark_lines
from gonio.files import FormatError
from gonio.measured.dataset import HORIZON

Values = npt.NDArray[np.float64]

COMMENT = ";;"
OF_REFLECTION, OF_TRANSMISSION = (".ddr", ".sdr"), (".ddt", ".sdt")  # suffixes
TRANSMITTED = "transmission: no keyword says so"  # the comment by which gonio marks files of transmission
LONGEST_LINE = 1_000_000  # bytes; some programs write a lobe or all factors kbdf on one line
SYMMETRIES = ("AxiSymmetrical", "DirSymmetrical", "PlaneSymmetrical", "ASymmetrical")
RANGES = {"psi": 360.0, "sigma": 90.0, "sigmat": 90.0, "phi": 360.0, "theta": 180.0}  # deg, from 0
CHANNELS = {"bw": "", "red": "R", "gre": "G", "green": "G", "blu": "B", "blue": "B"}
_FIRST = ("source", "typesym", "typecolormodel", "typedata", "sigma", "psi")
_TABLE = (*CHANNELS, "wl")
_COLOURS = {"bw": 1, "rgb": 3}
_SOURCES = ("Measured", "Generated", "Edited", "Morphed")
_USUAL = "Source Measured"  # the default of the writer, which is not kept as provenance


@dataclass
class IntegraHeader:
    """The entries before the first table.

    `axes` [deg] by keyword; `tables` is the number of tables that the colour model needs; `is_marked`: a comment states
    transmission; `notes` are the remarks and unknown entries, kept as provenance.
    """

    axes: dict[str, Values] = field(default_factory=dict)
    symmetry: str = ""
    colours: str = ""
    tables: int = 0
    is_intensity: bool = False
    is_relative: bool = False
    is_marked: bool = False
    notes: list[str] = field(default_factory=list)

    @property
    def provenance(self) -> str:
        """The notes, one a line."""
        return "\n".join(self.notes)


@dataclass(frozen=True)
class ChannelTable:
    """The table of one channel: its stored values, its factors kbdf where it has some, and the line where it begins."""

    name: str
    wavelength: float | None
    factors: Values | None
    values: Values
    line: int


class FirstWords(NamedTuple):
    """The first words of lines, in lower case, and whether a comment states transmission."""

    words: frozenset[str]
    is_marked: bool


@functools.lru_cache(maxsize=1)  # four formats ask this of every file
def keywords(head: bytes) -> FirstWords:
    """The first words of the lines in the first bytes of a file; no words where the file is not one of Integra's."""
    if b"type" not in head.lower():
        return FirstWords(frozenset(), False)
    text = re.sub(r"\r\n?", "\n", head.removeprefix(b"\xef\xbb\xbf").decode("utf-8", "replace"))
    rows = [row.split(None, 1)[0].lower() for row in text.split("\n") if row.partition(COMMENT)[0].strip()]
    known = bool(rows) and rows[0] in _FIRST
    return FirstWords(frozenset(rows) if known else frozenset(), f"{COMMENT} {TRANSMITTED}" in text)


def open_words(path: Path) -> Words:
    """A cursor over the words of a file."""
    return Words(path, lines(path, longest=LONGEST_LINE), comment=COMMENT)


def read_header(words: Words) -> IntegraHeader:
    """Read the entries before the first table. Raises FormatError for what this grammar does not allow."""
    header = IntegraHeader()
    notes = []
    while (key := words.peek().lower()) not in _TABLE:
        word = words.word("a keyword of the header or a table")
        if key in RANGES:
            if key in header.axes:
                raise words.wrong(f"{key} occurs twice")
            header.axes[key] = _axis(words, key, header)
        elif key == "source":
            notes.append(f"Source {words.keyword(*_SOURCES)}")
        elif key == "typesym":
            header.symmetry = words.keyword(*SYMMETRIES)
            if header.symmetry == "ASymmetrical" and words.peek().lower() == "4d":
                header.symmetry = f"ASymmetrical {words.word('4D').upper()}"
        elif key == "typecolormodel":
            header.colours = words.keyword("BW", "RGB", "spectral").lower()
            header.tables = _COLOURS.get(header.colours) or words.count("the number of wavelengths", most=100_000)
        elif key == "typedata":
            header.is_intensity = words.keyword("Luminance", "Intensity") == "Intensity"
            header.is_relative = words.keyword("Absolute", "Relative") == "Relative"
        else:
            if not re.fullmatch(r"[A-Za-z_][\w.-]*", word):
                raise words.wrong(f"{clip(word)!r} where a keyword of the header was expected")
            notes.append(" ".join([word, *words.rest()]))
    if "sigma" not in header.axes:
        raise words.wrong("no sigma, the incidence angles, before the first table")
    if not header.tables:
        raise words.wrong("no TypeColorModel before the first table: BW, RGB or spectral")
    header.is_marked = TRANSMITTED in words.remarks
    header.notes = [n for n in [*words.remarks, *notes] if n not in ("", TRANSMITTED, _USUAL)]
    return header


def _axis(words: Words, key: str, header: IntegraHeader) -> Values:
    """The angles [deg] of one axis, ascending (except sigmat) and within its range."""
    if key == "sigmat":
        if "sigma" not in header.axes:
            raise words.wrong("sigmat before sigma: it has one angle for each angle of sigma")
        count = len(header.axes["sigma"])
    else:
        count = words.count(f"the number of angles of {key}", most=100_000)
    angles = words.table(count, key)
    if np.any(angles < 0) or np.any(angles > RANGES[key]):
        wrong = angles[(angles < 0) | (angles > RANGES[key])][0]
        raise words.wrong(f"{key} has the angle {wrong:g} deg, outside 0 to {RANGES[key]:g}")
    if key != "sigmat" and np.any(np.diff(angles) <= 0):
        raise words.wrong(f"the angles of {key} do not ascend")
    return angles


def read_tables(words: Words, header: IntegraHeader, size: int, factors: int) -> list[ChannelTable]:
    """One table of `size` values for each channel, in the order R, G, B; up to the end of the file.

    A table may have the number of `factors` kbdf before its values. Raises FormatError with the line.
    """
    if header.tables * size > MOST_VALUES:
        raise words.wrong(f"the header promises {header.tables * size} values, more than {MOST_VALUES}")
    tables = [_table(words, header, size, factors) for _ in range(header.tables)]
    if rest := words.peek():
        raise words.wrong(f"{clip(rest)!r} after the last table")
    wavelengths = [t.wavelength for t in tables if t.wavelength is not None]
    if len(set(wavelengths)) < len(wavelengths):
        raise words.wrong("two tables have the same wavelength")
    if len({t.factors is None for t in tables}) > 1:
        raise words.wrong("kbdf in some of the tables and not in others")
    names = [t.name for t in tables if t.wavelength is None]
    if len(set(names)) < len(names):
        raise words.wrong("two tables have the same colour")
    if not any(t.values.any() for t in tables):
        raise FormatError(words.path, "every value is zero: the detector saw nothing", f"line {tables[0].line}")
    return sorted(tables, key=lambda t: "RGB".find(t.name))


def _table(words: Words, header: IntegraHeader, size: int, most_factors: int) -> ChannelTable:
    name = words.keyword(*_TABLE)
    if name != _expected(header, name):
        raise words.wrong(f"a table {name!r} in a file whose TypeColorModel is {header.colours}")
    wavelength = words.number("the wavelength [nm]") if name == "wl" else None
    if wavelength is not None and not 0 < wavelength < 1e9:
        raise words.wrong(f"the wavelength is {wavelength:g} nm")
    factors = None
    if most_factors and words.peek().lower() == "kbdf":
        words.word("kbdf")
        factors = words.table(most_factors, "kbdf")
        if np.any(factors < 0):
            raise words.wrong(f"kbdf has the negative factor {factors.min():g}")
    words.keyword("def")
    words.peek()
    line = words.line
    values = words.table(size, f"the table {name}")
    if words.peek().lower() == "enddef":
        words.word("enddef")
    return ChannelTable(CHANNELS.get(name, ""), wavelength, factors, values, line)


def _expected(header: IntegraHeader, name: str) -> str:
    """The name itself where the colour model has a table of this name, else an empty text."""
    allowed = {"bw": ("bw",), "spectral": ("wl",)}.get(header.colours, ("red", "gre", "green", "blu", "blue"))
    return name if name in allowed else ""


def sets_of(tables: list[ChannelTable]) -> dict[str, npt.NDArray]:
    """The coordinate that distinguishes the tables: wavelength [nm], channel, or none."""
    if tables[0].wavelength is not None:
        return {"wavelength": np.array([t.wavelength for t in tables], dtype=float)}
    return {"channel": np.array([t.name for t in tables])} if tables[0].name else {}


def transmission(path: Path, header: IntegraHeader) -> str:
    """The evidence for transmission, for the history: a comment or the suffix of the name; empty for reflection."""
    if header.is_marked:
        return "by a comment in the file"
    return f"by the name's suffix {path.suffix}" if path.suffix.lower() in OF_TRANSMISSION else ""


def refuse_other_suffix(path: Path, is_transmitted: bool) -> None:
    """ValueError for a name that says reflection of transmission, or the reverse: programs tell them by the suffix."""
    suffix, others = path.suffix.lower(), OF_REFLECTION if is_transmitted else OF_TRANSMISSION
    if suffix in others:
        is_of, said = ("transmission", "reflection") if is_transmitted else ("reflection", "transmission")
        usual = {".ddr": ".ddt", ".ddt": ".ddr", ".sdr": ".sdt", ".sdt": ".sdr"}[suffix]
        raise ValueError(f"a file called {suffix} reads as {said}, and what is written is of {is_of}: call it {usual}")


def head_lines(provenance: str, is_transmitted: bool) -> list[str]:
    """The first lines of a file to write: comments and Source."""
    notes = remark_lines(provenance)
    sources = [n for n in notes if n in {f"Source {s}" for s in _SOURCES}]
    comments = [f"{COMMENT} {n}" for n in notes if n not in sources]
    return [*comments, *([f"{COMMENT} {TRANSMITTED}"] if is_transmitted else []), sources[-1] if sources else _USUAL]


def tables_of(scan: xr.Dataset, order: tuple[str, ...]) -> tuple[list[Any], list[Values]]:
    """The name of each set of a scan (channel or wavelength), and its values with the axes in `order`; gaps are 0.

    Raises ValueError for gaps above the horizon, and for sets along other coordinates.
    """
    brdf = scan["brdf"]
    along = [str(d) for d in brdf.dims if d not in order]
    if len(along) > 1 or not set(along) <= {"wavelength", "channel"}:
        raise ValueError(f"an Integra file has sets along wavelength or channel, not {' and '.join(along)}")
    values = brdf.transpose(*along, *order).values.astype(float).reshape(-1, *(scan.sizes[n] for n in order))
    above = scan["theta_r"].broadcast_like(scan[list(order)]).transpose(*order).values <= HORIZON
    if np.any(np.isnan(values) & above):
        raise ValueError("the scan has gaps, and an Integra file can hold none: gonio.convert fills them")
    single = next((n for n in ("wavelength", "channel") if n in scan.coords and not along), "")
    name = along[0] if along else single
    names = np.atleast_1d(scan[name].values).tolist() if name else [""]
    return names, list(np.nan_to_num(values))


def colour_words(names: list[Any]) -> tuple[str, list[str]]:
    """TypeColorModel for these sets and the keyword of each table. Raises ValueError for channels without a keyword."""
    if isinstance(names[0], float | int):
        return f"spectral {len(names)}", [f"wl {float(w)!r}" for w in names]
    if names == [""]:
        return "BW", ["bw"]
    if names == ["R", "G", "B"]:
        return "RGB", ["red", "green", "blue"]
    raise ValueError(
        f"an Integra file has the channels R, G, B, or wavelengths, or one channel without a name, not "
        f"{', '.join(map(str, names))}: select one, or write another format"
    )


def row_of(values: Values) -> str:
    """Numbers as text, each with every digit that it needs to be read back unchanged."""
    return " ".join(map(repr, values.tolist()))
