"""The tabulated BSDF of the program FRED (fredtabulated): a section of rows for each specular direction.

    type bsdf_data
    format angles=deg bsdf=value scale=1
    10 0
    0 0 0.031984
    5 170 0.0342

A row of two numbers is the polar angle and azimuth of the specular direction and opens a section; a row of three is a
scattered direction and its value. Azimuths are relative to that of the specular direction: 0 is forward. A negative
polar angle is on the other side of the normal. `angles=sin` has the direction cosines x and y in place of the two
angles, `bsdf=log` the decimal logarithm; the value is then multiplied by `scale`. Surfaces are isotropic and values
positive.

The layout is documented in FRED's help (Photon Engineering, Tabulated BSDF; a PDF of it is in ua-loft/bsdf-tools,
krell2026). No open reader is known.
"""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.text import clip, lines, number
from gonio.files import FormatError
from gonio.formats.format import Format, Holds
from gonio.measured.dataset import RELATIVE, add_history, flatten, make_scan, unit

Array = npt.NDArray[np.float64]
Lines = npt.NDArray[np.int64]
OPTIONS = {"angles": ("deg", "sin"), "bsdf": ("value", "log"), "scale": ()}
EXAMPLE = "format angles=deg bsdf=value scale=1"
DECIMALS = 10  # of an azimuth [deg]: rounds away the errors of differences of printed azimuths
_SIGNATURE = re.compile(rb"\A(?:\xef\xbb\xbf)?\s*type[ \t]+bsdf_data\s", re.IGNORECASE)


def _recognises(head: bytes) -> bool:
    return _SIGNATURE.match(head) is not None


def _read(path: Path) -> xr.Dataset:
    source = ((n, text.replace(",", " ").split()) for n, text in lines(path))
    rows = ((n, words) for n, words in source if words)
    line, words = next(rows, (1, []))
    if [word.lower() for word in words] != ["type", "bsdf_data"]:
        raise FormatError(path, f"{clip(' '.join(words))!r} where 'type bsdf_data' was expected", f"line {line}")
    options, scale = _options(path, *next(rows, (line, [])))
    specular, sections, table, places = _table(path, rows)
    theta_i, phi_spec = _angles(path, options["angles"], specular, sections, "specular")
    theta_r, phi_scat = _angles(path, options["angles"], table[:, :2], places, "scattered")
    with np.errstate(over="ignore"):
        brdf = (10.0 ** table[:, 2] if options["bsdf"] == "log" else table[:, 2]) * scale
    _refuse(path, places, ~np.isfinite(brdf), "the value is beyond the largest number")
    scan = make_scan(
        theta_i,
        theta_r,
        brdf,
        _from_forward(phi_scat - phi_spec),
        phi_i=_from_forward(phi_spec) if len(np.unique(phi_spec)) > 1 else None,
        variables={"line": (places, "1")},
    )
    return _with_history(scan.assign_attrs(symmetry="isotropic"), options, scale)


def _with_history(scan: xr.Dataset, options: dict[str, str], scale: float) -> xr.Dataset:
    if options["angles"] == "sin":
        scan = add_history(scan, "angles from the direction cosines x and y")
    if options["bsdf"] == "log":
        scan = add_history(scan, "10 to the power of the stored logarithms")
    if scale != 1.0:
        scan = add_history(scan, f"multiplied by the file's scale, {scale!r}")
    if not scan["brdf"].values.any():
        scan = add_history(scan, "every value is zero")
    return scan


def _options(path: Path, line: int, words: list[str]) -> tuple[dict[str, str], float]:
    """The options `angles` and `bsdf`, and the scale, from the second line."""
    where = f"line {line}"
    if not words or words[0].lower() != "format":
        raise FormatError(path, f"{clip(' '.join(words))!r} where a line like {EXAMPLE!r} was expected", where)
    options = {"angles": "deg", "bsdf": "value"}
    scale = 1.0
    for word in words[1:]:
        name, _, value = word.lower().partition("=")
        if name == "scale":
            scale = number(path, line, value, "the scale")
        elif name in OPTIONS and value in OPTIONS[name]:
            options[name] = value
        else:
            raise FormatError(path, f"{clip(word)!r} is none of angles=deg|sin, bsdf=value|log, scale=number", where)
    if not scale > 0:
        raise FormatError(path, f"the scale is {scale:g}, not positive", where)
    return options, scale


