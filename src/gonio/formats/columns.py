"""Five columns of numbers: polar angle and azimuth in, polar angle and azimuth out [degree], BRDF [1/sr].

    # wavelength = 532 nm
    # polar_in azimuth_in polar_out azimuth_out brdf
    5.00  -180.00  -30.00  0.00  1.8e-02

Columns are separated by white space or commas, `#` starts a comment. A negative polar angle is on the other side of
the normal. Comments may give the wavelength; `nan` is a missing value. The azimuth in becomes phi_i where it varies.
Five numbers a row are no signature: where a comment names other columns, speaks of radians or of pgII, the file is
refused.

It is the form of the program lumos (package lumos-sat, lumos/brdf/tools.py).
"""

import re
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.rows import Rows
from gonio.door.text import clip, lines
from gonio.files import FormatError
from gonio.formats.format import Format, Holds
from gonio.measured.dataset import ABSOLUTE, add_history, flatten, make_scan, sets, unit

COLUMNS = ("polar_in", "azimuth_in", "polar_out", "azimuth_out", "brdf")
MOST = (90.0, 1e6, 90.0, 1e6)  # deg; a larger azimuth has lost its digits to rounding
_HEADING = " ".join(COLUMNS)
_HISTORY = "history: "
_WAVELENGTH = re.compile(
    r"(?:lambda|wavelength|\u03bb)\s*(?:=|:|of|is)?\s*(\d{1,7}(?:\.\d{1,12})?)\s*(nm|um|\u00b5m|\u03bcm)\b", re.I
)

# How a line of comment names columns: an angle of a direction by its kind and its side, and the BRDF.
_ANGLE = re.compile(r"(theta|phi|polar|azimuth|zenith|elevation)_?(in|i|out|o|r|s|v)?", re.I)
_SIDES = {"i": "in", "in": "in"}  # any other names the direction out
_VALUE = re.compile(r"(brdf|bsdf|btdf|f_?r?|value)", re.I)
_WORD = re.compile(
    r"(\w*(theta|phi|polar|azimuth|zenith|elevation)\w*|\w*wave_?length\w*|lambda\w*|\w*(brdf|bsdf|btdf)\w*|brf|refl\w*"
    r"|[xyz]|sza|vza|raa|saa|vaa|aoi|aos|f_?r|value|radiance|signal)",
    re.I,
)
_RADIANS = re.compile(r"\b(radians?|rad)\b", re.I)
_PGII = re.compile(r"\bpg-?(ii|2)\b|\bpab advanced\b", re.I)


def _recognises(head: bytes) -> bool:
    """Whether the first line that is not a comment has five numbers."""
    for line in head.removeprefix(b"\xef\xbb\xbf").replace(b"\r", b"\n").split(b"\n"):
        words = line.partition(b"#")[0].replace(b",", b" ").split()
        if words:
            return len(words) == len(COLUMNS) and all(_is_number(word) for word in words)
        if b"#DIM" in line or b"#PARAM_IN" in line:  # a file of ALTA
            return False
    return False


def _is_number(word: bytes) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _read(path: Path) -> xr.Dataset:
    comments: list[str] = []
    where, table = _rows(path, comments)
    polar_in, azimuth_in, polar_out, azimuth_out, brdf = table.T
    if not np.any(np.nan_to_num(brdf)):
        raise FormatError(path, "every brdf value is zero or missing", f"line {where[0]}")
    turned_in = azimuth_in + np.where(polar_in < 0, 180.0, 0.0)
    turned_out = azimuth_out + np.where(polar_out < 0, 180.0, 0.0)
    phi_i = turned_in % 360.0
    wavelength, history = _wavelength(comments)
    scan = make_scan(
        np.abs(polar_in),
        np.abs(polar_out),
        brdf,
        (turned_out - turned_in) % 360.0,
        phi_i=phi_i if np.unique(phi_i).size > 1 else None,
        coordinates={} if wavelength is None else {"wavelength": np.full(len(where), wavelength)},
        variables={"line": (where, "1")},
        provenance="\n".join(c for c in comments if c != _HEADING and not c.startswith(_HISTORY)),
        history="\n".join(c.removeprefix(_HISTORY) for c in comments if c.startswith(_HISTORY)),
    )
    return add_history(scan, history) if history else scan


def _rows(path: Path, comments: list[str]) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """The line and the five numbers of each row; the text of comments is appended to `comments`."""
    rows = Rows(path, COLUMNS, gaps=("brdf",))
    for line, text in lines(path):
        if "#" in text:
            text, _, remark = text.partition("#")
            comments.append(remark.strip())
            _refuse_other_columns(path, line, remark.strip())
        words = text.replace(",", " ").split() if "," in text else text.split()
        if len(words) > len(COLUMNS) == len(text.split()):
            raise FormatError(path, f"{clip(text.strip())!r}: write decimal points, not commas", f"line {line}")
        if words:
            rows.add(line, words)
    where, table = rows.table()
    if (beyond := np.abs(table[:, :4]) > MOST).any():
        row, column = np.unravel_index(int(beyond.argmax()), beyond.shape)
        message = f"{COLUMNS[column]} is {table[row, column]:g} deg, outside {-MOST[column]:g} to {MOST[column]:g}"
        raise FormatError(path, message, f"line {where[row]}")
    return where, table


