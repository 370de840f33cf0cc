"""The universal BRDF format of the project BiRD (EMPIR 16NRM08): JSON with one list of values for each variable.

    {"metadata": {..}, "data": {"theta_i": {"unit": "deg", "values": [..]}, .., "BRDF": {"unit": "sr^-1", ..}}}

The layout is the project's public JSON schema, version 1.0 (BRDF_JSON_schema in the repository BiRD_view). Both
directions are given by polar angle and azimuth about the normal, as in Nicodemus's definition of the BRDF, so phi =
phi_r - phi_i and the forward direction is at 180 deg. `uBRDF` is the uncertainty, absolute or in percent of the BRDF.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.json_text import Document, load
from gonio.door.text import clip
from gonio.formats.bird import metadata as bird_metadata
from gonio.formats.format import Format, Holds
from gonio.measured.causes import gathered
from gonio.measured.dataset import ABSOLUTE, MASK_MEANINGS, SETS, add_history, make_scan

_ANGLES = {"theta_i": 90.0, "phi_i": 360.0, "theta_r": 90.0, "phi_r": 360.0}
_DEGREES = {"°": 1.0, "deg": 1.0, "rad": 180.0 / math.pi}
_NANOMETRES = {"nm": 1.0, "μm": 1e3, "µm": 1e3}
_BRDF = {"1/sr": 1.0, "sr^-1": 1.0}
_PERCENT = "%"
_STOKES = {(1.0, 1.0, 0.0, 0.0): "s", (1.0, -1.0, 0.0, 0.0): "p", (1.0, 0.0, 0.0, 0.0): "u"}
_KNOWN = {*_ANGLES, "BRDF", "uBRDF", "wavelength_i", "wavelength_r", "polarization_i", "polarization_r"}
_ADHOC = "adhoc_variables"
REFLECTED = "wavelength_r"  # variable: wavelength of the reflected light where that of the incident light differs
Array = npt.NDArray[np.float64]


def _read(path: Path) -> xr.Dataset:
    document = load(path)
    data = document.object("data")
    angles = {name: _angle(document, name) for name in _ANGLES}
    brdf = _numbers(document, _BRDF, "data", "BRDF")
    if not np.any(brdf):
        raise document.wrong("every brdf value is zero: the detector saw nothing", "data", "BRDF", "values")
    uncertainty, remarks = _uncertainty(document, brdf)
    coordinates, variables, more = _others(document)
    phi_i = angles["phi_i"]
    scan = make_scan(
        angles["theta_i"],
        angles["theta_r"],
        brdf,
        (angles["phi_r"] - phi_i) % 360.0,
        phi_i=phi_i if np.any(phi_i) else None,
        uncertainty=uncertainty,
        coordinates=coordinates,
        variables=variables,
    )
    try:
        scan = gathered(scan)
    except ValueError as error:
        raise document.wrong(str(error), "data", _ADHOC) from None
    scan.attrs |= bird_metadata.attributes(document)
    left_out = [f"left out {name}, which the format does not know" for name in data if name not in {*_KNOWN, _ADHOC}]
    for line in (*remarks, *more, *left_out):
        scan = add_history(scan, line)
    return scan


def _values(document: Document, *steps: str) -> list[Any]:
    """The list of values at these names. Raises FormatError with the line where it has not as many as the BRDF."""
    brdf = document.object("data", "BRDF").get("values")
    values = document.object(*steps).get("values")
    if not isinstance(values, list):
        raise document.wrong(f"{clip(steps[-1])} has no list of values", *steps, "values")
    if not values:
        raise document.wrong(f"{clip(steps[-1])} has an empty list of values", *steps, "values")
    if isinstance(brdf, list) and len(values) != len(brdf):
        message = f"{clip(steps[-1])} has {len(values)} values, and the BRDF {len(brdf)}"
        raise document.wrong(message, *steps, "values")
    return values


def _numbers(document: Document, units: dict[str, float], *steps: str) -> Array:
    """The numbers of a variable in gonio's unit. Raises FormatError with the line of the first that is not finite."""
    values = _values(document, *steps)
    unit = document.object(*steps).get("unit")
    if not isinstance(unit, str) or unit not in units:
        message = f"{clip(steps[-1])} has the unit {clip(str(unit))!r}, not {' or '.join(units)}"
        raise document.wrong(message, *steps, "unit")
    _check_numbers(document, values, *steps)
    numbers = np.array(values, dtype=float)
    return numbers if units[unit] == 1.0 else _product(document, numbers, units[unit], *steps)


