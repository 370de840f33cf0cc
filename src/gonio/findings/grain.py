"""Whether a surface that was turned about its normal has a grain: its values change from one azimuth to another."""

import numpy as np
import xarray as xr

from gonio.measured import dataset
from gonio.measured.check import Finding, Severity
from gonio.measured.distinct import combined, distinct_in_groups

CHANGE = 1.5  # largest value over least of one direction. Noise of 10 % makes it 1.4 among twelve azimuths
SHARE = 0.25  # of the directions that show so much: a grain changes the lobe, and not the diffuse part
MOST_POINTS = 2_000_000  # a table of more is not looked at, which would take seconds
REMEDY = (
    "a grain does so, as of a brushed metal: ggx-grain, beckmann-grain, student-t-grain and gonio-best-grain have "
    "two widths and its azimuth; gonio fit without --model tries them"
)


def grain(flat: xr.Dataset) -> list[Finding]:
    """A note `grain` for a flat scan, of light that was reflected, whose values change as its surface is turned."""
    change = change_by_turning(flat)
    if change < CHANGE:
        return []
    what = f"values change by a factor of {change:.3g} or more as the surface is turned, at {SHARE:.0%} of directions"
    return [Finding(Severity.NOTE, what, REMEDY, name="grain")]


def change_by_turning(flat: xr.Dataset) -> float:
    """The largest value over the least as the surface is turned, which SHARE of the directions exceed; else 1."""
    if not dataset.is_turned(flat) or flat.sizes["direction"] > MOST_POINTS:
        return 1.0
    flat = flat.isel(direction=np.flatnonzero(flat["brdf"].values > 0))
    if not dataset.is_turned(flat):
        return 1.0
    angles = [np.round(flat[name].values.astype(float), 6) for name in dataset.ANGLES]
    sets = [flat[name].values for name in dataset.sets(flat)]
    place = distinct_in_groups(angles, combined(sets) if sets else np.zeros(len(angles[0]), dtype=np.intp))
    lg = np.log10(flat["brdf"].values.astype(float))
    turns = np.round(np.mod(flat["phi_i"].values.astype(float), 360.0), 6)
    size = int(place.max()) + 1
    largest, least, first, last = (np.full(size, start) for start in (-np.inf, np.inf, np.inf, -np.inf))
    np.maximum.at(largest, place, lg)
    np.minimum.at(least, place, lg)
    np.minimum.at(first, place, turns)
    np.maximum.at(last, place, turns)
    turned = last > first  # directions that were measured at several azimuths
    return float(10 ** np.quantile((largest - least)[turned], 1 - SHARE)) if turned.any() else 1.0
