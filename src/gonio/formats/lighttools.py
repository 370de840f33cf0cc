"""BSDF measurements of the program LightTools (.bsdf): one block per incidence, side, mode and wavelength.

    # remark
    Symmetry Asymmetric
    SpectralContent Monochrome            (or XYZ)
    ScatterAzimuth 37
    0 10 .. 360
    ScatterRadial 19
    0 5 .. 90
    DataBegin
    AOI 30
    POI 90
    Side Front                            (or Back)
    Wavelength 550
    ScatterType BRDF                      (or BTDF)
    TristimulusValue TrisX                (XYZ only)
    TIS 0.52
    a row of radial values for each azimuth
    DataEnd

No public page documents the grammar. It is that of libbsdf's reader, the only public one (libbsdf,
LightToolsBsdfReader.cpp). All blocks share one list of directions, whose angles are from the normal, not from the
specular direction. The plane of incidence of a sample that is not turned is at an azimuth of 90 deg: phi = azimuth -
90. Only such files (POI 90) are read, as libbsdf accepts no others. A TIS that differs from the integral of its table
is kept as the variable `tis`; when a scan without `tis` is written, TIS is that integral.
"""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import xarray as xr

from gonio.door.text import Words, clip, lines
from gonio.files import FormatError
from gonio.formats import hemispheres
from gonio.formats.format import Format, Holds
from gonio.formats.hemispheres import SAME, Hemisphere, Values, in_words
from gonio.measured.dataset import ABSOLUTE

TITLE = "LightTools BSDF"
LONGEST = 1 << 20  # bytes of a line: 360 000 azimuths or a row of values in full precision
HEADER = ("Symmetry", "SpectralContent", "ScatterAzimuth", "ScatterRadial")
BLOCK = ("AOI", "POI", "Side", "Wavelength", "ScatterType", "TristimulusValue", "TIS")
MODES = {"BRDF": "reflection", "BTDF": "transmission"}
SIDES = {"Front": "front", "Back": "back"}
TRISTIMULUS = {"TrisX": "X", "TrisY": "Y", "TrisZ": "Z"}
PLANE = 90.0  # deg, the azimuth of the incident light
SET_DIMENSIONS = ("mode", "side", "wavelength", "channel")
_OTHERS = re.compile(rb"^\s*(AngleOfIncidence|SampleRotation|Source)\b", re.IGNORECASE | re.MULTILINE)

_HEADER = re.compile("|".join(HEADER).encode(), re.IGNORECASE)


def _recognises(head: bytes) -> bool:
    # This is asked of every file, so the cheapest test is first: a word that every header has.
    if b"\0" in head or not _HEADER.search(head) or _OTHERS.search(head.replace(b"\r", b"\n")):
        return False
    text = head.removeprefix(b"\xef\xbb\xbf").decode("utf-8", errors="replace")
    first = (line.split("#")[0].split() for line in text.splitlines())
    words = next((line_words for line_words in first if line_words), [])
    return len(words) > 1 and words[0].lower() in {name.lower() for name in HEADER}


def _read(path: Path) -> xr.Dataset:
    words = Words(path, lines(path, longest=LONGEST))
    spectral, azimuths, theta_r = _header(words)
    blocks: list[Hemisphere] = []
    seen: dict[tuple, int] = {}
    while words.peek().lower() != "dataend":
        block, at = _block(words, spectral, azimuths, theta_r)
        key = (block.theta_i, *block.sets.items())
        if key in seen:
            names = ", ".join(map(str, block.sets.values()))
            message = f"AOI {block.theta_i:g} ({names}) is there already, in line {seen[key]}"
            raise FormatError(path, message, f"line {at}")
        seen[key] = at
        blocks.append(block)
    words.word("DataEnd")
    if words.peek():
        raise words.wrong(f"{clip(words.peek())!r} after DataEnd")
    if not blocks:
        raise words.wrong("there is no block of data between DataBegin and DataEnd")
    if len({tuple(block.sets) for block in blocks}) > 1:
        raise words.wrong("some blocks state a Wavelength and others do not: state it in all, or in none")
    history = []
    if all(math.isclose(b.scalars["tis"], _integral(b), rel_tol=SAME, abs_tol=SAME) for b in blocks):
        blocks = [replace(b, scalars={}) for b in blocks]
    else:
        history = ["tis is the TIS of the file, which is not the integral of its values"]
    provenance = "\n".join(remark for remark in words.remarks if remark)
    attrs = {"symmetry": "isotropic"}
    return hemispheres.dataset(blocks, ABSOLUTE, provenance=provenance, history=history, attrs=attrs)