def _product(document: Document, values: Array, scale: float | Array, *steps: str) -> Array:
    """Values times the scale of their unit. Raises FormatError where the product overflows."""
    with np.errstate(over="ignore"):
        product = values * scale
    if not np.isfinite(product).all():
        raise document.wrong(
            f"a value of {clip(steps[-1])} is too large", *steps, "values", int(np.isinf(product).argmax())
        )
    return product


def _check_numbers(document: Document, values: list[Any], *steps: str) -> None:
    if set(map(type, values)) == {float} and np.isfinite(values).all():
        return
    bad = next(n for n, v in enumerate(values) if type(v) is not float or not math.isfinite(v))
    text = clip(str(values[bad]))
    raise document.wrong(f"a value of {clip(steps[-1])} is {text}, not a finite number", *steps, "values", bad)


def _angle(document: Document, name: str) -> Array:
    degrees = _numbers(document, _DEGREES, "data", name)
    most = _ANGLES[name] + (1e-9 if name.startswith("theta") else 0.0)
    outside = np.flatnonzero((degrees < 0) | (degrees > most))
    if len(outside):
        message = f"{name} is {degrees[outside[0]]:g} deg, outside 0 to {_ANGLES[name]:g}"
        raise document.wrong(message, "data", name, "values", int(outside[0]))
    return np.minimum(degrees, _ANGLES[name])


def _uncertainty(document: Document, brdf: Array) -> tuple[Array | None, list[str]]:
    """The uncertainty of every value [1/sr], None where the file states none, and lines for the history."""
    data = document.object("data")
    constant = data["BRDF"].get("uncertainty")
    steps: tuple[str, ...]
    if "uBRDF" in data:
        units = {**_BRDF, _PERCENT: 1.0}
        uncertainty, steps = _numbers(document, units, "data", "uBRDF"), ("data", "uBRDF")
        lines = ["took uBRDF and left out the constant uncertainty"] if constant is not None else []
    elif constant is not None:
        steps = ("data", "BRDF", "uncertainty")
        value = document.object(*steps).get("value")
        if type(value) is not float or not math.isfinite(value):
            raise document.wrong("the uncertainty of the BRDF has no finite value", *steps, "value")
        uncertainty, lines = np.full(len(brdf), value), ["took the constant uncertainty for every value"]
    else:
        return None, []
    if np.any(uncertainty < 0):
        bad = int(np.argmax(uncertainty < 0))
        place = (*steps, "values", bad) if steps[-1] == "uBRDF" else (*steps, "value")
        raise document.wrong(f"an uncertainty is {uncertainty[bad]:g}", *place)
    unit = document.object(*steps).get("unit")
    if unit == _PERCENT:
        return _product(document, uncertainty / 100, np.abs(brdf), *steps), [
            *lines,
            "took the uncertainty from percent of the BRDF",
        ]
    if unit not in _BRDF:
        raise document.wrong(f"the uncertainty has the unit {clip(str(unit))!r}", *steps, "unit")
    return uncertainty, lines


def _others(document: Document) -> tuple[dict[str, Any], dict[str, tuple[Any, str]], list[str]]:
    """The coordinates of sets, further variables with their units, and lines for the history."""
    data = document.object("data")
    coordinates: dict[str, Any] = {}
    variables: dict[str, tuple[Any, str]] = {}
    lines: list[str] = []
    present = [n for n in ("wavelength_i", "wavelength_r") if n in data]
    waves = {n: _numbers(document, _NANOMETRES, "data", n) for n in present}
    for wave, nanometres in waves.items():
        if np.any(nanometres <= 0):
            bad = int(np.argmax(nanometres <= 0))
            raise document.wrong(f"{wave} is {nanometres[bad]:g}", "data", wave, "values", bad)
    if "wavelength_i" in waves:
        coordinates["wavelength"] = waves["wavelength_i"]
    elif waves:
        coordinates["wavelength"] = waves["wavelength_r"]
        lines.append("took wavelength_r, of the reflected light, for the wavelength")
    if len(waves) == 2 and np.any(waves["wavelength_i"] != waves["wavelength_r"]):
        variables[REFLECTED] = (waves["wavelength_r"], "nm")
    states = [_polarisation(document, n) if n in data else None for n in ("polarization_i", "polarization_r")]
    if states[0] is not None or states[1] is not None:
        coordinates["polarisation"] = _joined(*states)
    if _ADHOC in data:
        for name in document.object("data", _ADHOC):
            _adhoc(document, name, coordinates, variables, lines)
    return coordinates, variables, lines


