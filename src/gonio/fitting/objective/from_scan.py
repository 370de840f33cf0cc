"""Options that the scan answers: a half width read from its curves, optical constants at its own wavelengths."""

import math
from typing import Any

import numpy as np
import xarray as xr

from gonio.fitting.objective.entries import group_label
from gonio.fitting.objective.options import ProblemOptions
from gonio.materials import constants
from gonio.measured.half_width import half_widths, widest_angle

HALF_WIDTH = "half-width"
CONSTANTS = ("index", "extinction")


def answered(options: ProblemOptions, scan: xr.Dataset) -> dict[str, Any]:
    """The options that change when a scan answers them, by name; none where nothing is left to its answer.

    Raises ValueError where no half width can be read, where a material's parameters are held besides, or where nothing
    says at which wavelength its constants are meant.
    """
    held = dict(options.held)
    for name in [name for name, value in held.items() if isinstance(value, str)]:
        held[name] = _half_width(name, str(held[name]), scan)
    changed: dict[str, Any] = {"held": held} if held != options.held else {}
    return changed | _with_material(options, held, scan) if options.material else changed


def _half_width(name: str, asked: str, scan: xr.Dataset) -> float:
    """Half width [deg] of the curve at the largest incidence angle, where the specular lobe is farthest."""
    if asked != HALF_WIDTH:
        raise ValueError(f"{name} is held at {asked!r}: give a number, or {HALF_WIDTH!r} to read it from the scan")
    readings = half_widths(scan)
    best = widest_angle(readings)
    if best is None:
        reasons = "; ".join(sorted({str(reading.status) for reading in readings})) or "the scan has no in-plane curve"
        raise ValueError(f"no half width can be read from the scan ({reasons}): hold {name} at a number, or fit it")
    return best.gamma


def _with_material(options: ProblemOptions, held: dict[str, Any], scan: xr.Dataset) -> dict[str, Any]:
    """Index and extinction held at the material's, one pair a wavelength of the scan, and free of declared bounds."""
    for name in CONSTANTS:
        if name in held or name in options.grouped or name in options.bounds:
            raise ValueError(f"--material holds {name}: leave it out of --hold, --group and --bound")
    out = {
        "bounds": {**options.bounds, **dict.fromkeys(CONSTANTS, (0.0, math.inf))},
        "material": "",
        "wavelength": None,
    }
    if options.wavelength is not None or "wavelength" not in scan.coords:
        return out | {"held": held | constants_at(options.material, options.wavelength)}
    each = {group_label(w): constants(options.material, w) for w in np.unique(scan["wavelength"].values).tolist()}
    if len(each) == 1:
        return out | {"held": held | next(iter(each.values()))}
    by_wavelength = {name: {w: values[name] for w, values in each.items()} for name in CONSTANTS}
    return out | {
        "held": held | by_wavelength,
        "grouped": {**options.grouped, **dict.fromkeys(CONSTANTS, ("wavelength",))},
    }


def constants_at(material: str, wavelength: float | None) -> dict[str, float]:
    """Index and extinction of a material at a wavelength [nm] that is given; none without a material."""
    if not material:
        return {}
    if wavelength is None:
        raise ValueError("--material needs --wavelength in nm here: nothing else says at which the constants are meant")
    return constants(material, wavelength)
