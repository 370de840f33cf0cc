"""What Speos's two text formats share: rows in a fixed order, tables of theta against azimuth, and their scale.

A table is proportional to the BSDF (kind 1) or to the intensity, BSDF times cos(theta) (kind 0), and a percentage
beside it says how much light it holds: Speos scales the table so that its integral is that percentage, and so does
gonio (ansys_bsdf). Azimuths are about the normal from the forward direction, in which light goes on unscattered or
mirrored: phi = azimuth + 180. Theta runs from 0 to 90 in reflection and from 90 to 180 in transmission, where gonio
counts from the normal of the far side.
"""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from gonio.door.text import clip, lines
from gonio.files import FormatError
from gonio.formats import hemispheres
from gonio.formats.hemispheres import SAME, Values, in_words

LONGEST = 1 << 20  # bytes of a line: a row of 0.01 deg steps in full precision
MOST_VALUES = 8_000_000  # a table times its wavelengths
MOST_BLANK = 10_000  # lines without words one after another
MODES = ("reflection", "transmission")
FORWARD = 180.0  # deg, phi of the forward direction
GRAZING = 1e-6  # cosine below which an intensity says nothing of the BSDF
BSDF, INTENSITY = 1, 0
FLAT = (350.0, 850.0)  # nm, between which what has no wavelength is written
COMMENT, VECTOR = "comment: ", "anisotropy vector: "  # how header lines are named in the provenance
DEFAULT_VECTOR = "1 0 0"


class Rows:
    """The lines of a file in a fixed order; every method raises FormatError with the line and what should be there."""

    def __init__(self, path: Path) -> None:
        self.path, self.line = path, 0
        self._source = lines(path, longest=LONGEST)
        self._ahead: list[tuple[int, str]] = []
        with path.open("rb") as file:
            self.break_length = 2 if b"\r\n" in file.read(4096) else 1

    def wrong(self, what: str) -> FormatError:
        return FormatError(self.path, what, f"line {max(self.line, 1)}")

    def _next(self) -> tuple[int, str] | None:
        return self._ahead.pop() if self._ahead else next(self._source, None)

    def peek(self) -> str:
        """The next line, which stays; empty at the end."""
        if not self._ahead and (entry := next(self._source, None)):
            self._ahead.append(entry)
        return self._ahead[-1][1] if self._ahead else ""

    def more(self) -> bool:
        """Whether there is a line with words ahead, behind blank ones that are skipped."""
        for _ in range(MOST_BLANK):
            if (entry := self._next()) is None:
                return False
            if entry[1].strip():
                self._ahead.append(entry)
                return True
            self.line = entry[0]
        raise self.wrong(f"{MOST_BLANK} blank lines: this is no such file")

    def text(self, expected: str) -> str:
        """The next line, whatever it holds."""
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
        """So many numbers, over as many lines as they take."""
        found: list[float] = []
        while len(found) < count:
            words = self.words(expected)
            found += hemispheres.row(self.path, self.line, words, expected)
        if len(found) > count:
            raise self.wrong(f"{len(found)} numbers of {expected} where there should be {count}")
        return found

    def counts(self, *expected: str, least: int = 1) -> list[int]:
        """Whole numbers, one for each word in `expected`, on one line."""
        found = self.words(" and ".join(expected))
        if len(found) != len(expected):
            raise self.wrong(f"{clip(' '.join(found))!r} where {' and '.join(expected)} was expected")
        for text, name in zip(found, expected, strict=True):
            if not (text.isascii() and text.isdecimal() and len(text) < 10 and int(text) >= least):
                raise self.wrong(f"{name} is {clip(text)!r}, not a whole number from {least} on")
        return [int(text) for text in found]

    def flags(self, *expected: str) -> list[bool]:
        found = self.counts(*expected, least=0)
        if max(found) > 1:
            raise self.wrong(f"{' and '.join(expected)}: {found}, where 0 or 1 was expected")
        return [flag == 1 for flag in found]

    def end(self) -> None:
        """Nothing but the words `End of file` may follow."""
        while self.more():
            text = self.text("the end").strip()
            if text.lower() != "end of file":
                raise self.wrong(f"{clip(text)!r} after the last table: the header promises no more")