def _table(path: Path, rows: Iterator[tuple[int, list[str]]]) -> tuple[Array, Lines, Array, Lines]:
    """For every value: its specular direction (n, 2) and the line of that, its row (n, 3) and the line of that."""
    specular: list[list[float]] = []
    sections: list[int] = []
    table: list[list[float]] = []
    places: list[int] = []
    section: list[float] = []
    line = opened = 1
    for line, words in rows:
        numbers = _numbers(path, line, words)
        if len(numbers) == 2:
            section, opened = numbers, line
        elif len(numbers) == 3 and section:
            specular.append(section)
            sections.append(opened)
            table.append(numbers)
            places.append(line)
        elif len(numbers) == 3:
            raise FormatError(path, "a value before any specular direction", f"line {line}")
        else:
            message = f"{len(numbers)} numbers where a row has 2 (specular direction) or 3 (direction, value)"
            raise FormatError(path, message, f"line {line}")
    if not table:
        raise FormatError(path, "holds no values", f"line {line}")
    return np.array(specular), np.array(sections), np.array(table), np.array(places)


def _numbers(path: Path, line: int, words: list[str]) -> list[float]:
    try:
        numbers = list(map(float, words))
    except ValueError:
        numbers = []
    # The sum is a quick test. Where it overflows for finite numbers, each word is read on its own and accepted.
    if not numbers or not abs(sum(numbers)) < np.inf or any("_" in word for word in words):
        return [number(path, line, word, "a number of the row") for word in words]
    return numbers


def _angles(path: Path, kind: str, pairs: Array, places: Lines, role: str) -> tuple[Array, Array]:
    """Polar angles, 0 to 90, and azimuths [deg] of pairs (n, 2); `role` names the direction in a message."""
    if kind == "sin":
        sine = np.hypot(pairs[:, 0], pairs[:, 1])
        _refuse(path, places, sine > 1 + 1e-9, f"the direction cosines of a {role} direction are beyond 1")
        azimuth = np.round(np.degrees(np.arctan2(pairs[:, 1], pairs[:, 0])), DECIMALS)
        return np.asarray(np.degrees(np.arcsin(np.minimum(sine, 1.0))), dtype=float), np.asarray(azimuth, dtype=float)
    theta, azimuth = pairs.T
    _refuse(path, places, np.abs(theta) > 90, f"the polar angle of a {role} direction is outside -90 to 90 deg")
    _refuse(path, places, np.abs(azimuth) > 360, f"the azimuth of a {role} direction is outside -360 to 360 deg")
    turned: Array = np.where(theta < 0, azimuth + 180.0, azimuth)
    return np.abs(theta), turned


def _refuse(path: Path, places: Lines, bad: npt.NDArray[np.bool_], message: str) -> None:
    if bad.any():
        raise FormatError(path, message, f"line {places[np.argmax(bad)]}")


def _from_forward(azimuth: Array) -> Array:
    """phi, 0 to 360 deg, of azimuths from the forward direction; the same formula inverts it."""
    turned = np.round(180.0 - azimuth, DECIMALS)
    return np.where((turned < 0) | (turned > 360), turned % 360.0, turned) + 0.0


def _write(scan: xr.Dataset, path: Path) -> None:
    if unit(scan) == RELATIVE:
        raise ValueError("FRED takes a BSDF in 1/sr: calibrate the relative values first")
    flat = flatten(scan)
    brdf = flat["brdf"].values
    if not brdf.size:
        raise ValueError("the scan holds no values")
    if bad := int((~(brdf > 0)).sum()):
        raise ValueError(
            f"{bad} values are missing, zero or negative, and FRED takes positive ones only:"
            " drop them, or raise them to the instrument's floor"
        )
    if "phi_i" in flat.coords and len(np.unique(flat["phi_i"].values)) > 1:
        raise ValueError("FRED's surfaces are isotropic: select one phi_i, or average over it")
    theta_i, theta_r, phi = (flat[a].values.astype(float) for a in ("theta_i", "theta_r", "phi"))
    starts = np.flatnonzero(np.diff(theta_i, prepend=np.nan) != 0)
    with path.open("w", encoding="utf-8", newline="") as file:
        file.write(f"type bsdf_data\n{EXAMPLE}\n")
        for start, end in zip(starts, [*starts[1:], len(brdf)], strict=True):
            file.write(f"{_text(theta_i[start])}\t0\n")
            columns = (theta_r[start:end], _from_forward(phi[start:end]), brdf[start:end])
            file.writelines("\t".join(map(_text, row)) + "\n" for row in zip(*columns, strict=True))


def _text(value: float) -> str:
    return repr(float(value)).removesuffix(".0")


FORMAT = Format(
    name="fred",
    title="FRED tabulated BSDF",
    suffix=".txt",
    recognises=_recognises,
    read=_read,
    write=_write,
    holds=Holds(negative=False),
)
