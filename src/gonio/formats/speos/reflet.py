"""Exports of the goniometer Reflet: signed theta by azimuth, several blocks of one incidence in one file; only read.

Two forms are known, both with rows `theta value ..` of a signed theta. The text form names its header lines,

    Name / Comment : .. / Data file type : Intensity BRDF / Phi measure beginning : -90 / .. / Theta Lighting 60

the other (.rtd) is headed `OPTIS - Anisotropic BSDF surface file v1.0`, says the incidence as `SampleID: Sample 60`,
and repeats its table regridded, which is left out. An arm at theta and azimuth p looks along phi = p + 270 deg where
theta is positive and p + 90 where it is negative: the instrument is calibrated on the mirror direction at theta =
theta_i and p = -90 deg. `Intensity BRDF` is proportional to the BRDF times cos(theta_r), as the other form declares its
values (kind 0) and as Ansys's converter of such files takes them (ansys_bsdf); the factor is not stated: the values are
relative.
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
from gonio.formats.speos.tables import GRAZING, Rows
from gonio.measured.dataset import RELATIVE, add_history, make_scan

TYPE = "Intensity BRDF"
TEXT_START, RTD_START = "name / comment", "optis - anisotropic bsdf surface file v1.0"
KEYS = {"phi measure beginning": "low", "phi measure end": "high", "phi measure step": "step"}
MOST_STEPS = 100_000
TURN_ABOVE, TURN_BELOW = 270.0, 90.0  # deg from the arm's azimuth to phi, for theta of either sign
_SAMPLE = re.compile(r"SampleID:\s*Sample\s+(\S+)", re.IGNORECASE)


@dataclass
class Block:
    """One incidence as it is read: its first line, theta_i and azimuths [deg], rows of a theta [deg] and values."""

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


def _read_text(path: Path) -> list[Block]:
    """The blocks of the text form."""
    blocks: list[Block] = []
    numbers: dict[str, float] = {}
    for line, text in lines(path):
        if _starts(text) == TEXT_START:
            _with_rows(path, blocks)
            blocks.append(Block(line))
            numbers = {}
        if not text.strip():
            continue
        if not blocks:
            raise FormatError(path, f"{clip(text)!r} before the first 'Name / Comment'", f"line {line}")
        block = blocks[-1]
        if block.azimuths:
            block.rows.append(hemispheres.row(path, line, text.split(), "a theta and its values"))
            if len(block.rows[-1]) != len(block.azimuths) + 1:
                what = f"{len(block.rows[-1]) - 1} values where the header has {len(block.azimuths)} azimuths"
                raise FormatError(path, what, f"line {line}")
        elif text.lower().startswith("theta lighting"):
            block.theta_i = number(path, line, text[len("theta lighting") :].strip(" \t:"), "Theta Lighting")
            block.azimuths = _azimuths(path, line, numbers)
        else:
            block.header.append(" ".join(text.split()))
            _heed(path, line, text, numbers)
    return _with_rows(path, blocks)


def _with_rows(path: Path, blocks: list[Block]) -> list[Block]:
    """The blocks, the last of which holds rows."""
    if blocks and not blocks[-1].rows:
        raise FormatError(path, "the block holds no rows of values", f"line {blocks[-1].line}")
    return blocks


def _heed(path: Path, line: int, text: str, numbers: dict[str, float]) -> None:
    """Take what the geometry needs from a header line; refuse what gonio cannot tell the meaning of."""
    name, _, value = text.partition(":")
    name, value = name.strip().lower(), value.strip()
    if name in KEYS:
        numbers[KEYS[name]] = number(path, line, value, name)
    elif name == "data file type" and value.lower() != TYPE.lower():
        raise FormatError(path, f"Data file type is {clip(value)!r}: gonio knows {TYPE}", f"line {line}")
    elif name in ("theta sample", "spectral mode") and number(path, line, value, name) != 0:
        raise FormatError(path, f"{name} is {clip(value)}: gonio knows 0, no tilt and no spectrum", f"line {line}")


def _azimuths(path: Path, line: int, numbers: dict[str, float]) -> list[float]:
    """The azimuths [deg] that the header promises."""
    if missing := [name for name, key in KEYS.items() if key not in numbers]:
        raise FormatError(path, f"Theta Lighting before {' and '.join(missing)}", f"line {line}")
    low, high, step = numbers["low"], numbers["high"], numbers["step"]
    hemispheres.axis(path, line, [low], "Phi measure beginning", -360.0, 360.0)
    hemispheres.axis(path, line, [high], "Phi measure end", low, 360.0)
    count = (high - low) / step if step > 0 else (0.0 if high == low else -1.0)
    if not (0 <= count < MOST_STEPS and abs(count - round(count)) < 1e-6):
        what = f"azimuths from {low:g} to {high:g} in steps of {step:g} come to no whole number of steps"
        raise FormatError(path, what, f"line {line}")
    return [low + k * step for k in range(round(count) + 1)]


def _read_rtd(path: Path) -> list[Block]:
    """The blocks of the form with the OPTIS header, without their regridded second tables."""
    rows = Rows(path)
    blocks: list[Block] = []
    while rows.more():
        if _starts(rows.peek()) != RTD_START:
            rows.text("the header")
            raise rows.wrong(f"is no header of the form {RTD_START!r}")
        rows.text("the header")
        block = Block(rows.line)
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


def _rtd_header(rows: Rows, block: Block) -> None:
    """The rows between SampleID and the table, of which the table needs none but the kind of values."""
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


def _second_table(rows: Rows) -> None:
    """Read over the table in the coordinates of Speos, which has a row of azimuths and rows of theta >= 0."""
    rows.more()
    wide = 0
    while rows.peek().strip() and not _starts(rows.peek()):
        words = rows.words("the second table")
        found = hemispheres.row(rows.path, rows.line, words, "the second table")
        if wide and len(found) != wide + 1:
            raise rows.wrong(f"{len(found) - 1} values where the second table has {wide} azimuths")
        wide = wide or len(found)


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


def _scan(blocks: Sequence[Block], form: str) -> xr.Dataset:
    """All blocks as one flat scan; one whose incidence was there already begins another `scan`."""
    columns, names, scan = [], [], 1
    taken: set[float] = set()
    for block in blocks:
        if block.theta_i in taken:
            taken, scan = set(), scan + 1
        taken.add(block.theta_i)
        columns.append(_columns(block))
        names += [str(scan)] * columns[-1].shape[1]
    theta_i, theta, azimuth, values = np.concatenate(columns, axis=1)
    theta_r, phi = np.abs(theta), hemispheres.turned(azimuth + np.where(theta >= 0, TURN_ABOVE, TURN_BELOW))
    cosine = np.cos(np.radians(theta_r))
    kept = cosine > GRAZING
    found = make_scan(
        theta_i[kept],
        theta_r[kept],
        values[kept] / cosine[kept],
        phi[kept],
        unit=RELATIVE,
        coordinates={} if scan == 1 else {"scan": np.array(names)[kept]},
        provenance="\n".join(dict.fromkeys(line for block in blocks for line in block.header)),
    ).assign_attrs(stored=f"{TYPE}: BRDF x cos(theta_r), of unstated scale")
    found = add_history(found, "intensities divided by cos(theta_r); their scale is not stated: relative values")
    if not kept.all():
        found = add_history(found, f"{(~kept).sum()} values at theta_r = 90 deg, where the cosine is zero, left out")
    if form == RTD_START:
        found = add_history(found, "incidences from SampleID; the regridded second tables are left out")
    return found if found["brdf"].values.any() else add_history(found, "every value is zero")


def _columns(block: Block) -> np.ndarray:
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