def opened(path: Path, name: str, versions: Sequence[str], after: Callable[[str], bool]) -> tuple[Rows, list[str]]:
    """The file behind its header lines, and these as provenance.

    `after` recognises the row that follows the description, whose length the file counts in characters.
    """
    rows = Rows(path)
    found = re.fullmatch(rf"optis - {name} surface file v(\S+)", rows.text("the header").strip(), re.IGNORECASE)
    if not found:
        raise rows.wrong(f"is no header of the form 'OPTIS - {name} surface file v{versions[-1]}'")
    if found[1] not in versions:
        known = " and ".join(versions)
        raise rows.wrong(
            f"is version {clip(found[1])!r}: gonio reads {known}; save the file with a current BSDF viewer"
        )
    if rows.flags("the mode, 0 for text")[0]:
        raise rows.wrong("is in binary mode: save it as text with the BSDF viewer")
    comment = rows.text("the comment").strip()
    (length,) = rows.counts("the number of characters of the description", least=0)
    told = [rows.text("the description")]
    letters = len(told[0])
    while letters + len(told) - 1 < length:
        if letters + rows.break_length * (len(told) - 1) >= length and after(rows.peek()):
            break
        told.append(rows.text("the description"))
        letters += len(told[-1])
    return rows, [*([COMMENT + comment] if comment else []), *(t.strip() for t in told if t.strip())]


@dataclass(frozen=True)
class Table:
    """One table as the file holds it: theta_r [deg, from the normal of its side], azimuths [deg], values by both."""

    theta_r: Values
    azimuths: Values
    values: Values
    kind: int
    integral: float  # of the BSDF's cosine over the hemisphere; NaN where the azimuths do not go round


def table(rows: Rows, mode: str, kind: int) -> Table:
    """The table of `mode` that comes next: two counts, the azimuths, and rows of a theta and its values."""
    count, wide = rows.counts("the number of thetas", "the number of azimuths")
    azimuths = rows.numbers("the azimuths", wide)
    phi = hemispheres.axis(rows.path, rows.line, azimuths, "an azimuth", -360.0, 360.0)
    if abs(phi[-1] - phi[0]) > 360 + SAME:
        raise rows.wrong("the azimuths go round more than once")
    found = []
    for _ in range(count):
        found.append(rows.numbers("a theta and its values", wide + 1))
    values = np.array(found)
    low, high = (0.0, 90.0) if mode == MODES[0] else (90.0, 180.0)
    theta = hemispheres.axis(rows.path, rows.line, values[:, 0].tolist(), "theta", low, high)
    if mode == MODES[1]:
        theta = 180.0 - theta
    theta = hemispheres.tidy(theta)
    up, round_ = np.argsort(theta), np.argsort(phi)
    theta, phi, values = theta[up], phi[round_], values[:, 1:][np.ix_(up, round_)]
    goes_round = hemispheres.is_round(phi)
    phi, values = hemispheres.without_closing(phi, values)
    whole = hemispheres.integral(theta, phi, values, cosine=kind == BSDF) if goes_round and len(theta) > 1 else np.nan
    return Table(theta, phi, values, kind, whole)


def bsdf(found: Table, scale: float) -> tuple[Values, Values, Values]:
    """theta_r, phi [deg] and the BSDF of a table: its values times the scale, an intensity over the cosine."""
    theta, values = found.theta_r, found.values
    if found.kind == INTENSITY:
        cosine = np.cos(np.radians(theta))
        kept = cosine > GRAZING
        theta, values = theta[kept], values[kept] / cosine[kept, None]
    return theta, hemispheres.turned(found.azimuths + FORWARD), scaled(values, scale)


