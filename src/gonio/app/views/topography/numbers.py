"""The numbers of a height map as plain data and for people: each with its unit, its band, and where it is uncertain."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import xarray as xr

from gonio.app.output import faint, figure, strong, table, uncertain
from gonio.topography.heights import name_of
from gonio.topography.light.agreement import Agreement
from gonio.topography.light.band import Seen
from gonio.topography.slopes import OPERATORS
from gonio.topography.statistics import UNITS
from gonio.topography.summary import Summary

MEANING = {
    "Sa": "mean distance from the mean",
    "Sq": "rms height",
    "Ssk": "skewness, 0 for Gaussian heights",
    "Sku": "kurtosis, 3 for Gaussian heights",
    "Sz": "highest minus lowest",
    "Sdq": "rms slope, both axes",
    "Sdr": "area more than flat, share",
}
WIDTHS = {
    "sigma": "torrance-sparrow sigma",
    "m": "beckmann m",
    "m_by_median": "beckmann m, by the median slope",
    "ggx_width": "ggx width, by the median slope",
    "student_width": "student-t width",
    "student_c": "student-t c",
}

PIXELS = (4, 8)  # of a period, at which it is said what an operator of slopes sees


@dataclass(frozen=True)
class Told:
    """The summary of a map, with the scan that it predicts and the fit that it is compared with, where asked for."""

    summary: Summary
    scan: xr.Dataset | None = None
    compared: Agreement | None = None

    def __iter__(self) -> Iterator[Any]:
        return lines(self)


def record(told: Told) -> dict[str, Any]:
    """Everything as plain data; lengths in um, wavelengths in nm, angles in degrees."""
    one = told.summary
    operator = one.slopes.operator
    out: dict[str, Any] = {
        "map": name_of(one.heights),
        "points": [one.heights.sizes["x"], one.heights.sizes["y"]],
        "pitch_um": list(one.pitch),
        "size_um": list(one.sides),
        "missing": one.missing,
        "outliers": one.outliers,
        "history": str(one.heights.attrs.get("history", "")).splitlines(),
        "provenance": str(one.heights.attrs.get("provenance", "")).splitlines(),
        "parameters": {
            name: {"value": value, "spread": getattr(one.spread, name), "unit": UNITS[name]}
            for name, value in one.statistics._asdict().items()
        },
        "slopes": {"operator": operator, "transfer": {n: OPERATORS[operator].transfer(n) for n in PIXELS}},
        "correlation": {"Sal_um": one.lengths.Sal, "Str": one.lengths.Str, "to_1_e_um": one.lengths.to_1_e},
        "facets": one.widths._asdict(),
        "light": _light(one.seen) if one.seen else {"reason": one.unseen},
    }
    if told.scan is not None:
        out["predicted"] = {"history": told.scan.attrs["history"].splitlines(), "values": told.scan.sizes["direction"]}
    if told.compared is not None:
        out["compared"] = {**told.compared._asdict(), "fitted": told.compared.fitted._asdict()}
    return out


def _light(seen: Seen) -> dict[str, Any]:
    return {
        "wavelength_nm": 1000 * seen.wavelength,
        "band_per_um": [seen.least, seen.most],
        "Sq_rel_um": seen.Sq_rel,
        "at": [one._asdict() for one in seen.at],
        "warnings": list(seen.warnings),
    }


def lines(told: Told) -> Iterator[Any]:
    """The same for people."""
    one = told.summary
    dx, dy = one.pitch
    steps = f"{dx:.6g} um" if math.isclose(dx, dy, rel_tol=1e-6) else f"{dx:.6g} x {dy:.6g} um"
    size = f"{one.sides[0]:.4g} x {one.sides[1]:.4g} um"
    points = f"{one.heights.sizes['x']} x {one.heights.sizes['y']} points of {steps}"
    yield strong(name_of(one.heights), f": {points}, {size}; heights over {one.range:.4g} um")
    missing = f"{100 * one.missing:.2g} % of the points are missing" if one.missing else "no point is missing"
    outliers = f"{one.outliers} points stand out of their neighbours" if one.outliers else "none stands out"
    yield f"{missing}; {outliers}{' (--mask-outliers leaves them out)' * bool(one.outliers)}"
    for line in str(one.heights.attrs.get("history", "")).splitlines():
        yield faint(f"# {line}")
    yield _parameters(one)
    name = one.slopes.operator
    yield "spread: standard deviation over the quarters of the map, each levelled by a plane"
    yield f"slopes: {name} operator, {OPERATORS[name].words}; {_passed(name, max(one.pitch))}"
    yield _lengths(one)
    yield _facets(one)
    yield from _seen(one)
    if told.scan is not None:
        yield f"predicted: {told.scan.attrs['history'].splitlines()[-2].partition(': ')[2]}"
        yield _negative(told.scan)
    if told.compared is not None:
        yield from _compared(told.compared)


def _passed(name: str, step: float) -> str:
    """How much of the slope of short waves an operator sees; `step` is the pitch [um]."""
    seen = [f"{100 * OPERATORS[name].transfer(n):.0f} % of a wave of {n * step:.3g} um" for n in PIXELS]
    return f"it sees {' and '.join(seen)}"


def _parameters(one: Summary) -> Any:
    rows = table("parameter", "meaning", "value", "unit", "spread", left=2, title="roughness, ISO 25178-2")
    for name, value in one.statistics._asdict().items():
        rows.add_row(name, MEANING[name], f"{value:.6g}", UNITS[name], figure(getattr(one.spread, name)))
    return rows


def _lengths(one: Summary) -> str:
    found = one.lengths
    parts = [f"Sal {found.Sal:.4g} um" if math.isfinite(found.Sal) else "Sal is longer than half the map"]
    if math.isfinite(found.Str):
        direction = " (the surface has a direction)" if found.Str < 0.5 else ""
        parts.append(f"Str {found.Str:.2g}{direction}")
    else:
        parts.append("Str is not known: heights stay correlated over half the map")
    parts.append(f"1/e length {found.to_1_e:.4g} um" if math.isfinite(found.to_1_e) else "no 1/e length in the map")
    return f"correlation: {', '.join(parts)}"


def _facets(one: Summary) -> Any:
    rows = table("as facets", "value", title="")
    for name, words in WIDTHS.items():
        rows.add_row(words, f"{getattr(one.widths, name):.4g}")
    return rows


def _seen(one: Summary) -> Iterator[Any]:
    if one.seen is None:
        yield f"light: {one.unseen}"
        return
    seen = one.seen
    band = f"{seen.least:.3g} to {seen.most:.4g} per um"
    yield f"light of {1000 * seen.wavelength:.6g} nm sees {band}: Sq_rel {seen.Sq_rel:.4g} um"
    rows = table("theta_i [deg]", "g", "scattered share", "r* [um]", "s_eff per axis", left=0)
    for at in seen.at:
        slope = f"{at.s_eff:.4g}" if math.isfinite(at.s_eff) else "too smooth"
        rows.add_row(f"{at.theta_i:g}", f"{at.g:.4g}", f"{at.scattered:.4g}", figure(at.distance), slope)
    yield rows
    for warning in seen.warnings:
        yield f"note: {warning}"


def _negative(scan: xr.Dataset) -> str:
    below = int((scan["brdf"].values < 0).sum())
    count = f"{scan.sizes['direction']} directions"
    return f"{count}, of which {below} are below zero, within the noise of the estimate" if below else count


def _compared(found: Agreement) -> Iterator[Any]:
    rows = table("slope per axis", "value", title=f"beside the fit of {found.model}")
    half = found.fitted.half_width
    fitted = f"{found.fitted.value:.4g} ± {figure(half)}" if math.isfinite(half) else f"{found.fitted.value:.4g}"
    rows.add_row(f"fitted, from {found.fitted.parameter} (95 %)", fitted)
    measured = (
        uncertain(found.measured, found.measured_u) if math.isfinite(found.measured_u) else figure(found.measured)
    )
    rows.add_row("of the map, Sdq/sqrt(2)", measured)
    rows.add_row("that light sees, s_eff", figure(found.effective))
    rows.add_row("of the same fit to the predicted scan", figure(found.expected))
    yield rows
    yield f"g is {found.g[1]:.3g} to {found.g[0]:.3g} at the incidence angles of the fit, {found.wavelength:g} nm"
    yield f"verdict: {found.verdict}"
