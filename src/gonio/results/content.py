"""What a report of a fit says, before it is text or HTML: heading, values, metrics, and what one has to know beside.

A report has MOST_LINES lines at most, whatever the number of values: a parameter with many becomes one row with their
range, and what does not fit is counted.
"""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

from gonio.comparison.metrics import METRICS
from gonio.design.remedy import remedy_of
from gonio.fitting.certainty.identifiability import determinations
from gonio.fitting.solution import Solution
from gonio.outside import printable
from gonio.results.implausible import implausible
from gonio.results.numbers import figure, interval, name, uncertain
from gonio.results.prediction import is_logarithmic
from gonio.results.values import AT_BOUND, FITTED, HELD, NOT_DETERMINED, Value, values
from gonio.units import unit_label

MOST_LINES = 30
MOST_ROWS = 13  # of the table of values
MOST_NOTES = 5
NAMED = 3  # values that a note names
CORRELATED = 200  # values beyond which it takes long to find those that trade off
COARSE = 0.1  # of what a fit leaves over: a change by a finer rule for the cones that matters

Cells = tuple[str, ...]
HEADS = ("parameter", "value ± standard uncertainty", "95 % interval", "unit", "status")


@dataclass(frozen=True)
class Content:
    """The parts of a report: lines above the table, rows of the table under HEADS, and lines below it."""

    title: str
    facts: Sequence[str]
    rows: Sequence[Cells]
    metrics: Sequence[str]
    notes: Sequence[str]


def content(solution: Solution) -> Content:
    """What there is to say of a fit."""
    found = list(values(solution))
    return Content(_title(solution), _facts(solution), _rows(found), _metrics(solution), _some_notes(solution, found))


def scan_name(solution: Solution) -> str:
    """The file that was fitted, or in words what the scan is, from its history."""
    history = str(solution.dataset.attrs["data_history"])
    joined = re.search(r"^joined (.*)$", history, re.MULTILINE)
    if joined:
        return f"{name(joined[1])} jointly"
    read = re.search(r"^read from (.*) as ", history, re.MULTILINE)
    return name(read[1]) if read else "a simulated scan" if history.startswith("simulated") else "a scan"


def _title(solution: Solution) -> str:
    model, points = solution.model, solution.dataset.attrs["points"]
    unit = unit_label(solution.unit)
    return f"{name(model.name)} ({name(model.title)}) fitted to {scan_name(solution)}: {points} points in {unit}"


def _facts(solution: Solution) -> list[str]:
    attrs = solution.dataset.attrs
    reason = f" ({printable(attrs['weighting_reason'])})" if attrs["weighting_reason"] else ""
    how = f"{attrs['weighting']} weighting{reason}, {attrs['loss']} loss, {name(attrs['solver'])}"
    if solution.covariance_kind:
        how += f"; standard uncertainties of the {solution.covariance_kind} covariance"
    return [*_verdict(solution), str(solution.status), how]


def _verdict(solution: Solution) -> Iterator[str]:
    """What `gonio.fit(scan)` found: the verdict, how many models were tried, and what no fit was shown."""
    found = solution.answer
    if not found:
        return
    yield printable(str(found["verdict"]["words"]))
    if len(found["tried"]) > 1:
        yield f"the best of {len(found['tried'])} models, by what each predicts where it was not shown the scan"
    if found["contradicted"]:
        points = sum(one["points"] for one in found["contradicted"])
        yield f"{points} points were left out, as the rest of the scan contradicts them: solution.answer says which"


def _rows(found: Sequence[Value]) -> list[Cells]:
    """Every value where they fit; else one row for each parameter of several."""
    rows = [_row(value) for value in found]
    if len(rows) > MOST_ROWS:
        parts = [list(group) for _, group in groupby(found, key=lambda value: value.parameter)]
        rows = [_range(part) if len(part) > 1 else _row(part[0]) for part in parts]
    if len(rows) > MOST_ROWS:
        rest = len(rows) - MOST_ROWS + 1
        rows = [*rows[: MOST_ROWS - 1], (f"and {rest} more: solution.to_dataframe()", "", "", "", "")]
    return rows