def scaled(values: Values, scale: float) -> Values:
    """Values times a number; those beyond all numbers are infinite, without a warning."""
    with np.errstate(over="ignore", invalid="ignore"):
        return values if scale == 1.0 else values * scale


def divided(tables: Sequence[Table]) -> list[str]:
    """What is to be said of tables of intensities."""
    if tables[0].kind == BSDF:
        return []
    grazing = any((np.cos(np.radians(t.theta_r)) <= GRAZING).any() for t in tables)
    left_out = "; at 90 deg, where that is zero, nothing is known" if grazing else ""
    return [f"intensities divided by cos(theta_r){left_out}"]


def reciprocal(whole: float) -> float:
    """One over an integral; NaN where there is no light to scale by."""
    found = 1 / whole if whole > 0 else math.nan
    return found if math.isfinite(found) else math.nan


def close_to_one(scale: float) -> float:
    """The scale, or 1 where rounding alone keeps it from 1: the table is in 1/sr already."""
    return 1.0 if abs(scale - 1) < SAME else scale


def provenance_rows(scan: xr.Dataset) -> tuple[str, str, str]:
    """Comment, description and anisotropy vector as a scan's provenance tells them."""
    told = scan.attrs.get("provenance", "").splitlines()
    comment = next((t for t in told if t.startswith(COMMENT)), "")
    vector = next((t for t in told if t.startswith(VECTOR)), "")
    description = "\n".join(t for t in told if t.strip() and t not in (comment, vector))
    return comment.removeprefix(COMMENT), description, vector.removeprefix(VECTOR) or DEFAULT_VECTOR


@dataclass(frozen=True)
class Directions:
    """The thetas of both modes and the azimuths as a file lists them, and the order in which it takes the columns."""

    theta: dict[str, list[float]]
    azimuths: list[float]
    columns: list[int]

    @classmethod
    def of(cls, theta_r: Values, phi: Values, title: str) -> "Directions":
        """Those of a grid; ValueError where its azimuths do not go all round."""
        forward = hemispheres.turned(phi - FORWARD).tolist()
        columns = np.argsort(forward).tolist()
        azimuths = [forward[c] for c in columns]
        if azimuths[0] == 0:
            azimuths, columns = [*azimuths, 360.0], [*columns, columns[0]]
        if not hemispheres.is_round(np.array(azimuths)):
            raise ValueError(f"{title} holds azimuths all round: resample the scan onto such a grid")
        near, far = hemispheres.tidy(theta_r).tolist(), hemispheres.tidy(180.0 - theta_r).tolist()
        return cls(dict(zip(MODES, (near, far), strict=True)), azimuths, columns)

    def lines(self, mode: str, values: Values) -> list[str]:
        """One table, values (theta_r, phi), as lines."""
        order = range(len(values)) if mode == MODES[0] else range(len(values) - 1, -1, -1)
        full = values[:, self.columns]
        rows = [in_words([self.theta[mode][k], *full[k].tolist()]).replace(" ", "\t") for k in order]
        head = [f"{len(rows)}\t{len(self.azimuths)}", "\t" + in_words(self.azimuths).replace(" ", "\t")]
        return [*head, *rows]


def grid_of(scan: xr.Dataset, sets: Sequence[str], title: str) -> tuple[xr.DataArray, Directions]:
    """The BRDF on (*sets, theta_i, phi_i, theta_r, phi), `mode` among the sets, and its directions.

    Raises ValueError for what Speos does not take, negative values among it.
    """
    brdf = hemispheres.on_grid(scan, sets, title)
    if brdf.values.min() < 0:
        raise ValueError(f"{title} holds no negative values: mask them, or set them to zero")
    modes = [str(mode) for mode in brdf["mode"].values.tolist()]
    brdf = brdf.assign_coords(mode=[MODES[0] if mode == "nan" else mode for mode in modes])
    ordered = brdf.sortby(["mode", "theta_i", "theta_r"])
    return ordered, Directions.of(ordered["theta_r"].values, ordered["phi"].values, title)
