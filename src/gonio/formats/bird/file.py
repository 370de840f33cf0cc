"""The BiRD project's universal BRDF format: JSON, a list of values for each variable (EMPIR 16NRM08, schema v1.0).

Both directions are given by angle and azimuth about the normal, as Nicodemus defines the BRDF, so phi = phi_r - phi_i
and the forward side is at 180 deg. `uBRDF` is the uncertainty, absolute or in percent of the BRDF.
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
from gonio.measured.dataset import ABSOLUTE, SETS, add_history, make_scan

_ANGLES = {"theta_i": 90.0, "phi_i": 360.0, "theta_r": 90.0, "phi_r": 360.0}
_DEGREES = {"°": 1.0, "deg": 1.0, "rad": 180.0 / math.pi}
_NANOMETRES = {"nm": 1.0, "μm": 1e3, "µm": 1e3}
_BRDF = {"1/sr": 1.0, "sr^-1": 1.0}
_PERCENT = "%"
_STOKES = {(1.0, 1.0, 0.0, 0.0): "s", (1.0, -1.0, 0.0, 0.0): "p", (1.0, 0.0, 0.0, 0.0): "u"}
_KNOWN = {*_ANGLES, "BRDF", "uBRDF", "wavelength_i", "wavelength_r", "polarization_i", "polarization_r"}
_ADHOC = "adhoc_variables"
REFLECTED = "wavelength_r"  # variable: the wavelength of the reflected light where it is not that of the incident light
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
    scan.attrs |= bird_metadata.attributes(document)
    left_out = [f"left out {name}, which the format does not know" for name in data if name not in {*_KNOWN, _ADHOC}]
    for line in (*remarks, *more, *left_out):
        scan = add_history(scan, line)
    return scan


def _values(document: Document, *steps: str) -> list[Any]:
    """The list at the names, as long as the BRDF's; FormatError with the line."""
    brdf = document.object("data", "BRDF").get("values")
    values = document.object(*steps).get("values")
    if not isinstance(values, list):
        raise document.wrong(f"{clip(steps[-1])} has no list of values", *steps, "values")
    if not values:
        raise document.wrong(f"{clip(steps[-1])} has an empty list of values", *steps, "values")
    if isinstance(brdf, list) and len(values) != len(brdf):
        what = f"{clip(steps[-1])} has {len(values)} values, and the BRDF {len(brdf)}"
        raise document.wrong(what, *steps, "values")
    return values


def _numbers(document: Document, units: dict[str, float], *steps: str) -> Array:
    """The finite numbers of a variable in the unit here; FormatError with the line of the first that is none."""
    values = _values(document, *steps)
    unit = document.object(*steps).get("unit")
    if not isinstance(unit, str) or unit not in units:
        what = f"{clip(steps[-1])} has the unit {clip(str(unit))!r}, not {' or '.join(units)}"
        raise document.wrong(what, *steps, "unit")
    _check_numbers(document, values, *steps)
    found = np.array(values, dtype=float)
    return found if units[unit] == 1.0 else _product(document, found, units[unit], *steps)


def _product(document: Document, values: Array, scale: float | Array, *steps: str) -> Array:
    """Values in another unit; FormatError where that goes beyond every number."""
    with np.errstate(over="ignore"):
        found = values * scale
    if not np.isfinite(found).all():
        raise document.wrong(
            f"a value of {clip(steps[-1])} is too large", *steps, "values", int(np.isinf(found).argmax())
        )
    return found


def _check_numbers(document: Document, values: list[Any], *steps: str) -> None:
    if set(map(type, values)) == {float} and np.isfinite(values).all():
        return
    bad = next(n for n, v in enumerate(values) if type(v) is not float or not math.isfinite(v))
    text = clip(str(values[bad]))
    raise document.wrong(f"a value of {clip(steps[-1])} is {text}, not a finite number", *steps, "values", bad)


def _angle(document: Document, name: str) -> Array:
    found = _numbers(document, _DEGREES, "data", name)
    most = _ANGLES[name] + (1e-9 if name.startswith("theta") else 0.0)
    outside = np.flatnonzero((found < 0) | (found > most))
    if len(outside):
        what = f"{name} is {found[outside[0]]:g} deg, outside 0 to {_ANGLES[name]:g}"
        raise document.wrong(what, "data", name, "values", int(outside[0]))
    return np.minimum(found, _ANGLES[name])