def _row(value: Value) -> Cells:
    full = f"{value.parameter}[{value.group}]" if value.by else value.parameter
    # a standard uncertainty has no meaning at a bound
    stated = f"{value.value:.6g}" if value.status == AT_BOUND else uncertain(value.value, value.uncertainty)
    status = "" if value.status in (FITTED, HELD, NOT_DETERMINED) else value.status  # the value itself says the others
    return name(full), stated, interval(value.low, value.high), unit_label(value.unit), status


def _range(part: Sequence[Value]) -> Cells:
    """One row for the many values of a parameter: their range, and that of their uncertainties."""
    numbers = [v.value for v in part if math.isfinite(v.value)]
    spreads = [v.uncertainty for v in part if math.isfinite(v.uncertainty)]
    stated = f"{min(numbers):.4g} to {max(numbers):.4g}" if numbers else "–"
    if spreads:
        stated += f" ± {min(spreads):.2g} to {max(spreads):.2g}"
    counts = {s: sum(v.status == s for v in part) for s in (AT_BOUND, NOT_DETERMINED, HELD)}
    status = ", ".join(f"{count} {word}" for word, count in counts.items() if count)
    first = f"{part[0].parameter}: {len(part)} values by {part[0].by}"
    return name(first), stated, "–", unit_label(part[0].unit), status


def _metrics(solution: Solution) -> list[str]:
    """The metric of the weighting with its meaning, and the others."""
    if not solution.has_scan:  # which still knows E
        meaning = "squared error of the logarithm" if is_logarithmic(solution) else METRICS["E"].brief
        return [f"E {figure(solution.cost)} ({meaning}); the others need the scan: solution.with_scan(scan).metrics"]
    found = solution.metrics
    first = "log10_rmse" if is_logarithmic(solution) else "E"
    others = ", ".join(f"{METRICS[n].title} {figure(value)}" for n, value in found.items() if n != first)
    return [f"{METRICS[first].title} {figure(found[first])} ({METRICS[first].brief}); {others}"]


def _some_notes(solution: Solution, found: Sequence[Value]) -> list[str]:
    notes = [printable(note) for note in _notes(solution, found)]  # sentences name values, and these their groups
    if len(notes) > MOST_NOTES:
        notes = [*notes[: MOST_NOTES - 1], f"and {len(notes) - MOST_NOTES + 1} more notes: gonio fit prints all"]
    return notes


def _notes(solution: Solution, found: Sequence[Value]) -> Iterator[str]:
    """What one has to know to read the values; the gravest first."""
    attrs = solution.dataset.attrs
    if attrs["searches"] > 1 and attrs["searches_alike"] == 1 and attrs["next_minimum"] > 1:
        yield f"a lower minimum may exist: each of {attrs['searches']} searches met another one"
    yield from (f"not physical: {words}" for words in implausible(solution))
    yield from _undetermined(solution, found)
    cones = solution.instrument
    if cones:
        angles = f"source {cones.source_half_angle:g} deg, detector {cones.detector_half_angle:g} deg"
        yield f"folded in, half-angles of {angles}: the values are the surface's own"
        if attrs["instrument_error"] > COARSE:
            yield "the cones were averaged too coarsely: fit again with a smaller step of the instrument"
    if attrs["loss"] != "squared":
        yield f"{attrs['points_discounted']} points count for less than half under the {attrs['loss']} loss"
    if solution.has_systematic:
        yield "the intervals hold the systematic uncertainty that the scan states; solution.parameters() has it apart"
    for smoothed, how in solution.smooth.items():
        yield f"{name(smoothed)} is smooth over {name(how.by)}, strength {figure(float(how.strength))}"
    if 0 < attrs["points_searched"] < attrs["points"]:
        yield f"starts were searched on {attrs['points_searched']} of {attrs['points']} points, the minimum on all"


def _undetermined(solution: Solution, found: Sequence[Value]) -> Iterator[str]:
    """Values that trade off, or that the data do not determine: a few by name, the others counted."""
    if len(found) > CORRELATED:
        if count := sum(value.status == NOT_DETERMINED for value in found):
            yield f"the data do not determine {count} of {len(found)} values"
        return
    farthest = float(solution.scan["theta_r"].max()) if solution.has_scan else 90.0
    judged = determinations(solution, farthest, remedy=remedy_of(solution))
    loose = [f"{name(d.name)}: {d.words}" for d in judged if not d.determined]
    yield from loose[:NAMED]
    if len(loose) > NAMED:
        yield f"{len(loose) - NAMED} more values trade off, lie at a bound or are not determined"
