"""Raw readings of the University of Arizona's Black Lab goniometer (`.inp.txt`), one wavelength a file.

Line 1 is the operator, a tab and the date; 2 a comment; 3 the wavelength in nanometers; 4 the number of rows. A row has
the stage angles X (arm), Y (yoke), U (tilt), V (rotation) [deg], the signal [V], the standard deviation of its samples
and that in per cent. After the rows come a line that ends in the number of samples, the dark before and the dark after
with their standard deviations, and the number of the spectral filter. Signals are net of dark already: against the
reflectance factors that were published of these files they have no offset (1.6e-7 V, where the darks are 4e-4 V).

With U = 0 the source lies at -Y from the normal and the detector at X - Y in the same sense, so theta_i = |Y|, and the
detector is on the forward side where it is on the other side of the normal (ua-loft/bsdf-tools, stage2angles.m).
"""

import re
from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.rows import Rows
from gonio.door.text import MOST_VALUES, clip, lines
from gonio.files import FormatError
from gonio.reduction.readings import LINE, NET, make_readings

_WAVELENGTH = re.compile(r"\s*([\d.]+)\s+nanometers\s*")
_DARK = re.compile(r"\s*([-+\d.eE]+)\s*\+-\s*([-+\d.eE]+)\s*=\s*dark \d+\s*")
NAMES = ("X", "Y", "U", "V", "signal", "sd", "relative sd")
BEFORE = 4  # lines before the rows
Values = npt.NDArray[np.float64]


def recognises(start: bytes) -> bool:
    """Whether a file that begins with these bytes is one: a wavelength in line 3, a whole number in line 4."""
    first = start.split(b"\n", BEFORE)[:BEFORE]
    if len(first) < BEFORE:
        return False
    third, fourth = (line.decode("latin-1").strip() for line in first[2:])
    return bool(_WAVELENGTH.fullmatch(third)) and fourth.isdigit()


def read(path: Path) -> xr.Dataset:
    """The readings: those of the sample, and the two darks. Raises FormatError with the line."""
    source = list(lines(path, encoding="latin-1"))
    found = _WAVELENGTH.fullmatch(source[2][1])
    assert found  # which `recognises` has seen
    count = int(source[3][1])
    if not 0 < count <= MOST_VALUES // len(NAMES):
        raise FormatError(path, f"promises {clip(source[3][1].strip())} rows", "line 4")
    if len(source) < BEFORE + count:
        raise FormatError(path, f"promises {count} rows and ends after {len(source) - BEFORE}", f"line {len(source)}")
    rows = Rows(path, NAMES)
    for number, line in source[BEFORE : BEFORE + count]:
        rows.add(number, line.split())
    at, table = rows.table()
    theta_i, theta_r, phi_i = _angles(path, at, table[:, :4])
    darks, samples = _tail(path, source[BEFORE + count :])
    own, further = np.ones(len(at)), np.ones(len(darks))
    columns = {
        "kind": ["sample"] * len(at) + ["dark"] * len(darks),
        "theta_i": np.concatenate([theta_i, further * np.nan]),
        "theta_r": np.concatenate([theta_r, further * np.nan]),
        "signal": [*table[:, 4], *(value for _, value, _ in darks)],
        "sd": [*table[:, 5], *(sd for *_, sd in darks)],
        "samples": np.concatenate([own, further]) * samples,
        "wavelength": np.concatenate([own * float(found[1]), further * np.nan]),
        LINE: [*at.tolist(), *(number for number, *_ in darks)],
    }
    if phi_i.any():
        columns["phi_i"] = np.concatenate([phi_i, further * np.nan])
    said = [("operator, date", source[0][1]), ("comment", source[1][1])]
    about = "\n".join(f"{what}: {' '.join(text.split())}" for what, text in said if text.strip())
    return make_readings(columns, "V", {NET: 1, "instrument": "Black Lab", "provenance": about})


def _angles(path: Path, at: npt.NDArray[np.int64], stage: Values) -> tuple[Values, Values, Values]:
    """theta_i, the signed theta_r and phi_i [deg] (n,) of stage angles X, Y, U, V (n, 4)."""
    arm, yoke, tilt, turn = stage.T
    for row in np.flatnonzero(tilt != 0).tolist():
        message = f"the tilt U is {tilt[row]:g} deg, and the directions of a tilted stage are not known: delete the row"
        raise FormatError(path, message, f"line {at[row]}")
    view = arm - yoke
    theta_i, theta_r = np.abs(yoke), np.where(yoke > 0, view, -view)
    for row in np.flatnonzero((theta_i > 90) | (np.abs(theta_r) > 90)).tolist():
        message = f"the source at {theta_i[row]:g} deg or the detector at {theta_r[row]:g} deg is below the sample"
        raise FormatError(path, message, f"line {at[row]}")
    # The rotation V of the sample, from the side where the source is: at normal incidence there is none.
    phi_i = np.where(yoke == 0, 0.0, (turn + np.where(yoke > 0, 180.0, 0.0)) % 360.0)
    return theta_i, theta_r, phi_i


def _tail(path: Path, rest: list[tuple[int, str]]) -> tuple[list[tuple[int, float, float]], float]:
    """The line, value and standard deviation of each dark, and the number of samples of a reading."""
    filled = [(number, line) for number, line in rest if line.strip()]
    try:
        samples = float(filled[0][1].split()[-1])
        darks = [(n, float(m[1]), float(m[2])) for n, line in filled[1:] if (m := _DARK.fullmatch(line))]
    except (IndexError, ValueError):
        samples, darks = 0.0, []
    if not (samples >= 1 and darks):
        where = f"line {filled[0][0]}" if filled else ""
        raise FormatError(path, "has no number of samples and no darks after its rows: it was cut off", where)
    return darks, samples
