"""What is wrong with a scan, and how to mend it."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import xarray as xr

from gonio.measured.dataset import (
    ABSOLUTE,
    ANGLES,
    DIRECTIONS,
    HORIZON,
    RELATIVE,
    SETS,
    flatten,
    in_use,
    is_in_plane,
    signed_theta_r,
)
from gonio.measured.distinct import combined, distinct_in_groups
from gonio.measured.sound import (
    IN_RANGE,
    LARGEST_SQUARED,
    SMALLEST_SQUARED,
    UNCERTAINTIES,
    beyond_arithmetic,
    is_stated,
)
from gonio.measured.stack import foreign_dims
from gonio.units import unit_label

USED = ("brdf", "uncertainty", "uncertainty_systematic", "mask")  # the variables of a scan that gonio works with
OF_READERS = ("line", "origin")  # what a reader or a resampling says of each value
BEYOND = f"outside {SMALLEST_SQUARED:g} to {LARGEST_SQUARED:g}"  # where its square overflows or vanishes
RADIANS = 1.5708  # the quarter of a circle in radians; a scan in degrees whose angles all stay below is a strange one
STEEP, NEAR = 15.0, 5.0  # deg: incidence at which the two sides are apart, and how near to a direction a lobe lies
FEW = 5  # angles from which nothing can be concluded
ALIKE = 0.75  # of two names: how alike a column's name is to one that gonio uses, before a slip is suspected


class Severity(StrEnum):
    """How much a finding matters: an error stops every fit, a warning changes what a fit means, a note informs."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong: what, where (the lines of the file or the directions), and the remedy."""

    severity: Severity
    what: str
    remedy: str
    where: str = ""

    def __str__(self) -> str:
        place = f" ({self.where})" if self.where else ""
        return f"{self.severity}: {self.what}{place}: {self.remedy}"


def check(scan: xr.Dataset) -> list[Finding]:
    """Everything that is wrong with a scan, the worst first; an empty list where nothing is."""
    if missing := [name for name in ("brdf", *ANGLES) if name not in scan.variables]:
        what = f"no {', '.join(missing)} in the Dataset"
        return [Finding(Severity.ERROR, what, "a scan needs brdf and the coordinates theta_i, theta_r and phi")]
    if lanes := foreign_dims(scan):
        what = f"scans lie side by side along {', '.join(lanes)}"
        return [Finding(Severity.NOTE, what, "gonio fit-stack fits each")]
    flat = flatten(scan)
    found = [*_units(flat), *_angles(flat), *_values(flat), *_uncertainties(flat), *_misspelt(flat)]
    found += [*_duplicates(flat, flat is not scan), *_coverage(flat), *_turned_round(flat)]
    order = list(Severity)
    return sorted(found, key=lambda finding: order.index(finding.severity))


def further(flat: xr.Dataset) -> list[str]:
    """The variables of a flat scan that gonio keeps and makes no use of, such as a temperature."""
    along = [str(n) for n, v in flat.data_vars.items() if v.dims == ("direction",)]
    return [name for name in along if name not in (*USED, *OF_READERS)]


def _misspelt(flat: xr.Dataset) -> list[Finding]:
    """Further variables whose names are nearly those that gonio uses."""
    from difflib import get_close_matches

    found = []
    for name in further(flat):
        if near := get_close_matches(name.lower(), (*USED, *DIRECTIONS, *SETS), 1, ALIKE):
            what = f"{name!r} is kept and not used, and looks like {near[0]}"
            found.append(Finding(Severity.WARNING, what, f"rename it to {near[0]} if it is that"))
    return found


def _units(scan: xr.Dataset) -> list[Finding]:
    found = []
    for name in ANGLES:
        if scan[name].attrs.get("units") != "degree":
            units = scan[name].attrs.get("units")
            found.append(Finding(Severity.ERROR, f"{name} is in {units!r}", "give degrees and units='degree'"))
    brdf_unit = scan["brdf"].attrs.get("units")
    if brdf_unit not in (ABSOLUTE, RELATIVE):
        remedy = "set units to 'sr-1', or 'a.u.' for relative data"
        found.append(Finding(Severity.ERROR, f"brdf is in {brdf_unit!r}", remedy))
    return found


def _angles(scan: xr.Dataset) -> list[Finding]:
    found = []
    for name in ("theta_i", "theta_r"):
        values = scan[name].values
        outside = ~((values >= 0) & (values <= HORIZON))
        if outside.any():
            what = f"{name} outside the hemisphere, 0 to 90 deg, at {_count(outside)}"
            found.append(Finding(Severity.ERROR, what, "mend or delete these rows", places(scan, outside)))
    polar = np.concatenate([scan[name].values for name in ("theta_i", "theta_r")])
    if polar.size > 2 * FEW and 0 < polar.max() <= RADIANS and np.unique(scan["theta_r"].values).size > FEW:
        what = f"no polar angle is above {RADIANS:g} deg"
        remedy = "if the angles are radians, name them so (theta_i_rad)"
        found.append(Finding(Severity.WARNING, what, remedy))
    return found


