"""Sections 7 and 8: the measured values at named geometries beside those of the fit, and how uncertain they are."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.certainty.band import band
from gonio.fitting.covariance_kinds import COVARIANCES
from gonio.measured import dataset
from gonio.measured.causes import SYSTEMATIC
from gonio.measured.sound import is_stated
from gonio.reporting.blocks import Cell, Notes, Section, Table, angle, filled, number, percent
from gonio.reporting.budget import budget_blocks, effect_blocks
from gonio.reporting.case import Case
from gonio.reporting.checks import reflectance
from gonio.reporting.figures import curve_pictures, hemisphere_pictures

Values = npt.NDArray[np.float64]
NEAR = 2.5  # deg: a measured direction no farther off stands for a named geometry
MOST_ANGLES = 7  # of incidence whose specular direction is named
EXPANDED = 2.0  # k
WITHOUT_SCAN = (
    "The scan named causes of systematic uncertainty, which a fit does not hold for every reading: the budget by cause "
    "is in a report to which the scan is given (--scan)."
)


class Place(NamedTuple):
    """A named geometry: theta_i, theta_r and phi [deg]; a phi of NaN is any."""

    name: str
    theta_i: float
    theta_r: float
    phi: float


def results(case: Case) -> Section:
    """Values at named geometries, curves, the hemisphere, and reflectances."""

    def blocks() -> Iterator[object]:
        yield geometries(case)
        yield Notes("geometries-explained", _explained(case), plain=True)
        yield from curve_pictures(case)
        yield from hemisphere_pictures(case)
        yield from reflectance(case)

    return Section("results", "Results", filled(blocks()))


def geometries(case: Case) -> Table:
    """Measured f and U at 0:45, 45:0 and the specular directions, where the scan measured there or near."""
    heads = ["geometry", "θᵢ [deg]", "θᵣ [deg]", "φ [deg]", f"f [{case.unit}]", "U, k = 2", "f fitted", "U of the fit"]
    rows = []
    for words, part in case.sets.items():
        chosen = list(_chosen(part))
        there = part.isel(direction=[at for _, at in chosen])
        fitted = _fitted(case, there) if chosen and case.part_known[words] else [[Cell("–")] * 2] * len(chosen)
        for k, (name, _) in enumerate(chosen):
            one = there.isel(direction=[k])
            directions = [angle(float(one[n].values[0])) for n in dataset.ANGLES]
            rows.append(
                [
                    *(Cell(", ".join((name, words)) if words else name), *directions),
                    *(number(float(one["brdf"].values[0])), _expanded(one), *fitted[k]),
                ]
            )
    return Table("geometries", "Values at named geometries", heads, rows)


def _chosen(part: xr.Dataset) -> Iterator[tuple[str, int]]:
    """The named geometries of a set of the scan that were measured or nearly so, each with its row."""
    theta_i, theta_r, phi = (part[name].values.astype(float) for name in dataset.ANGLES)
    angles = np.unique(theta_i)
    chosen = angles[np.unique(np.linspace(0, len(angles) - 1, MOST_ANGLES).round().astype(int))]
    places = [Place("0:45", 0.0, 45.0, math.nan), Place("45:0", 45.0, 0.0, math.nan)]
    places += [Place("specular", float(one), float(one), 180.0) for one in chosen]
    for place in places:
        off = np.maximum(np.abs(theta_i - place.theta_i), np.abs(theta_r - place.theta_r))
        if not math.isnan(place.phi):
            turned = np.abs((phi - place.phi + 180.0) % 360.0 - 180.0)
            off = np.maximum(off, turned * np.sin(np.radians(theta_r)))
        at = int(np.argmin(off))
        if off[at] <= NEAR:
            yield place.name if off[at] < 0.05 else f"near {place.name}", at


def _expanded(one: xr.Dataset) -> Cell:
    """The expanded uncertainty of a measured value, of random and systematic parts together."""
    parts = [one[n].values for n in ("uncertainty", "uncertainty_systematic") if n in one]
    stated = [float(values[0]) for values in parts if is_stated(values)[0]]
    return number(EXPANDED * math.hypot(*stated), 2) if stated else Cell("not stated")


def _fitted(case: Case, there: xr.Dataset) -> list[list[Cell]]:
    """The fitted value at each direction of a flat scan with its expanded uncertainty."""
    found = band(case.solution, there)
    pairs = zip(found["brdf"].values, EXPANDED * found["uncertainty"].values, strict=True)
    return [[number(float(value)), number(float(spread), 2)] for value, spread in pairs]


def _explained(case: Case) -> list[str]:
    lines = [
        f"A geometry is named where a direction within {NEAR:g}° of it was measured; the angles are those measured."
    ]
    if len(case.all_sets) > len(case.sets):
        lines.append(f"Shown are {len(case.sets)} of {len(case.all_sets)} sets: {'; '.join(case.sets)}.")
    lines.append(
        "U is twice the standard uncertainty that the scan states, random and systematic together. U of the fit "
        "is twice the standard uncertainty of the curve by random errors; how far the model itself is off is not in it."
    )
    lines.append("Laboratories disagree most next to the specular direction, where the angular resolution matters.")
    return lines


def uncertainty(case: Case) -> Section:
    """The budget: what the scan states, by cause where it names them, what curves scatter by, what the model misses.

    Of every cause it is told what it does to the fitted values.
    """
    flat = case.flat
    heads = ["component", "kind", "typical, of f", "largest, of f", "where it comes from"]
    rows = [
        _stated(flat, "uncertainty", "random", "random errors of a reading"),
        _stated(flat, "uncertainty_systematic", "systematic", "calibration and other errors that readings share"),
    ]
    found = case.solution.answer.get("verdict", {})
    errors = (
        ("scatter", "random", "scatter of the scan's own curves", "each point against a smooth curve through others"),
        ("typical_error", "of the model", "typical error of the model", "over the points that were fitted"),
        ("left_out_error", "of the model", "error of the model where it was not fitted", "over directions left out"),
    )
    for key, kind, label, source in errors:
        if found.get(key) is not None:
            rows.append([Cell(label), Cell(kind), percent(found[key]), Cell("–"), Cell(source)])
    caption = "Uncertainty budget: standard uncertainties and errors as parts of the value"

    def blocks() -> Iterator[object]:
        yield Table("budget", caption, heads, rows, left=2)
        if SYSTEMATIC in flat:
            yield from budget_blocks(case.scan)
        elif case.solution.causes:
            yield Notes("no-causes", [WITHOUT_SCAN], plain=True)
        yield from effect_blocks(case.solution)
        yield _kinds(case)

    return Section("uncertainty", "Uncertainty", filled(blocks()))


def _stated(flat: xr.Dataset, name: str, kind: str, label: str) -> Sequence[Cell]:
    values = flat[name].values if name in flat else np.empty(0)
    positive = flat["brdf"].values > 0
    told = is_stated(values) & positive if len(values) else np.zeros(0, dtype=bool)
    if not told.any():
        return [Cell(label), Cell(kind), Cell("not stated"), Cell("not stated"), Cell("the scan")]
    parts = values[told] / flat["brdf"].values[told]
    where = f"the scan, at {int(told.sum())} of {int(positive.sum())} positive values"
    return [Cell(label), Cell(kind), percent(float(np.median(parts))), percent(float(parts.max())), Cell(where)]


def _kinds(case: Case) -> Notes:
    kind = case.solution.covariance_kind
    lines = [f"Uncertainties of the parameters are of the {kind} covariance: {COVARIANCES[kind]}."] if kind else []
    if case.solution.has_systematic:
        lines.append("Systematic errors shift all parameters together, and are stated beside the random ones.")
    else:
        lines.append("The scan states no systematic uncertainty of every value, so that none is in those of the fit.")
    lines.append(
        "Typical is the median. The error of the best of several models is a little too small, as it was chosen."
    )
    return Notes("kinds", lines, plain=True)