def _header(words: Words) -> tuple[str, Values, Values]:
    """The spectral content of the blocks (Monochrome or XYZ), their azimuths and their radial angles [deg]."""
    spectral, angles = "", {}
    seen: set[str] = set()
    while (name := words.keyword(*HEADER, "DataBegin")) != "DataBegin":
        if name in seen:
            raise words.wrong(f"{name} occurs twice")
        seen.add(name)
        match name:
            case "Symmetry":
                words.keyword("Asymmetric")
            case "SpectralContent":
                spectral = words.keyword("Monochrome", "XYZ")
            case _:
                angles[name] = _angles(words, name)
    if missing := [name for name in HEADER if name not in seen]:
        raise words.wrong(f"DataBegin before {' and '.join(missing)}")
    return spectral, angles["ScatterAzimuth"], angles["ScatterRadial"]


def _angles(words: Words, name: str) -> Values:
    count = words.count(f"the number of {name}")
    numbers = _numbers(words, count, name)
    low, high = (-360.0, 360.0) if name == "ScatterAzimuth" else (0.0, 90.0)
    angles = hemispheres.axis(words.path, words.line, numbers, name, low, high)
    if name == "ScatterAzimuth" and abs(angles[-1] - angles[0]) > 360:
        raise words.wrong(f"{name} spans more than 360 deg")
    return angles


def _numbers(words: Words, count: int, expected: str) -> list[float]:
    """`count` numbers over as many lines as they take. Raises FormatError where the last line holds more."""
    numbers: list[float] = []
    while len(numbers) < count:
        row = words.row()
        if not row:
            raise words.wrong(f"the file ends after {len(numbers)} of {count} numbers of {expected}")
        numbers += hemispheres.row(words.path, words.line, row, expected)
    if len(numbers) > count:
        raise words.wrong(f"{len(numbers)} numbers of {expected} where there should be {count}")
    return numbers


def _block(words: Words, spectral: str, azimuths: Values, theta_r: Values) -> tuple[Hemisphere, int]:
    """One block and the line where it starts."""
    entries, at = _keys(words, spectral)
    values = _numbers(words, len(azimuths) * len(theta_r), "the table")
    table = np.array(values).reshape(len(azimuths), len(theta_r)).T
    if azimuths[-1] < azimuths[0]:
        azimuths, table = azimuths[::-1], table[:, ::-1]
    azimuths, table = hemispheres.without_closing(azimuths, table)
    sets = {name: entries[name] for name in SET_DIMENSIONS if name in entries}
    phi = hemispheres.turned(azimuths - PLANE)
    aoi, tis = float(entries["AOI"]), float(entries["TIS"])
    return Hemisphere(aoi, theta_r, phi, table, sets=sets, scalars={"tis": tis}), at


def _keys(words: Words, spectral: str) -> tuple[dict[str, str | float], int]:
    """The entries before a table, of which TIS is the last, and the line of the first; SET_DIMENSIONS name its set."""
    entries: dict[str, str | float] = {}
    seen: set[str] = set()
    at = 0
    while "TIS" not in seen:
        name = words.keyword(*BLOCK)
        at = at or words.line
        if name in seen:
            raise words.wrong(f"{name} occurs twice in the block")
        seen.add(name)
        entries |= _entry(words, name)
    needed = {"AOI", "Side", "ScatterType"} | ({"TristimulusValue"} if spectral == "XYZ" else set())
    if missing := [name for name in BLOCK if name in needed - seen]:
        raise words.wrong(f"the block has no {' and no '.join(missing)} before its TIS")
    if spectral != "XYZ" and "channel" in entries:
        raise words.wrong("TristimulusValue in a Monochrome file: is SpectralContent XYZ meant?")
    if spectral == "XYZ":
        entries.pop("wavelength", None)
    return entries, at


def _entry(words: Words, name: str) -> dict[str, str | float]:
    """The value of one entry of a block, by the name of its coordinate where it has one."""
    match name:
        case "Side":
            return {"side": SIDES[words.keyword(*SIDES)]}
        case "ScatterType":
            return {"mode": MODES[words.keyword(*MODES)]}
        case "TristimulusValue":
            return {"channel": TRISTIMULUS[words.keyword(*TRISTIMULUS)]}
    value = words.number(name)
    if name == "POI" and value != PLANE:
        raise words.wrong(f"POI is {value:g}: gonio reads samples that are not turned, which have POI {PLANE:g}")
    if name == "AOI" and not 0 <= value <= 90:
        raise words.wrong(f"AOI is {value:g} deg, outside 0 to 90")
    if name == "Wavelength":
        if value < 0:
            raise words.wrong(f"Wavelength is {value:g} nm")
        return {"wavelength": value} if value else {}  # 0 means that no wavelength is stated
    return {name: value + 0.0}


