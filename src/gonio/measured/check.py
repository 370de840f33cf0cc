"""What is wrong with a scan, and how to mend it."""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np
import xarray as xr

from gonio.measured.causes import SYSTEMATIC, fault
from gonio.measured.dataset import (
    ANGLES,
    DIRECTIONS,
    HORIZON,
    SETS,
    UNITS,
    flatten,
    in_use,
    is_degree,
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
MOST_DEGREE = 2.0  # of a degree of polarisation, which is 1 at most: more is no noise
ALIKE = 0.75  # of two names: how alike a column's name is to one that gonio uses, before a slip is suspected


class Severity(StrEnum):
    """How much a finding matters: an error stops every fit, a warning changes what a fit means, a note informs."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


@dataclass(frozen=True)
class Finding:
    """One thing that is wrong: what, where (the lines of the file or the directions), and the remedy.

    name: the same for every scan that has this fault; programs may rely on it.
    """

    severity: Severity
    what: str
    remedy: str
    where: str = ""
    name: str = ""

    def __str__(self) -> str:
        place = f" ({self.where})" if self.where else ""
        return f"{self.severity}: {self.what}{place}: {self.remedy}"


def check(scan: xr.Dataset) -> list[Finding]:
    """What no scan may be or should be, the worst first; an empty list where nothing is wrong.

    `gonio.check` finds the mistakes of measurements as well (`gonio.findings`).
    """
    if missing := [name for name in ("brdf", *ANGLES) if name not in scan.variables]:
        what = f"no {', '.join(missing)} in the Dataset"
        remedy = "a scan needs brdf and the coordinates theta_i, theta_r and phi"
        return [Finding(Severity.ERROR, what, remedy, name="no-directions")]
    if lanes := foreign_dims(scan):
        what = f"scans lie side by side along {', '.join(lanes)}"
        return [Finding(Severity.NOTE, what, "gonio fit-stack fits each", name="stack")]
    flat = flatten(scan)
    found = [*_units(flat), *_angles(flat), *_values(flat), *_uncertainties(flat), *_misspelt(flat)]
    return worst_first([*found, *_duplicates(flat, flat is not scan), *_coverage(flat)])


def worst_first(found: list[Finding]) -> list[Finding]:
    """Errors, then warnings, then notes, each in the order found."""
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
            found.append(Finding(Severity.WARNING, what, f"rename it to {near[0]} if it is that", name="misspelt"))
    return found


def _units(scan: xr.Dataset) -> list[Finding]:
    found = []
    for name in ANGLES:
        if scan[name].attrs.get("units") != "degree":
            units = scan[name].attrs.get("units")
            remedy = "give degrees and units='degree'"
            found.append(Finding(Severity.ERROR, f"{name} is in {units!r}", remedy, name="unit"))
    brdf_unit = scan["brdf"].attrs.get("units")
    if brdf_unit not in UNITS:
        remedy = "set units to 'sr-1', or 'a.u.' for relative data"
        found.append(Finding(Severity.ERROR, f"brdf is in {brdf_unit!r}", remedy, name="unit"))
    return found


def _angles(scan: xr.Dataset) -> list[Finding]:
    found = []
    for name in ("theta_i", "theta_r"):
        values = scan[name].values
        outside = ~((values >= 0) & (values <= HORIZON))
        if outside.any():
            what = f"{name} outside the hemisphere, 0 to 90 deg, at {_count(outside)}"
            remedy = "mend or delete these rows"
            found.append(Finding(Severity.ERROR, what, remedy, places(scan, outside), "outside-hemisphere"))
    return found


def _values(scan: xr.Dataset) -> list[Finding]:
    values, used = scan["brdf"].values, in_use(scan)
    found = []
    if not used.any():
        remedy = "every value is masked or missing: loosen the masks"
        return [Finding(Severity.ERROR, "no value is in use", remedy, name="no-value")]
    if not values[used].any():
        remedy = "the detector saw nothing, or the column is wrong"
        found.append(Finding(Severity.ERROR, "every brdf value is zero", remedy, name="all-zero"))
    if what := beyond_arithmetic(values[used]):
        found.append(Finding(Severity.ERROR, what, IN_RANGE, name="beyond-arithmetic"))
    infinite = np.isinf(values)
    if infinite.any():
        what = f"brdf is infinite at {_count(infinite)}"
        found.append(Finding(Severity.ERROR, what, "delete these rows", places(scan, infinite), "infinite"))
    negative = used & (values < 0)
    if is_degree(scan):
        found += _degrees(scan, used)
    elif negative.any():
        what = f"brdf is negative at {_count(negative)}"
        remedy = "noise about zero may stay; relative and log weighting need it masked with a floor"
        found.append(Finding(Severity.WARNING, what, remedy, places(scan, negative), "negative"))
    gaps = int(np.isnan(values).sum())
    if gaps:
        what = f"{gaps} values are missing (NaN)"
        found.append(Finding(Severity.NOTE, what, "they take no part in fits", name="missing"))
    masked = int((~used).sum()) - gaps
    if masked > 0:
        remedy = "they stay in the file and take no part in fits"
        found.append(Finding(Severity.NOTE, f"{masked} values are masked", remedy, name="masked"))
    return found


def _degrees(scan: xr.Dataset, used: np.ndarray) -> list[Finding]:
    """A share of light is no more than all of it."""
    beyond = used & (np.abs(scan["brdf"].values) > 1)
    if not beyond.any():
        return []
    what, where = f"the degree of polarisation is above 1 at {_count(beyond)}", places(scan, beyond)
    if np.abs(scan["brdf"].values[used]).max() > MOST_DEGREE:
        remedy = "in percent, call the column 'DoLP [%]', or add --divide 100"
        return [Finding(Severity.ERROR, what, remedy, where, "degree-above-one")]
    return [Finding(Severity.WARNING, what, "noise may do this where there is little light", where, "degree-above-one")]


def _uncertainties(scan: xr.Dataset) -> list[Finding]:
    used, found = in_use(scan), []
    if wrong := fault(scan):
        remedy = "make both anew by gonio.measured.causes.with_causes"
        found.append(Finding(Severity.ERROR, f"{SYSTEMATIC} by cause {wrong}", remedy, name="causes"))
    for name in (n for n in UNCERTAINTIES if n in scan):
        values, what = scan[name].values, name.replace("uncertainty_systematic", "systematic uncertainty")
        of_no_square = (values > 0) & np.isfinite(values) & ~is_stated(values)
        kinds = {"negative": values < 0, "infinite": np.isinf(values) & (values > 0), BEYOND: of_no_square}
        for word, wrong in kinds.items():
            if wrong.any():
                remedy = "a standard uncertainty is finite and not negative: mend or empty it; no fit takes it"
                place = places(scan, wrong)
                said = f"the {what} is {word} at {_count(wrong)}"
                found.append(Finding(Severity.WARNING, said, remedy, place, "impossible-uncertainty"))
    if "uncertainty" in scan:
        unknown = used & ~(np.abs(scan["uncertainty"].values) > 0)
        if unknown.any():
            what = f"no uncertainty is stated at {_count(unknown)}"
            remedy = "weighting by uncertainty needs one for every value"
            found.append(Finding(Severity.NOTE, what, remedy, places(scan, unknown), "no-uncertainty"))
    if "uncertainty_systematic" in scan:
        unknown = used & np.isnan(scan["uncertainty_systematic"].values)
        if unknown.any():
            what = f"no systematic uncertainty is stated at {_count(unknown)}"
            remedy = "fits leave it out unless every value has one; 0 where there is none"
            found.append(Finding(Severity.WARNING, what, remedy, places(scan, unknown), "no-systematic-uncertainty"))
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
        return [Finding(Severity.NOTE, what, "they count once each in a fit", places(scan, repeated), "repeated-nodes")]
    what = f"{_count(repeated)} share their geometry with another"
    remedy = "repeats count once each in a fit; average them or delete what is stale"
    return [Finding(Severity.WARNING, what, remedy, places(scan, repeated), "repeated")]


def _coverage(scan: xr.Dataset) -> list[Finding]:
    incidences = scan["theta_i"].values[in_use(scan)]
    if not len(incidences) or (incidences != incidences[0]).any():
        return []
    what = f"one incidence angle only, {incidences[0]:g} deg"
    remedy = "a fit says nothing about other incidence angles; measure at two or more"
    return [Finding(Severity.WARNING, what, remedy, name="one-incidence")]


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
