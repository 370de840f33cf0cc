"""A fitted facet slope beside the slope of the surface: do they agree, and should they?

A facet model is right for surfaces much rougher than the wavelength. Below a phase variance g of about 50 the width of
a lobe is no slope of the surface, whatever the fit says: what the map predicts for the same fit is the number to
compare with.
"""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple, get_args

import numpy as np
import xarray as xr

from gonio.fitting import fit
from gonio.fitting.objective.problem import Problem
from gonio.fitting.solution import Solution
from gonio.measured.masking import mask
from gonio.model import Model, Parameter
from gonio.optics.facets import Slope, TotalSlope, Width
from gonio.topography.correlation import effective_slope, structure
from gonio.topography.levelling import level
from gonio.topography.light.band import phase_variance
from gonio.topography.light.prediction import Light, predict_like
from gonio.topography.slopes import AUTO, slopes
from gonio.topography.subareas import spread

ROUGH = 50.0  # g above which a fit of Gaussian facets finds the slope of the surface
CLOSE = 0.03  # relative: how well it does there
# Declarations of slopes by which models take them, the factor to a slope per axis, and whether that is an rms slope:
# the slopes of GGX have no rms, so that its width is another number.
DECLARED: tuple[tuple[Any, float, bool], ...] = (
    (get_args(Slope)[1], 1.0, True),
    (get_args(TotalSlope)[1], math.sqrt(0.5), True),
    (get_args(Width)[1], math.sqrt(0.5), False),
)
BY_NAME: Mapping[tuple[str, str], tuple[float, bool]] = {("gonio-best", "m"): (math.sqrt(0.5), True)}


class FittedSlope(NamedTuple):
    """The slope in a fit: the parameter, the value per axis, its 95 % half-width, and whether it is an rms slope."""

    parameter: str
    value: float
    half_width: float
    is_rms: bool


class Agreement(NamedTuple):
    """A fitted slope beside that of a map, all per axis; uncertainties are standard ones over sub-areas.

    fitted: as `fitted_slope` finds it. g: phase variance of the map's rms height at the least and the largest incidence
    angle of the fit. measured: Sdq/sqrt(2). effective: s_eff, the mean over incidence angles, NaN where one of them is
    too smooth. expected: what a fit of the same model to the scan that the map predicts finds, NaN where that cannot be
    fitted, and `why` in words. should_agree: whether the fitted slope should be the measured one. agrees: whether it
    is, or is the expected one where it should not; None where there is nothing to compare with.
    """

    model: str
    fitted: FittedSlope
    wavelength: float
    g: tuple[float, float]
    measured: float
    measured_u: float
    effective: float
    expected: float
    should_agree: bool
    agrees: bool | None
    verdict: str
    why: str = ""


def slope_parameter(model: Model) -> tuple[str, float, bool]:
    """The parameter of a model that is a slope of facets, its factor to one per axis, and whether that is an rms slope.

    Raises ValueError for a model without one.
    """
    for name, declaration in model.shape.items():
        if (model.name, name) in BY_NAME:
            return (name, *BY_NAME[model.name, name])
        for known, factor, is_rms in DECLARED:
            if isinstance(known, Parameter) and declaration == known:
                return name, factor, is_rms
    raise ValueError(
        f"{model.name} has no slope of facets to compare with a map: fit torrance-sparrow, beckmann or ggx, for example"
    )


def fitted_slope(solution: Solution) -> FittedSlope:
    """The slope of facets in a fit, the mean over groups where it was fitted for several. ValueError as above."""
    name, factor, is_rms = slope_parameter(solution.model)
    rows = np.flatnonzero(solution.dataset["name"].values == name)
    value = float(np.mean(solution.dataset["value"].values[rows]))
    return FittedSlope(name, factor * value, factor * float(np.mean(solution.half_widths()[rows])), is_rms)