def _integral(block: Hemisphere) -> float:
    return hemispheres.integral(block.theta_r, block.phi, block.values)


def _write(scan: xr.Dataset, path: Path) -> None:
    brdf = hemispheres.on_grid(scan, SET_DIMENSIONS, TITLE)
    spectral = _spectral(brdf)
    theta_r, phi = brdf["theta_r"].values, brdf["phi"].values
    if brdf.sizes["phi_i"] > 1:
        raise ValueError(f"{TITLE} holds no turned surfaces that gonio could verify: select one phi_i")
    azimuths = hemispheres.turned(phi + PLANE)
    order = np.argsort(azimuths)
    closing = [azimuths[order[0]] + 360] if azimuths[order[0]] == 0 and len(order) > 1 else []
    closed = [*order, order[0]] if closing else [*order]
    with path.open("w", encoding="utf-8", newline="\n") as file:
        file.writelines(f"# {line}\n" for line in scan.attrs.get("provenance", "").splitlines())
        file.write(f"Symmetry Asymmetric\nSpectralContent {spectral}\n")
        file.write(f"ScatterAzimuth {len(closed)}\n{in_words([*azimuths[order], *closing])}\n")
        file.write(f"ScatterRadial {len(theta_r)}\n{in_words(theta_r)}\nDataBegin\n")
        for index in np.ndindex(*(brdf.sizes[n] for n in SET_DIMENSIONS), brdf.sizes["theta_i"]):
            table = brdf.values[index][0]
            part = {n: brdf[n].values[k] for n, k in zip((*SET_DIMENSIONS, "theta_i"), index, strict=True)}
            tis = _tis(scan, part)
            if tis is None:
                tis = hemispheres.integral(theta_r, phi, table)
            file.writelines(_lines_of(part, tis))
            file.writelines(in_words(row) + "\n" for row in table[:, closed].T.tolist())
        file.write("DataEnd\n")


def _spectral(brdf: xr.DataArray) -> str:
    """The spectral content, XYZ or Monochrome. Raises ValueError for channels other than X, Y and Z."""
    channels = [str(c) for c in brdf["channel"].values.tolist() if str(c) != "nan"]
    if not channels:
        return "Monochrome"
    if sorted(channels) != ["X", "Y", "Z"]:
        raise ValueError(f"{TITLE} holds the channels X, Y and Z, not {', '.join(channels)}: select one channel")
    if brdf.sizes["wavelength"] > 1:
        raise ValueError(f"{TITLE} holds wavelengths or channels, not both: select one wavelength")
    return "XYZ"


def _tis(scan: xr.Dataset, part: dict) -> float | None:
    """The variable `tis` of the scan for one table; None where the scan has no such variable."""
    if "tis" not in scan:
        return None
    return float(scan["tis"].sel({n: part[n] for n in scan["tis"].dims}))


def _lines_of(part: dict, tis: float) -> list[str]:
    """The entries before a table, as lines."""
    mode = next((word for word, name in MODES.items() if name == str(part["mode"])), "BRDF")
    side = next((word for word, name in SIDES.items() if name == str(part["side"])), "Front")
    head = [f"AOI {in_words([part['theta_i']])}", f"POI {in_words([PLANE])}", f"Side {side}"]
    if str(part["wavelength"]) != "nan":
        head.append(f"Wavelength {in_words([part['wavelength']])}")
    head.append(f"ScatterType {mode}")
    if str(part["channel"]) != "nan":
        head.append(f"TristimulusValue Tris{part['channel']}")
    return [line + "\n" for line in (*head, f"TIS {in_words([tis])}")]


FORMAT = Format(
    name="lighttools",
    title=TITLE,
    suffix=".bsdf",
    recognises=_recognises,
    read=_read,
    write=_write,
    layout=lambda scan: hemispheres.layout(scan, anisotropic=False),
    holds=Holds(transmission=True, sets=SET_DIMENSIONS, channels=(("X", "Y", "Z"),), variables=("tis",)),
)
