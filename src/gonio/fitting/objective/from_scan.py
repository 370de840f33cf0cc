"""Options that are read from the scan: a half width from its curves, optical constants at its own wavelengths.

`held={"gamma": "half-width"}` holds the width of the directional-diffuse lobe at the half width at half maximum that
the measured curve has, as guo2023 reads it (section 2.1). `material="gold"` holds `index` and `extinction` at the
complex refractive index n + i k of the material, at every wavelength of the scan. Both end as ordinary numbers in
`held`, so a solver never sees where they came from. `weighting="auto"` becomes the weighting that the values ask for.
"""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import xarray as xr

from gonio.fitting.objective.automatic import AUTO, chosen
from gonio.fitting.objective.entries import group_label
from gonio.fitting.objective.options import ProblemOptions
from gonio.materials import constants
from gonio.measured import dataset
from gonio.measured.half_width import half_widths, widest_angle
from gonio.measured.polarimetry.degree import labelled
from gonio.measured.polarimetry.ratio import RatioModel, ratio_model
from gonio.measured.polarisers import unpolarised
from gonio.measured.sound import IN_RANGE, beyond_arithmetic, is_stated
from gonio.measured.stack import foreign_dims
from gonio.model import Model
from gonio.units import UNITS

HALF_WIDTH = "half-width"
CONSTANTS = ("index", "extinction")
MOST_INDEX, MOST_EXTINCTION = 10.0, 20.0  # as the models declare
WAVELENGTH = "wavelength"  # the shape parameter of a model that is held at the scan's own coordinate


def answered(options: ProblemOptions, scan: xr.Dataset) -> dict[str, Any]:
    """The options that change when they are read from a scan, by name, as `replace` takes them; empty if none does.

    Of the options that result nothing is left to read: `compare` reads them once for all models, and each Problem
    that it makes then reads nothing again.
    Raises ValueError where no half width can be read, where a material's parameters are held besides, or where nothing
    says at which wavelength its constants are meant.
    """
    held = dict(options.held)
    for name in [name for name, value in held.items() if isinstance(value, str)]:
        held[name] = _half_width(name, str(held[name]), scan)
    changed: dict[str, Any] = {"held": held} if held != options.held else {}
    if options.weighting == AUTO:
        changed |= _weighting(options, scan)
    if options.dielectric or options.metal:
        changed |= _of_kind(options, held)
    return changed | _with_material(options, held, scan) if options.material else changed


def seen(options: ProblemOptions, model: Model, scan: xr.Dataset) -> dict[str, Any]:
    """What a fit of a model to a scan takes of its light, by the names of a Problem; empty where that is all of it.

    A model without polarisation gets the readings of unpolarised light. Of degrees of polarisation a model is seen as a
    RatioModel, and the weight that all others are ratios to is held at 1.
    Raises ValueError for degrees of polarisation of a model that knows none, or of many scans.
    """
    if not dataset.is_degree(scan):
        return {} if model.polarised or foreign_dims(scan) else {"data": unpolarised(scan)}
    if foreign_dims(scan):
        raise ValueError("degrees of polarisation are fitted one scan at a time: choose one, and fit it by gonio.fit")
    ratio = model if isinstance(model, RatioModel) else ratio_model(model)
    for word, names in (("grouped", options.grouped), ("smooth", options.smooth), ("free", options.bounds)):
        if ratio.scale in names:
            raise ValueError(
                f"{ratio.scale} cannot be {word}: a degree of polarisation has no scale, and the other weights are "
                f"ratios to it, so it is held at 1"
            )
    if options.held.get(ratio.scale, 1.0) == 0:
        raise ValueError(f"{ratio.scale} is held at 0: then no light is polarised; hold it at 1, or leave it out")
    return {"model": ratio, "data": labelled(scan), "held": {ratio.scale: 1.0} | dict(options.held)}


def refuse_no_scan(scan: xr.Dataset) -> None:
    """ValueError for data that no model can be fitted to."""
    if lanes := foreign_dims(scan):
        along = ", ".join(lanes)
        raise ValueError(f"scans lie side by side along {along}: choose one, or fit each by fit_many (fit-stack)")
    points = dataset.points(scan)
    if points.sizes["direction"] == 0:
        raise ValueError("the scan holds no value in use: every one is masked or missing")
    if "mode" in points.coords and (points["mode"].values == "transmission").any():
        both = (points["mode"].values == "reflection").any()
        what = "has transmission: add --select mode=reflection" if both else "is of transmission alone"
        raise ValueError(f"models describe reflection, but the scan {what}")
    measured = points["brdf"].values.astype(float)
    if not measured.any():
        raise ValueError("every brdf value of the scan is zero: there is nothing to fit")
    if what := beyond_arithmetic(measured):
        raise ValueError(f"{what}: {IN_RANGE}")


def _weighting(options: ProblemOptions, scan: xr.Dataset) -> dict[str, Any]:
    """The weighting that the values in use ask for, with a noise floor where one is given.

    Without a value there is nothing to choose from; a Problem then says so itself.
    """
    if foreign_dims(scan):  # many scans, which a Problem refuses
        return {"weighting": "uniform"}
    points = dataset.points(scan)
    if options.noise_floor:
        return {"weighting": "relative", "weighting_reason": given_floor(options.noise_floor)}
    if not points.sizes["direction"]:
        return {"weighting": "uniform"}
    if dataset.is_degree(scan):
        return _of_degrees(points)
    choice = chosen(points)
    return {
        "weighting": choice.weighting,
        "noise_floor": choice.noise_floor,
        "weighting_reason": choice.reason,
    }


