"""Exports of the goniometer Reflet: one or more blocks of one incidence each, tables of signed theta by azimuth.

The files are only read. Two forms are known, both with rows `theta value ..` of a signed theta. The text form names its
header lines,

    Name / Comment : .. / Data file type : Intensity BRDF / Phi measure beginning : -90 / .. / Theta Lighting 60

The other form (.rtd) begins with `OPTIS - Anisotropic BSDF surface file v1.0` and states the incidence as `SampleID:
Sample 60`; it repeats its table on another grid, and this second table is left out. An arm at theta and azimuth p looks
along phi = p + 270 deg where theta is positive and p + 90 where it is negative, because the instrument is calibrated on
the mirror direction at theta = theta_i and p = -90 deg. `Intensity BRDF` is proportional to the BRDF times
cos(theta_r): the other form declares its values so (kind 0), and Ansys's converter of such files treats them so
(ansys_bsdf). The factor is not stated, so the values are relative.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import xarray as xr

from gonio.door.text import clip, lines, number
from gonio.files import FormatError
from gonio.formats import hemispheres
from gonio.formats.format import Format, Holds
from gonio.formats.speos.tables import GRAZING, SpeosLines
from gonio.measured.dataset import RELATIVE, add_history, make_scan

TYPE = "Intensity BRDF"
TEXT_START, RTD_START = "name / comment", "optis - anisotropic bsdf surface file v1.0"
KEYS = {"phi measure beginning": "low", "phi measure end": "high", "phi measure step": "step"}
MOST_STEPS = 100_000
TURN_ABOVE, TURN_BELOW = 270.0, 90.0  # deg from the azimuth of the arm to phi, for theta >= 0 and theta < 0
_SAMPLE = re.compile(r"SampleID:\s*Sample\s+(\S+)", re.IGNORECASE)


@dataclass
class RefletBlock:
    """One block of an export: its first line, theta_i and azimuths [deg], and rows of a theta [deg] and values."""

    line: int
    theta_i: float = np.nan
    azimuths: Sequence[float] = ()
    header: list[str] = field(default_factory=list)
    rows: list[list[float]] = field(default_factory=list)


def _starts(text: str) -> str:
    return next((start for start in (TEXT_START, RTD_START) if text.strip().lower().startswith(start)), "")


def _recognises(head: bytes) -> bool:
    text = head.removeprefix(b"\xef\xbb\xbf").decode("utf-8", errors="replace").lstrip().lower()
    return text.startswith(RTD_START) or (text.startswith(TEXT_START) and "data file type" in text)


def _read_text(path: Path) -> list[RefletBlock]:
    """The blocks of a file of the text form."""
    blocks: list[RefletBlock] = []
    numbers: dict[str, float] = {}
    for line, text in lines(path):
        if _starts(text) == TEXT_START:
            _with_rows(path, blocks)
            blocks.append(RefletBlock(line))
            numbers = {}
        if not text.strip():
            continue
        if not blocks:
            raise FormatError(path, f"{clip(text)!r} before the first 'Name / Comment'", f"line {line}")
        block = blocks[-1]
        if block.azimuths:
            block.rows.append(hemispheres.row(path, line, text.split(), "a theta and its values"))
            if len(block.rows[-1]) != len(block.azimuths) + 1:
                message = f"{len(block.rows[-1]) - 1} values where the header has {len(block.azimuths)} azimuths"
                raise FormatError(path, message, f"line {line}")
        elif text.lower().startswith("theta lighting"):
            block.theta_i = number(path, line, text[len("theta lighting") :].strip(" \t:"), "Theta Lighting")
            block.azimuths = _azimuths(path, line, numbers)
        else:
            block.header.append(" ".join(text.split()))
            _take_geometry(path, line, text, numbers)
    return _with_rows(path, blocks)


def _with_rows(path: Path, blocks: list[RefletBlock]) -> list[RefletBlock]:
    """The blocks. Raises FormatError where the last one has no rows."""
    if blocks and not blocks[-1].rows:
        raise FormatError(path, "the block holds no rows of values", f"line {blocks[-1].line}")
    return blocks


def _take_geometry(path: Path, line: int, text: str, numbers: dict[str, float]) -> None:
    """Put the numbers of a header line that the azimuths need into `numbers`. Raises FormatError for unknown kinds."""
    name, _, value = text.partition(":")
    name, value = name.strip().lower(), value.strip()
    if name in KEYS:
        numbers[KEYS[name]] = number(path, line, value, name)
    elif name == "data file type" and value.lower() != TYPE.lower():
        raise FormatError(path, f"Data file type is {clip(value)!r}: gonio knows {TYPE}", f"line {line}")
    elif name in ("theta sample", "spectral mode") and number(path, line, value, name) != 0:
        raise FormatError(path, f"{name} is {clip(value)}: gonio knows 0, no tilt and no spectrum", f"line {line}")


def _azimuths(path: Path, line: int, numbers: dict[str, float]) -> list[float]:
    """The azimuths [deg] from beginning, end and step in the header."""
    if missing := [name for name, key in KEYS.items() if key not in numbers]:
        raise FormatError(path, f"Theta Lighting before {' and '.join(missing)}", f"line {line}")
    low, high, step = numbers["low"], numbers["high"], numbers["step"]
    hemispheres.axis(path, line, [low], "Phi measure beginning", -360.0, 360.0)
    hemispheres.axis(path, line, [high], "Phi measure end", low, 360.0)
    count = (high - low) / step if step > 0 else (0.0 if high == low else -1.0)
    if not (0 <= count < MOST_STEPS and abs(count - round(count)) < 1e-6):
        message = f"azimuths from {low:g} to {high:g} in steps of {step:g} are no whole number of steps"
        raise FormatError(path, message, f"line {line}")
    return [low + k * step for k in range(round(count) + 1)]


def _read_rtd(path: Path) -> list[RefletBlock]:
    """The blocks of a file with the OPTIS header, without their second tables."""
    rows = SpeosLines(path)
    blocks: list[RefletBlock] = []
    while rows.more():
        if _starts(rows.peek()) != RTD_START:
            rows.text("the header")
            raise rows.wrong(f"is no header of the form {RTD_START!r}")
        rows.text("the header")
        block = RefletBlock(rows.line)
        sample = _SAMPLE.fullmatch(rows.text("the SampleID").strip())
        if not sample:
            raise rows.wrong("is no line of the form 'SampleID: Sample 60', whose number is the incidence")
        block.theta_i = number(path, rows.line, sample[1], "the incidence in SampleID")
        block.header = [" ".join(sample[0].split())]
        _rtd_header(rows, block)
        block.azimuths = rows.numbers("the azimuths", len(rows.peek().split()) or 1)
        while rows.peek().strip():
            block.rows.append(rows.numbers("a theta and its values", len(block.azimuths) + 1))
        _second_table(rows)
        _with_rows(path, [block])
        blocks.append(block)
    return blocks


def _rtd_header(rows: SpeosLines, block: RefletBlock) -> None:
    """Read the rows between SampleID and the table. Raises FormatError for transmission and for values of a BSDF."""
    rows.numbers("the anisotropy vector", 3)
    if rows.flags("the flag of reflection", "the flag of transmission") != [True, False]:
        raise rows.wrong("holds transmission: gonio knows reflection only")
    if rows.flags("the kind of values") != [False]:
        raise rows.wrong("holds BSDF values: gonio knows intensities only")
    rows.counts("the number of orientations")
    (count,) = rows.counts("the number of incidences")
    listed = rows.numbers("the incidences", count)
    block.header.append(f"incidences: {hemispheres.in_words(listed)}")
    rows.numbers("the angles of the spectrum", 2)
    rows.text("the description of the spectrum")
    (count,) = rows.counts("the number of wavelengths")
    for _ in range(count):
        nm, percent = rows.numbers("a wavelength and its percentage", 2)
        block.header.append(f"spectrum: {nm:g} nm {percent:g} %")


def _second_table(rows: SpeosLines) -> None:
    """Skip the table in the coordinates of Speos, which has a row of azimuths and rows of theta >= 0."""
    rows.more()
    wide = 0
    while rows.peek().strip() and not _starts(rows.peek()):
        words = rows.words("the second table")
        numbers = hemispheres.row(rows.path, rows.line, words, "the second table")
        if wide and len(numbers) != wide + 1:
            raise rows.wrong(f"{len(numbers) - 1} values where the second table has {wide} azimuths")
        wide = wide or len(numbers)


def _read(path: Path) -> xr.Dataset:
    first = next(text for _, text in lines(path) if text.strip())
    form = _starts(first)
    blocks = _read_text(path) if form == TEXT_START else _read_rtd(path)
    for block in blocks:
        hemispheres.axis(path, block.line, [block.theta_i], "the incidence", 0.0, 90.0)
        thetas = [row[0] for row in block.rows]
        hemispheres.axis(path, block.line, thetas, "theta", -90.0, 90.0)
        hemispheres.axis(path, block.line, block.azimuths, "an azimuth", -360.0, 360.0)
    return _scan(blocks, form)


def _scan(blocks: Sequence[RefletBlock], form: str) -> xr.Dataset:
    """All blocks as one flat scan; a block with an incidence that occurred before begins another `scan`."""
    columns, names, scan_number = [], [], 1
    taken: set[float] = set()
    for block in blocks:
        if block.theta_i in taken:
            taken, scan_number = set(), scan_number + 1
        taken.add(block.theta_i)
        columns.append(_columns(block))
        names += [str(scan_number)] * columns[-1].shape[1]
    theta_i, theta, azimuth, values = np.concatenate(columns, axis=1)
    theta_r, phi = np.abs(theta), hemispheres.turned(azimuth + np.where(theta >= 0, TURN_ABOVE, TURN_BELOW))
    cosine = np.cos(np.radians(theta_r))
    above = cosine > GRAZING
    scan = make_scan(
        theta_i[above],
        theta_r[above],
        values[above] / cosine[above],
        phi[above],
        unit=RELATIVE,
        coordinates={} if scan_number == 1 else {"scan": np.array(names)[above]},
        provenance="\n".join(dict.fromkeys(line for block in blocks for line in block.header)),
    ).assign_attrs(stored=f"{TYPE}: BRDF x cos(theta_r), of unstated scale")
    scan = add_history(scan, "intensities divided by cos(theta_r); their scale is not stated: relative values")
    if not above.all():
        scan = add_history(scan, f"{(~above).sum()} values at theta_r = 90 deg, where the cosine is zero, left out")
    if form == RTD_START:
        scan = add_history(scan, "incidences from SampleID; the regridded second tables are left out")
    return scan if scan["brdf"].values.any() else add_history(scan, "every value is zero")


def _columns(block: RefletBlock) -> np.ndarray:
    """theta_i, signed theta, azimuth [deg] and values of one block, (4, n)."""
    rows = np.array(block.rows)
    theta = np.repeat(rows[:, 0], len(block.azimuths))
    azimuth = np.tile(block.azimuths, len(rows))
    return np.stack([np.full(theta.size, block.theta_i), theta, azimuth, rows[:, 1:].ravel()])


FORMAT = Format(
    name="reflet",
    title="Reflet export",
    suffix=".rtd",
    recognises=_recognises,
    read=_read,
    holds=Holds(relative=True, sets=("scan",)),
)