def _refuse_other_columns(path: Path, line: int, remark: str) -> None:
    """FormatError where a comment says that the numbers are other than the five of this format."""
    if remark.startswith(_HISTORY):
        return
    remedy = (
        "write a tidy CSV, whose header names each column and its unit, like theta_i_deg,theta_r_deg,phi_deg,brdf_sr-1"
    )
    place = f"line {line}"
    if _PGII.search(remark):
        what = "the comment speaks of pgII, whose columns are theta, phi and colours, and not five columns"
        raise FormatError(path, f"{what}: {remedy}", place)
    if _RADIANS.search(remark):
        raise FormatError(path, f"the comment speaks of radians, and five columns are in degrees: {remedy}", place)
    words = re.sub(r"\[[^\]]*\]|\([^)]*\)", " ", remark).replace(",", " ").replace(";", " ").split()
    if len(words) < 3 or not all(_WORD.fullmatch(word) for word in words) or _are_the_five(words):
        return
    message = f"the comment names the columns {clip(' '.join(words))!r}, and five columns are {_HEADING}"
    raise FormatError(path, f"{message}: {remedy}", place)


def _are_the_five(words: list[str]) -> bool:
    """Whether names of columns mean these: one kind of angle, the other kind, the same two of the way out, the BRDF.

    Which kind comes first does not matter: the program lumos calls the polar angle phi.
    """
    angles = [_ANGLE.fullmatch(re.sub(r"_?deg(rees?)?$", "", word, flags=re.I)) for word in words[:4]]
    if len(words) != len(COLUMNS) or not all(angles) or not _VALUE.fullmatch(re.sub(r"_?sr-?1?$", "", words[4])):
        return False
    kinds = [(a[1].lower(), _SIDES.get((a[2] or "").lower(), "out")) for a in angles if a]
    (first, *_), (second, *_) = kinds[:2]
    return first != second and kinds == [(first, "in"), (second, "in"), (first, "out"), (second, "out")]


def _wavelength(comments: list[str]) -> tuple[float | None, str]:
    """The wavelength [nm] where the comments give exactly one, else None; and a line for the history."""
    wavelengths = {
        float(size) * (1.0 if unit.lower() == "nm" else 1000.0) for size, unit in _wavelength_matches(comments)
    }
    if len(wavelengths) > 1:
        return None, f"took no wavelength from the comments, which name {len(wavelengths)}"
    value = wavelengths.pop() if wavelengths else 0.0
    return (value, f"took the wavelength {value:g} nm from the comments") if value > 0 else (None, "")


def _wavelength_matches(comments: list[str]) -> list[tuple[str, str]]:
    return [pair for c in comments if not c.startswith(_HISTORY) for pair in _WAVELENGTH.findall(c)]


def _write(scan: xr.Dataset, path: Path) -> None:
    """Write the scan. Raises ValueError for relative data and for several sets in one scan."""
    if unit(scan) != ABSOLUTE:
        raise ValueError("five columns do not say that values are relative: calibrate the scan first")
    flat = flatten(scan)
    if several := sets(flat):
        raise ValueError(f"five columns hold one set: select one {' and one '.join(several)}")
    with path.open("w", encoding="utf-8", newline="\n") as file:
        for line in _comments(flat):
            file.write(f"# {line}".rstrip() + "\n")
        for row in zip(*(v.tolist() for v in _columns(flat)), strict=True):
            file.write(" ".join(map(repr, row)) + "\n")


def _comments(flat: xr.Dataset) -> list[str]:
    written = flat.attrs.get("provenance", "").splitlines()
    if "wavelength" in flat.coords and flat["wavelength"].size:
        value = float(flat["wavelength"].values.ravel()[0])
        if _wavelength(written)[0] != value:
            written = [*written, f"wavelength = {value!r} nm"]
    return [*written, *(_HISTORY + line for line in flat.attrs.get("history", "").splitlines()), _HEADING]


def _columns(flat: xr.Dataset) -> list[Any]:
    """The five columns, from which `_read` gives each angle back.

    A scan in the plane of incidence has azimuth 180 in and azimuth 0 out with a signed polar angle, as is usual.
    Another scan has azimuth 0 in and phi out; where the surface was turned, phi_i in and phi_i + phi out, which may
    round phi in its last digit.
    """
    theta_i, theta_r, phi, brdf = (flat[n].values.astype(float) for n in ("theta_i", "theta_r", "phi", "brdf"))
    if "phi_i" in flat.coords and np.unique(flat["phi_i"].values).size > 1:
        azimuth_in = flat["phi_i"].values.astype(float)
        return [theta_i, azimuth_in, theta_r, azimuth_in + phi, brdf]
    back, forward = phi % 360.0 == 0, phi == 180.0
    if (back | forward).all():
        retro = back & (theta_r == 0)  # -0.0 cannot mark the backward side of the normal direction, so its azimuth does
        signed = np.where(back & ~retro, -theta_r, theta_r)
        return [theta_i, np.full(len(phi), 180.0), signed, np.where(retro, 180.0, 0.0), brdf]
    return [theta_i, np.zeros(len(phi)), theta_r, phi, brdf]


FORMAT = Format(
    name="columns",
    title="five columns",
    suffix=".dat",
    recognises=_recognises,
    read=_read,
    write=_write,
    holds=Holds(anisotropic=True, gaps=True),
    rank=80,
)