def _of_degrees(points: xr.Dataset) -> dict[str, Any]:
    """Errors of a degree of polarisation are absolute: one near zero is as sure as others, and may be negative."""
    if "uncertainty" in points and is_stated(points["uncertainty"].values).all():
        return {"weighting": "uncertainty", "weighting_reason": "the scan states an uncertainty for each degree"}
    return {"weighting": "uniform", "weighting_reason": "a degree of polarisation errs alike near zero and one"}


def given_floor(noise_floor: float) -> str:
    """Why a weighting that is to be chosen is relative where a noise floor is given."""
    return f"a noise floor of {noise_floor:g} is given"


def _half_width(name: str, text: str, scan: xr.Dataset) -> float:
    """Half width [deg] of the curve at the largest incidence angle, where the specular lobe is farthest.

    Raises ValueError, with the reason of every curve, where it can be read from none.
    """
    if text != HALF_WIDTH:
        raise ValueError(f"{name} is held at {text!r}: give a number, or {HALF_WIDTH!r} to read it from the scan")
    readings = half_widths(scan)
    widest = widest_angle(readings)
    if widest is None:
        reasons = "; ".join(sorted({str(reading.status) for reading in readings})) or "the scan has no in-plane curve"
        raise ValueError(f"no half width can be read from the scan ({reasons}): hold {name} at a number, or fit it")
    return widest.gamma


def _of_kind(options: ProblemOptions, held: dict[str, Any]) -> dict[str, Any]:
    """The options with the constants of a dielectric or a metal kept within what such a material has.

    A bound or a held value that is given stays. Raises ValueError for both kinds, and for one beside a material.
    """
    if options.dielectric and options.metal:
        raise ValueError("--dielectric and --metal exclude each other: give one, or neither")
    if options.material:
        raise ValueError("--material holds index and extinction already: leave out --dielectric and --metal")
    name, limits = ("index", (1.0, MOST_INDEX)) if options.dielectric else ("extinction", (1.0, MOST_EXTINCTION))
    bounds = options.bounds if name in held or name in options.bounds else {**options.bounds, name: limits}
    settled = {"dielectric": False, "metal": False, "bounds": bounds}
    is_free = options.dielectric and not any("extinction" in given for given in (held, options.bounds, options.grouped))
    return settled | ({"held": held | {"extinction": 0.0}} if is_free else {})


def _with_material(options: ProblemOptions, held: dict[str, Any], scan: xr.Dataset) -> dict[str, Any]:
    """The options with index and extinction held at the material's, one pair for each wavelength of the scan.

    A wavelength among the options takes precedence over the scan's own.
    """
    for name in CONSTANTS:
        if name in held or name in options.grouped or name in options.bounds:
            raise ValueError(f"--material holds {name}: leave it out of --hold, --group and --bound")
    out = {
        # a held value must lie in its bounds, and metals in the infrared exceed the extinction that models declare
        "bounds": {**options.bounds, **dict.fromkeys(CONSTANTS, (0.0, math.inf))},
        "material": "",  # read: a second call changes nothing
        "wavelength": None,
    }
    if options.wavelength is not None or "wavelength" not in scan.coords:
        return out | {"held": held | constants_at(options.material, options.wavelength)}
    by_label = {group_label(w): constants(options.material, w) for w in np.unique(scan["wavelength"].values).tolist()}
    if len(by_label) == 1:
        return out | {"held": held | next(iter(by_label.values()))}
    by_wavelength = {name: {label: pair[name] for label, pair in by_label.items()} for name in CONSTANTS}
    return out | {
        "held": held | by_wavelength,
        "grouped": {**options.grouped, **dict.fromkeys(CONSTANTS, ("wavelength",))},
    }


def freeing(model: Model, names: Iterable[str]) -> dict[str, tuple[float, float]]:
    """The bounds of those parameters that a fit holds until an option names them: with them they are free."""
    shape = model.shape
    return {name: (shape[name].lower, shape[name].upper) for name in names if name in shape and shape[name].held}


def kept(options: ProblemOptions, model: Model, name: str, points: xr.Dataset) -> float | dict[str, float] | None:
    """At what a parameter is held where no option names it; None for one that is free.

    That is the scan's wavelength in the unit of the model's parameter, by label where there are several, and the
    default of a parameter that the model declares as held.
    """
    has_option = any(name in names for names in (options.held, options.grouped, options.bounds, options.smooth))
    if has_option or name not in model.shape:
        return None
    if name == WAVELENGTH and WAVELENGTH in points.coords:
        size = UNITS[model.shape[WAVELENGTH].unit].size
        values = {group_label(w): float(w) / size for w in np.unique(points[WAVELENGTH].values)}
        return values if len(values) > 1 else next(iter(values.values()))
    return model.shape[name].default if model.shape[name].held else None


def constants_at(material: str, wavelength: float | None) -> dict[str, float]:
    """`index` and `extinction` of a material at a wavelength [nm], by name; empty without a material.

    Raises ValueError for a material without a wavelength, and as `gonio.materials.constants` does.
    """
    if not material:
        return {}
    if wavelength is None:
        raise ValueError("--material needs --wavelength in nm: nothing else states the wavelength of its constants")
    return constants(material, wavelength)
