"""The parts that Speos's two text formats share: lines in a fixed order, tables of theta by azimuth, and their scale.

A table is proportional to the BSDF (kind 1) or to the intensity, which is the BSDF times cos(theta) (kind 0). A
percentage states the share of the light that it scatters: Speos scales the table so that its integral is that
percentage, and so does gonio (ansys_bsdf). Azimuths are about the normal, from the forward direction of mirrored or
transmitted light: phi = azimuth + 180. Theta runs from 0 to 90 in reflection and from 90 to 180 in transmission, where
gonio's theta_r is from the normal of the far side.
"""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from gonio.door.text import clip, head, lines
from gonio.files import FormatError
from gonio.formats import hemispheres
from gonio.formats.hemispheres import SAME, Values, in_words

LONGEST = 1 << 20  # bytes of a line; a row at steps of 0.01 deg in full precision fits
MOST_VALUES = 8_000_000  # of a table, times its wavelengths
MOST_BLANK = 10_000  # consecutive lines without words
MODES = ("reflection", "transmission")
FORWARD = 180.0  # deg, phi of the forward direction
GRAZING = 1e-6  # cosine below which an intensity gives no BSDF
BSDF, INTENSITY = 1, 0
FLAT = (350.0, 850.0)  # nm; the two wavelengths at which a scan without wavelength is written
COMMENT, VECTOR = "comment: ", "anisotropy vector: "  # labels of header lines in the provenance
DEFAULT_VECTOR = "1 0 0"


class SpeosLines:
    """A cursor over lines in a fixed order. Its methods raise FormatError with the line and what was expected there."""

    def __init__(self, path: Path) -> None:
        self.path, self.line = path, 0
        self._source = lines(path, longest=LONGEST)
        self._ahead: list[tuple[int, str]] = []
        self.break_length = 2 if b"\r\n" in head(path, 4096) else 1

    def wrong(self, what: str) -> FormatError:
        """The error to raise for what is wrong at the last line read."""
        return FormatError(self.path, what, f"line {max(self.line, 1)}")

    def _next(self) -> tuple[int, str] | None:
        return self._ahead.pop() if self._ahead else next(self._source, None)

    def peek(self) -> str:
        """The next line, without moving past it; empty at the end."""
        if not self._ahead and (entry := next(self._source, None)):
            self._ahead.append(entry)
        return self._ahead[-1][1] if self._ahead else ""

    def more(self) -> bool:
        """Whether there is another line with words; blank lines before it are skipped."""
        for _ in range(MOST_BLANK):
            if (entry := self._next()) is None:
                return False
            if entry[1].strip():
                self._ahead.append(entry)
                return True
            self.line = entry[0]
        raise self.wrong(f"{MOST_BLANK} blank lines: this is not a file of Speos or Reflet")

    def text(self, expected: str) -> str:
        """The next line, which may be blank."""
        entry = self._next()
        if entry is None:
            raise self.wrong(f"the file ends where {expected} was expected")
        self.line, text = entry
        return text

    def words(self, expected: str) -> list[str]:
        """The words of the next line that has any."""
        if not self.more():
            raise self.wrong(f"the file ends where {expected} was expected")
        return self.text(expected).split()

    def numbers(self, expected: str, count: int) -> list[float]:
        """`count` numbers over as many lines as they take. Raises FormatError where the last line has more."""
        numbers: list[float] = []
        while len(numbers) < count:
            words = self.words(expected)
            numbers += hemispheres.row(self.path, self.line, words, expected)
        if len(numbers) > count:
            raise self.wrong(f"{len(numbers)} numbers of {expected} where there should be {count}")
        return numbers

    def counts(self, *expected: str, least: int = 1) -> list[int]:
        """Whole numbers from `least` on, one for each name in `expected`, on one line."""
        words = self.words(" and ".join(expected))
        if len(words) != len(expected):
            raise self.wrong(f"{clip(' '.join(words))!r} where {' and '.join(expected)} was expected")
        for text, name in zip(words, expected, strict=True):
            if not (text.isascii() and text.isdecimal() and len(text) < 10 and int(text) >= least):
                raise self.wrong(f"{name} is {clip(text)!r}, not a whole number from {least} on")
        return [int(text) for text in words]

    def flags(self, *expected: str) -> list[bool]:
        """Flags 0 or 1, one for each name in `expected`, on one line."""
        numbers = self.counts(*expected, least=0)
        if max(numbers) > 1:
            raise self.wrong(f"{' and '.join(expected)}: {numbers}, where 0 or 1 was expected")
        return [flag == 1 for flag in numbers]

    def end(self) -> None:
        """Check that nothing but the words `End of file` follows."""
        while self.more():
            text = self.text("the end").strip()
            if text.lower() != "end of file":
                raise self.wrong(f"{clip(text)!r} after the last table: the header promises no more")