def _joined(incident: list[str] | None, reflected: list[str] | None) -> list[str]:
    """`s` for incident light in state s, `s>p` for its part that leaves in p, `>p` where only the latter is stated."""
    if reflected is None:
        return incident or []
    return [f"{i}>{r}" for i, r in zip(incident or [""] * len(reflected), reflected, strict=True)]


def _polarisation(document: Document, name: str) -> list[str]:
    """Each state as s, p or u, or as its four Stokes parameters separated by blanks."""
    values = _values(document, "data", name)
    notation = document.object("data", name).get("notation")
    states = []
    for n, value in enumerate(values):
        if notation == "sp" and value in ("s", "p", "u"):
            states.append(value)
        elif notation == "inStokes" and isinstance(value, list) and len(value) == 4:
            if any(type(v) is not float or abs(v) > 1 for v in value) or value[0] != 1:
                raise document.wrong(
                    f"a Stokes vector of {name} is not 1 and three of -1 to 1", "data", name, "values", n
                )
            states.append(_STOKES.get(tuple(value)) or " ".join(f"{v:.17g}" for v in value))
        else:
            stated = f"{name} is {clip(str(value))!r} in the notation {clip(str(notation))!r}"
            message = f"{stated}, not s, p, u or a Stokes vector"
            raise document.wrong(message, "data", name, "values", n)
    return states


def _adhoc(
    document: Document,
    name: str,
    coordinates: dict[str, Any],
    variables: dict[str, tuple[Any, str]],
    lines: list[str],
) -> None:
    """Read one adhoc variable: lists of numbers or of texts are kept, other lists are left out."""
    steps = ("data", _ADHOC, name)
    values = _values(document, *steps)
    unit = document.object(*steps).get("unit")
    text = unit if isinstance(unit, str) and unit else "1"
    if set(map(type, values)) == {str}:
        array: Any = np.array(values, dtype=str)
    elif set(map(type, values)) == {float}:
        _check_numbers(document, values, *steps)
        array = np.array(
            values, dtype=np.int8 if name == "mask" and set(values) <= {*range(len(MASK_MEANINGS))} else float
        )
    else:
        lines.append(f"left out {clip(name)}, which is neither numbers nor texts")
        return
    if name in ("brdf", "uncertainty", "theta_i", "theta_r", "phi", "phi_i", "direction", *coordinates, *variables):
        raise document.wrong(f"an adhoc variable is called {clip(name)!r}, as another variable is: rename it", *steps)
    if name in SETS:
        coordinates[name] = array
    else:
        variables[name] = (array, ABSOLUTE if text in _BRDF else text)


def _recognises(head: bytes) -> bool:
    start = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if not start.startswith(b"{") or b'"$schema"' in head:  # a JSON schema has the same names as a document
        return False
    is_named = b"brdf_json_schema" in head or b'"theta_i"' in head
    return is_named or (b'"metadata"' in head and b'"BRDF"' in head)


def _write(scan: xr.Dataset, path: Path) -> None:
    from gonio.formats.bird import document as bird_document

    bird_document.write(scan, path)


FORMAT = Format(
    name="bird",
    title="BiRD universal BRDF",
    suffix=".json",
    recognises=_recognises,
    read=_read,
    write=_write,
    holds=Holds(
        anisotropic=True,
        negative=False,
        sets=("scan", "side", "polarisation", "wavelength", "channel"),
        variables=("*",),
    ),
)