def _values(scan: xr.Dataset) -> list[Finding]:
    values, used = scan["brdf"].values, in_use(scan)
    found = []
    if not used.any():
        return [Finding(Severity.ERROR, "no value is in use", "every value is masked or missing: loosen the masks")]
    if not values[used].any():
        found.append(
            Finding(Severity.ERROR, "every brdf value is zero", "the detector saw nothing, or the column is wrong")
        )
    if what := beyond_arithmetic(values[used]):
        found.append(Finding(Severity.ERROR, what, IN_RANGE))
    infinite = np.isinf(values)
    if infinite.any():
        found.append(
            Finding(
                Severity.ERROR, f"brdf is infinite at {_count(infinite)}", "delete these rows", places(scan, infinite)
            )
        )
    negative = used & (values < 0)
    if negative.any():
        what = f"brdf is negative at {_count(negative)}"
        remedy = "noise about zero may stay; relative and log weighting need it masked with a floor"
        found.append(Finding(Severity.WARNING, what, remedy, places(scan, negative)))
    gaps = int(np.isnan(values).sum())
    if gaps:
        found.append(Finding(Severity.NOTE, f"{gaps} values are missing (NaN)", "they take no part in fits"))
    masked = int((~used).sum()) - gaps
    if masked > 0:
        found.append(
            Finding(Severity.NOTE, f"{masked} values are masked", "they stay in the file and take no part in fits")
        )
    return found


def _uncertainties(scan: xr.Dataset) -> list[Finding]:
    used, found = in_use(scan), []
    for name in (n for n in UNCERTAINTIES if n in scan):
        values, what = scan[name].values, name.replace("uncertainty_systematic", "systematic uncertainty")
        of_no_square = (values > 0) & np.isfinite(values) & ~is_stated(values)
        kinds = {"negative": values < 0, "infinite": np.isinf(values) & (values > 0), BEYOND: of_no_square}
        for word, wrong in kinds.items():
            if wrong.any():
                remedy = "a standard uncertainty is finite and not negative: mend or empty it; no fit takes it"
                place = places(scan, wrong)
                found.append(Finding(Severity.WARNING, f"the {what} is {word} at {_count(wrong)}", remedy, place))
    if "uncertainty" in scan:
        unknown = used & ~(np.abs(scan["uncertainty"].values) > 0)
        if unknown.any():
            what = f"no uncertainty is stated at {_count(unknown)}"
            remedy = "weighting by uncertainty needs one for every value"
            found.append(Finding(Severity.NOTE, what, remedy, places(scan, unknown)))
    if "uncertainty_systematic" in scan:
        unknown = used & np.isnan(scan["uncertainty_systematic"].values)
        if unknown.any():
            what = f"no systematic uncertainty is stated at {_count(unknown)}"
            remedy = "fits leave it out unless every value has one; 0 where there is none"
            found.append(Finding(Severity.WARNING, what, remedy, places(scan, unknown)))
    return found


def _duplicates(scan: xr.Dataset, is_grid: bool) -> list[Finding]:
    columns, sets = ([scan[n].values for n in names if n in scan.coords] for names in (DIRECTIONS, SETS))
    group = combined(sets) if sets else np.zeros(scan.sizes["direction"], dtype=np.intp)
    place = distinct_in_groups(columns, group)
    repeated = np.bincount(place)[place] > 1
    if not repeated.any():
        return []
    if is_grid:
        what = f"{_count(repeated)} stand at nodes of the grid that are one direction"
        return [Finding(Severity.NOTE, what, "they count once each in a fit", places(scan, repeated))]
    what = f"{_count(repeated)} share their geometry with another"
    remedy = "repeats count once each in a fit; average them or delete what is stale"
    return [Finding(Severity.WARNING, what, remedy, places(scan, repeated))]


def _coverage(scan: xr.Dataset) -> list[Finding]:
    incidences = scan["theta_i"].values[in_use(scan)]
    if not len(incidences) or (incidences != incidences[0]).any():
        return []
    what = f"one incidence angle only, {incidences[0]:g} deg"
    remedy = "a fit says nothing about other incidence angles; measure at two or more"
    return [Finding(Severity.WARNING, what, remedy)]


def _turned_round(scan: xr.Dataset) -> list[Finding]:
    """A lobe that lies at -theta_i at every incidence angle: the sign of theta_r may count the other way."""
    rows = np.flatnonzero(in_use(scan) & is_in_plane(scan))
    theta_i, values = scan["theta_i"].values[rows], scan["brdf"].values[rows]
    signed = signed_theta_r(scan.isel(direction=rows))
    peaks = []
    for angle in np.unique(theta_i[theta_i >= STEEP]):
        here = theta_i == angle
        if signed[here].min() <= NEAR - angle and signed[here].max() >= angle - NEAR:  # both sides were measured
            peaks.append((angle, float(signed[here][int(np.argmax(values[here]))])))
    if len(peaks) < 2 or not all(abs(peak + angle) <= NEAR for angle, peak in peaks):
        return []
    what = (
        f"the largest value lies in the backscatter direction, theta_r = -theta_i, at all {len(peaks)} incidence angles"
    )
    remedy = (
        "positive theta_r (phi 180) is the forward side here: if the file counts the other way, change the sign of "
        "theta_r (gonio import FILE --flip does); a retroreflector looks the same"
    )
    return [Finding(Severity.WARNING, what, remedy)]


def _count(where: np.ndarray) -> str:
    total = int(where.sum())
    return f"{total} value{'s' if total != 1 else ''}"


def places(scan: xr.Dataset, where: np.ndarray, most: int = 5) -> str:
    """The first places of a flat scan where something is so.

    Line numbers of the file where the reader kept them, else the directions themselves.
    """
    rows = np.flatnonzero(where)
    rest = f" and {len(rows) - most} more" if len(rows) > most else ""
    if "line" in scan.variables:
        lines = scan["line"].values[rows[:most]]
        return f"line{'s' if len(rows) > 1 else ''} {', '.join(str(int(n)) for n in lines)}{rest}"
    degree = unit_label("degree")
    angles = [[f"{scan[a].values[row]:g}" for a in ANGLES] for row in rows[:most]]
    return "; ".join(f"theta_i {i}, theta_r {r}, phi {p} {degree}" for i, r, p in angles) + rest