def opened(
    path: Path, name: str, versions: Sequence[str], after: Callable[[str], bool]
) -> tuple[SpeosLines, list[str]]:
    """A cursor after the description of a file, and comment and description as lines of provenance.

    The file states the length of the description in characters; a line end in it counts as one or two. `after`
    recognises the line that follows the description. Raises FormatError for other versions and for binary mode.
    """
    rows = SpeosLines(path)
    header = re.fullmatch(rf"optis - {name} surface file v(\S+)", rows.text("the header").strip(), re.IGNORECASE)
    if not header:
        raise rows.wrong(f"is no header of the form 'OPTIS - {name} surface file v{versions[-1]}'")
    if header[1] not in versions:
        known = " and ".join(versions)
        raise rows.wrong(f"is version {clip(header[1])!r}: gonio reads {known}: save it as one of these")
    if rows.flags("the mode, 0 for text")[0]:
        raise rows.wrong("is in binary mode: save it as text with the BSDF viewer")
    comment = rows.text("the comment").strip()
    (length,) = rows.counts("the number of characters of the description", least=0)
    description = [rows.text("the description")]
    letters = len(description[0])
    while letters + len(description) - 1 < length:
        if letters + rows.break_length * (len(description) - 1) >= length and after(rows.peek()):
            break
        description.append(rows.text("the description"))
        letters += len(description[-1])
    return rows, [*([COMMENT + comment] if comment else []), *(t.strip() for t in description if t.strip())]


@dataclass(frozen=True)
class SpeosTable:
    """One table as stored: theta_r [deg] from the normal of its side, azimuths [deg] and values (theta_r, azimuth)."""

    theta_r: Values
    azimuths: Values
    values: Values
    kind: int
    integral: float  # of BSDF times cosine over the hemisphere; NaN where azimuths do not cover the circle


def table(rows: SpeosLines, mode: str, kind: int) -> SpeosTable:
    """Read the next table, which is of `mode`: two counts, the azimuths, and rows of a theta and its values."""
    count, wide = rows.counts("the number of thetas", "the number of azimuths")
    azimuths = rows.numbers("the azimuths", wide)
    phi = hemispheres.axis(rows.path, rows.line, azimuths, "an azimuth", -360.0, 360.0)
    if abs(phi[-1] - phi[0]) > 360 + SAME:
        raise rows.wrong("the azimuths span more than 360 deg")
    numbers = []
    for _ in range(count):
        numbers.append(rows.numbers("a theta and its values", wide + 1))
    values = np.array(numbers)
    low, high = (0.0, 90.0) if mode == MODES[0] else (90.0, 180.0)
    theta = hemispheres.axis(rows.path, rows.line, values[:, 0].tolist(), "theta", low, high)
    if mode == MODES[1]:
        theta = 180.0 - theta
    theta = hemispheres.tidy(theta)
    up, round_ = np.argsort(theta), np.argsort(phi)
    theta, phi, values = theta[up], phi[round_], values[:, 1:][np.ix_(up, round_)]
    goes_round = hemispheres.is_round(phi)
    phi, values = hemispheres.without_closing(phi, values)
    integral = (
        hemispheres.integral(theta, phi, values, cosine=kind == BSDF) if goes_round and len(theta) > 1 else np.nan
    )
    return SpeosTable(theta, phi, values, kind, integral)


def bsdf(stored: SpeosTable, scale: float) -> tuple[Values, Values, Values]:
    """theta_r, phi [deg] and the BSDF of a table: its values times `scale`; intensities are divided by the cosine."""
    theta, values = stored.theta_r, stored.values
    if stored.kind == INTENSITY:
        cosine = np.cos(np.radians(theta))
        above = cosine > GRAZING
        theta, values = theta[above], values[above] / cosine[above, None]
    return theta, hemispheres.turned(stored.azimuths + FORWARD), scaled(values, scale)