def agreement(heights: xr.Dataset, solution: Solution, light: Light | None = None, operator: str = AUTO) -> Agreement:
    """Compare the slope of facets that a fit found with that of the surface.

    Parameters
    ----------
    heights : xarray.Dataset
        The levelled map.
    solution : Solution
        A fit of a model with a slope of facets.
    light : Light, optional
        The light of the fitted scan, where that does not name one wavelength.
    operator : str
        That of the map's slope.

    Returns
    -------
    Agreement
        The numbers, and a verdict in words.

    Raises
    ------
    ValueError
        The model has no slope of facets, the solution holds no scan, or nothing says the wavelength.

    """
    fitted, scan = fitted_slope(solution), solution.scan
    light = light or Light(wavelength=_wavelength(scan))
    surface, angles = structure(heights), np.unique(np.round(scan["theta_i"].values, 6))
    g = [phase_variance(surface.rms, float(angle), light.micrometres) for angle in angles]
    measured = slopes(heights, operator).rms / math.sqrt(2)
    deviation = spread(heights, lambda part: slopes(level(part), operator).rms / math.sqrt(2))
    effective = float(np.mean([effective_slope(surface, float(a), light.micrometres)[1] for a in angles]))
    expected, why = _expected(heights, solution, light, fitted.parameter)
    found = Agreement(
        model=solution.model.name,
        fitted=fitted,
        wavelength=light.wavelength,
        g=(max(g), min(g)),
        measured=measured,
        measured_u=math.nan if deviation is None else float(deviation),
        effective=effective,
        expected=expected,
        should_agree=min(g) > ROUGH and fitted.is_rms,
        agrees=None,
        verdict="",
        why=why,
    )
    agrees = _agrees(found)
    return found._replace(agrees=agrees, verdict=_verdict(found, agrees))


def _wavelength(scan: xr.Dataset) -> float:
    """The one wavelength [nm] of a scan."""
    found = np.unique(scan["wavelength"].values) if "wavelength" in scan.coords else np.array([])
    if found.size != 1 or not found[0] > 0:
        said = "no wavelength" if not found.size else f"{found.size} wavelengths"
        raise ValueError(f"the fitted scan has {said}, and one is compared with a map: name it (--wavelength NM)")
    return float(found[0])


def _expected(heights: xr.Dataset, solution: Solution, light: Light, parameter: str) -> tuple[float, str]:
    """The slope per axis that the fit finds in the scan that the map predicts; NaN with the reason where it cannot."""
    held = {name: entry["value"] for name, entry in solution.parameters().items() if entry.get("held")}
    weighting = str(solution.dataset.attrs["weighting"])
    try:
        predicted = predict_like(heights, solution.scan, light)
        if weighting == "log":  # which takes no value below zero, and the estimate of a weak lobe may be one
            predicted = mask(predicted, floor=0.0)
        again = fit(Problem(solution.model, predicted, held=held, weighting=weighting))
    except ValueError as error:
        return math.nan, f"the scan that the map predicts cannot be fitted: {error}"
    at_bound = again.dataset["at_bound"].values & (again.dataset["name"].values == parameter)
    if at_bound.any():
        return math.nan, f"a fit to the scan that the map predicts ends on a bound of {parameter}"
    return fitted_slope(again).value, ""


def _agrees(found: Agreement) -> bool | None:
    """Whether the fit is what it should be, within its interval, that of the map, and the error of the theory."""
    reference = found.measured if found.should_agree else found.expected
    if not math.isfinite(reference):
        return None
    of_map = 2 * found.measured_u / found.measured * reference if math.isfinite(found.measured_u) else 0.0
    of_fit = found.fitted.half_width if math.isfinite(found.fitted.half_width) else 0.0
    return abs(found.fitted.value - reference) <= math.hypot(of_fit, of_map, CLOSE * reference)


def _verdict(found: Agreement, agrees: bool | None) -> str:
    """The comparison in one sentence or two."""
    slope = f"the fit has a slope of {found.fitted.value:.4g} per axis and the surface {found.measured:.4g}"
    word = {True: "and it does", False: "and it does not", None: "and there is nothing to compare with"}[agrees]
    if found.should_agree:
        return f"{slope}: at a phase variance above {ROUGH:g} the fit should find the slope of the surface, {word}"
    why = "g is below 50, where the width of a lobe is no slope" if found.fitted.is_rms else "its slopes have no rms"
    if min(found.g) > ROUGH:
        why = "its slopes have no rms"
    said = f"{slope}: they need not agree ({why})"
    if agrees is None:
        return f"{said}; {found.why}" if found.why else said
    should = f"a fit of {found.model} to the scan that this map predicts finds {found.expected:.4g}"
    return f"{said}; {should}, and so the fit {'agrees' if agrees else 'disagrees'} with the map"
