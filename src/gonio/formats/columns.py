"""Five columns of numbers: polar angle and azimuth in, polar angle and azimuth out [degree], BRDF [1/sr].

    # wavelength = 532 nm
    # polar_in azimuth_in polar_out azimuth_out brdf
    5.00  -180.00  -30.00  0.00  1.8e-02

Columns are parted by white space or commas, `#` starts a comment. A negative polar angle lies on the other side of the
normal. Comments may name the wavelength; `nan` is a missing value. The azimuth in is kept as phi_i where it changes.
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
MOST = (90.0, 1e6, 90.0, 1e6)  # deg; an azimuth further round has lost its digits
_HEADING = " ".join(COLUMNS)
_HISTORY = "history: "
_WAVELENGTH = re.compile(
    r"(?:lambda|wavelength|\u03bb)\s*(?:=|:|of|is)?\s*(\d{1,7}(?:\.\d{1,12})?)\s*(nm|um|\u00b5m|\u03bcm)\b", re.I
)


def _recognises(head: bytes) -> bool:
    """Whether the first line that is no comment has five numbers."""
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
    """The line and the five numbers of each row; comments are put into the list."""
    rows = Rows(path, COLUMNS, gaps=("brdf",))
    for line, text in lines(path):
        if "#" in text:
            text, _, remark = text.partition("#")
            comments.append(remark.strip())
        words = text.replace(",", " ").split() if "," in text else text.split()
        if len(words) > len(COLUMNS) == len(text.split()):
            raise FormatError(path, f"{clip(text.strip())!r}: write decimal points, not commas", f"line {line}")
        if words:
            rows.add(line, words)
    where, table = rows.table()
    if (beyond := np.abs(table[:, :4]) > MOST).any():
        row, column = np.unravel_index(int(beyond.argmax()), beyond.shape)
        what = f"{COLUMNS[column]} is {table[row, column]:g} deg, outside {-MOST[column]:g} to {MOST[column]:g}"
        raise FormatError(path, what, f"line {where[row]}")
    return where, table


def _wavelength(comments: list[str]) -> tuple[float | None, str]:
    """The wavelength [nm] that the comments name, where they name one, and what was done in words."""
    found = {float(size) * (1.0 if unit.lower() == "nm" else 1000.0) for size, unit in _named(comments)}
    if len(found) > 1:
        return None, f"took no wavelength from the comments, which name {len(found)}"
    value = found.pop() if found else 0.0
    return (value, f"took the wavelength {value:g} nm from the comments") if value > 0 else (None, "")


def _named(comments: list[str]) -> list[tuple[str, str]]:
    return [pair for c in comments if not c.startswith(_HISTORY) for pair in _WAVELENGTH.findall(c)]


def _write(scan: xr.Dataset, path: Path) -> None:
    """Raises ValueError for relative data, and for several sets in one scan."""
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
    """The five columns such that reading them gives each angle back.

    In plane as is usual, from azimuth 180 to azimuth 0 with the polar angle out signed; else from azimuth 0 to phi, or
    from phi_i to phi_i + phi where the surface was turned, which may round phi at its last digit.
    """
    theta_i, theta_r, phi, brdf = (flat[n].values.astype(float) for n in ("theta_i", "theta_r", "phi", "brdf"))
    if "phi_i" in flat.coords and np.unique(flat["phi_i"].values).size > 1:
        azimuth_in = flat["phi_i"].values.astype(float)
        return [theta_i, azimuth_in, theta_r, azimuth_in + phi, brdf]
    back, forward = phi % 360.0 == 0, phi == 180.0
    if (back | forward).all():
        retro = back & (theta_r == 0)  # a zero has no side: the azimuth says it
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