def scaled(values: Values, scale: float) -> Values:
    """Values times a number; an overflow gives infinity without a warning."""
    with np.errstate(over="ignore", invalid="ignore"):
        return values if scale == 1.0 else values * scale


def divided(tables: Sequence[SpeosTable]) -> list[str]:
    """Lines for the history where the tables are intensities."""
    if tables[0].kind == BSDF:
        return []
    grazing = any((np.cos(np.radians(t.theta_r)) <= GRAZING).any() for t in tables)
    left_out = "; at 90 deg, where that is zero, there is no value" if grazing else ""
    return [f"intensities divided by cos(theta_r){left_out}"]


def reciprocal(integral: float) -> float:
    """One over an integral; NaN where that is not a positive finite number."""
    inverse = 1 / integral if integral > 0 else math.nan
    return inverse if math.isfinite(inverse) else math.nan


def close_to_one(scale: float) -> float:
    """The scale; 1 where it differs from 1 by rounding only, because the table is in 1/sr already."""
    return 1.0 if abs(scale - 1) < SAME else scale


def provenance_rows(scan: xr.Dataset) -> tuple[str, str, str]:
    """Comment, description and anisotropy vector from the provenance of a scan."""
    provenance = scan.attrs.get("provenance", "").splitlines()
    comment = next((t for t in provenance if t.startswith(COMMENT)), "")
    vector = next((t for t in provenance if t.startswith(VECTOR)), "")
    description = "\n".join(t for t in provenance if t.strip() and t not in (comment, vector))
    return comment.removeprefix(COMMENT), description, vector.removeprefix(VECTOR) or DEFAULT_VECTOR


@dataclass(frozen=True)
class TableAngles:
    """The angles of tables as a file lists them: theta by mode, azimuths, and the scan's column for each azimuth."""

    theta: dict[str, list[float]]
    azimuths: list[float]
    columns: list[int]

    @classmethod
    def of(cls, theta_r: Values, phi: Values, title: str) -> "TableAngles":
        """The angles for a grid. Raises ValueError where its azimuths do not cover the circle."""
        forward = hemispheres.turned(phi - FORWARD).tolist()
        columns = np.argsort(forward).tolist()
        azimuths = [forward[c] for c in columns]
        if azimuths[0] == 0:
            azimuths, columns = [*azimuths, 360.0], [*columns, columns[0]]
        if not hemispheres.is_round(np.array(azimuths)):
            raise ValueError(f"{title} holds azimuths over the full circle: resample the scan onto such a grid")
        near, far = hemispheres.tidy(theta_r).tolist(), hemispheres.tidy(180.0 - theta_r).tolist()
        return cls(dict(zip(MODES, (near, far), strict=True)), azimuths, columns)

    def lines(self, mode: str, values: Values) -> list[str]:
        """The lines of one table with the values (theta_r, phi)."""
        order = range(len(values)) if mode == MODES[0] else range(len(values) - 1, -1, -1)
        full = values[:, self.columns]
        rows = [in_words([self.theta[mode][k], *full[k].tolist()]).replace(" ", "\t") for k in order]
        head = [f"{len(rows)}\t{len(self.azimuths)}", "\t" + in_words(self.azimuths).replace(" ", "\t")]
        return [*head, *rows]


def grid_of(scan: xr.Dataset, sets: Sequence[str], title: str) -> tuple[xr.DataArray, TableAngles]:
    """The BRDF on (*sets, theta_i, phi_i, theta_r, phi), where `mode` is among the sets, and the angles of its tables.

    Raises ValueError for a scan that Speos does not accept, such as one with negative values.
    """
    brdf = hemispheres.on_grid(scan, sets, title)
    if brdf.values.min() < 0:
        raise ValueError(f"{title} holds no negative values: mask them, or set them to zero")
    modes = [str(mode) for mode in brdf["mode"].values.tolist()]
    brdf = brdf.assign_coords(mode=[MODES[0] if mode == "nan" else mode for mode in modes])
    ordered = brdf.sortby(["mode", "theta_i", "theta_r"])
    return ordered, TableAngles.of(ordered["theta_r"].values, ordered["phi"].values, title)