def _uncertainty(document: Document, brdf: Array) -> tuple[Array | None, list[str]]:
    """The uncertainty of every value [1/sr] where the file states one, and what was done to it."""
    data = document.object("data")
    constant = data["BRDF"].get("uncertainty")
    steps: tuple[str, ...]
    if "uBRDF" in data:
        units = {**_BRDF, _PERCENT: 1.0}
        found, steps = _numbers(document, units, "data", "uBRDF"), ("data", "uBRDF")
        lines = ["took uBRDF and left out the constant uncertainty"] if constant is not None else []
    elif constant is not None:
        steps = ("data", "BRDF", "uncertainty")
        value = document.object(*steps).get("value")
        if type(value) is not float or not math.isfinite(value):
            raise document.wrong("the uncertainty of the BRDF has no finite value", *steps, "value")
        found, lines = np.full(len(brdf), value), ["took the constant uncertainty for every value"]
    else:
        return None, []
    if np.any(found < 0):
        bad = int(np.argmax(found < 0))
        place = (*steps, "values", bad) if steps[-1] == "uBRDF" else (*steps, "value")
        raise document.wrong(f"an uncertainty is {found[bad]:g}", *place)
    unit = document.object(*steps).get("unit")
    if unit == _PERCENT:
        return _product(document, found / 100, np.abs(brdf), *steps), [
            *lines,
            "took the uncertainty from percent of the BRDF",
        ]
    if unit not in _BRDF:
        raise document.wrong(f"the uncertainty has the unit {clip(str(unit))!r}", *steps, "unit")
    return found, lines


def _others(document: Document) -> tuple[dict[str, Any], dict[str, tuple[Any, str]], list[str]]:
    """Coordinates of sets, further variables with units, and what was left out."""
    data = document.object("data")
    coordinates: dict[str, Any] = {}
    variables: dict[str, tuple[Any, str]] = {}
    lines: list[str] = []
    named = [n for n in ("wavelength_i", "wavelength_r") if n in data]
    waves = {n: _numbers(document, _NANOMETRES, "data", n) for n in named}
    for wave, found in waves.items():
        if np.any(found <= 0):
            bad = int(np.argmax(found <= 0))
            raise document.wrong(f"{wave} is {found[bad]:g}", "data", wave, "values", bad)
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
    """`s` for light that comes in s, `s>p` for what of it leaves in p, `>p` where only that is known."""
    if reflected is None:
        return incident or []
    return [f"{i}>{r}" for i, r in zip(incident or [""] * len(reflected), reflected, strict=True)]


def _polarisation(document: Document, name: str) -> list[str]:
    """s, p, u, or the four Stokes parameters with blanks between."""
    values = _values(document, "data", name)
    notation = document.object("data", name).get("notation")
    found = []
    for n, value in enumerate(values):
        if notation == "sp" and value in ("s", "p", "u"):
            found.append(value)
        elif notation == "inStokes" and isinstance(value, list) and len(value) == 4:
            if any(type(v) is not float or abs(v) > 1 for v in value) or value[0] != 1:
                raise document.wrong(
                    f"a Stokes vector of {name} is not 1 and three of -1 to 1", "data", name, "values", n
                )
            found.append(_STOKES.get(tuple(value)) or " ".join(f"{v:.17g}" for v in value))
        else:
            said = f"{name} is {clip(str(value))!r} in the notation {clip(str(notation))!r}"
            what = f"{said}, not s, p, u or a Stokes vector"
            raise document.wrong(what, "data", name, "values", n)
    return found


def _adhoc(
    document: Document,
    name: str,
    coordinates: dict[str, Any],
    variables: dict[str, tuple[Any, str]],
    lines: list[str],
) -> None:
    """One variable of the file's own: numbers and texts are kept, arrays of arrays are left out."""
    steps = ("data", _ADHOC, name)
    values = _values(document, *steps)
    unit = document.object(*steps).get("unit")
    text = unit if isinstance(unit, str) and unit else "1"
    if set(map(type, values)) == {str}:
        found: Any = np.array(values, dtype=str)
    elif set(map(type, values)) == {float}:
        _check_numbers(document, values, *steps)
        found = np.array(values, dtype=np.int8 if name == "mask" and set(values) <= {0.0, 1.0, 2.0, 3.0} else float)
    else:
        lines.append(f"left out {clip(name)}, which is neither numbers nor texts")
        return
    if name in ("brdf", "uncertainty", "theta_i", "theta_r", "phi", "phi_i", "direction", *coordinates, *variables):
        raise document.wrong(f"a variable of the file's own is called {clip(name)!r}, as another is: rename it", *steps)
    if name in SETS:
        coordinates[name] = found
    else:
        variables[name] = (found, ABSOLUTE if text in _BRDF else text)


def _recognises(head: bytes) -> bool:
    start = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if not start.startswith(b"{") or b'"$schema"' in head:  # a schema names what a document has
        return False
    named = b"brdf_json_schema" in head or b'"theta_i"' in head
    return named or (b'"metadata"' in head and b'"BRDF"' in head)


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
