"""Writing a scan as a BiRD document that is valid by the format's JSON schema (brdf_json_schema_v1.0.json)."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.formats.bird import metadata as bird_metadata
from gonio.measured.causes import spread
from gonio.measured.dataset import DIRECTIONS, RELATIVE, SETS, flatten, unit

_POLARISED = {"s": (1.0, 1.0, 0.0, 0.0), "p": (1.0, -1.0, 0.0, 0.0), "u": (1.0, 0.0, 0.0, 0.0)}
_REFLECTED = "wavelength_r"


def write(scan: xr.Dataset, path: Path) -> None:
    """Write a scan: one list for each variable.

    Raises ValueError for relative data, and missing or negative values, which the schema does not allow.
    """
    flat = spread(flatten(scan))
    if unit(flat) == RELATIVE:
        raise ValueError("the BiRD format holds BRDF in 1/sr only: calibrate the relative data first")
    values = flat["brdf"].values.astype(float)
    if not np.isfinite(values).all() or np.any(values < 0):
        raise ValueError("the BiRD format holds no missing and no negative values: drop them first")
    document = {"metadata": bird_metadata.metadata(flat), "data": _data(flat, values)}
    with path.open("w", encoding="utf-8", newline="\n") as file:
        json.dump(document, file, ensure_ascii=False, indent=1, allow_nan=False)
        file.write("\n")


def _data(flat: xr.Dataset, values: np.ndarray) -> dict[str, Any]:
    phi_i = flat["phi_i"].values % 360.0 if "phi_i" in flat.coords else np.zeros(len(values))
    data: dict[str, Any] = {}
    if "wavelength" in flat.coords:
        data["wavelength_i"] = {"unit": "nm", "values": flat["wavelength"].values.astype(float).tolist()}
    if _REFLECTED in flat:
        data[_REFLECTED] = {"unit": "nm", "values": flat[_REFLECTED].values.astype(float).tolist()}
    if "polarisation" in flat.coords:
        data |= _polarisation(flat["polarisation"].values.astype(str).tolist())
    for name, angle in (("theta_i", flat["theta_i"].values), ("phi_i", phi_i)):
        data[name] = _angle(angle, name.startswith("theta"))
    data["theta_r"] = _angle(flat["theta_r"].values, polar=True)
    data["phi_r"] = _angle((flat["phi"].values + phi_i) % 360.0, polar=False)
    data["BRDF"] = {"unit": "sr^-1", "values": values.tolist()}
    if "uncertainty" in flat:
        stated = flat["uncertainty"].values.astype(float)
        if np.any((stated < 0) | np.isinf(stated)):
            raise ValueError("the BiRD format holds no negative and no infinite uncertainty: mend or empty them first")
        stated = np.nan_to_num(stated, nan=0.0)  # 0: none is stated
        data["uBRDF"] = {"unit": "sr^-1", "values": stated.tolist()}
    adhoc = [
        n for n in flat.variables if n not in (*DIRECTIONS, "brdf", "uncertainty", "wavelength", _REFLECTED, "line")
    ]
    adhoc = [str(n) for n in adhoc if n != "polarisation" and flat[n].dims == ("direction",)]
    if adhoc:
        data["adhoc_variables"] = {name: _adhoc(flat[name], name) for name in map(str, adhoc)}
    return data


def _angle(degrees: np.ndarray, polar: bool) -> dict[str, Any]:
    """The angles in degrees; in radians where one is 90 deg, which the schema excludes, while it allows 1.5707 rad."""
    if polar and np.any(degrees >= 90):
        return {"unit": "rad", "values": np.radians(np.minimum(degrees, 90.0)).tolist()}
    return {"unit": "°", "values": degrees.astype(float).tolist()}


def _polarisation(states: list[str]) -> dict[str, Any]:
    """The states of a scan: `s`, or `s>p` for incident and reflected light. Raises ValueError for any other word."""
    sides = [state.partition(">") for state in states]
    entries: dict[str, Any] = {}
    for name, words in (("polarization_i", [s[0] for s in sides]), ("polarization_r", [s[2] for s in sides])):
        if not any(words):
            continue
        if set(words) <= {"s", "p", "u"}:
            entries[name] = {"notation": "sp", "values": words}
            continue
        try:
            vectors = [list(_POLARISED.get(word) or map(float, word.split())) for word in words]
        except ValueError:
            vectors = []
        if not vectors or any(len(v) != 4 or v[0] != 1 or max(map(abs, v)) > 1 for v in vectors):
            raise ValueError(
                f"polarisation is {sorted(set(words))[0]!r}: the BiRD format knows s, p, u and Stokes vectors"
            )
        entries[name] = {"notation": "inStokes", "values": vectors}
    return entries


def _adhoc(variable: xr.DataArray, name: str) -> dict[str, Any]:
    is_number = variable.dtype.kind in "iufb"
    values = variable.values.astype(float) if is_number else variable.values.astype(str)
    if is_number and not np.isfinite(values).all():
        raise ValueError(f"{name} has missing values, which JSON cannot store: drop the variable or the rows")
    units = str(variable.attrs.get("units", "1"))
    about = f"{name}, one of {', '.join(SETS)}" if name in SETS else f"{name}, a variable of gonio's Dataset"
    return {"description": about, "unit": units, "type": "number" if is_number else "string", "values": values.tolist()}
