"""The difference of two files as tables and as plain data."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from gonio.app.output import figure, strong, table
from gonio.app.views.judged import judged_lines, judged_record
from gonio.comparison.metrics import METRICS, judged, metrics
from gonio.measured import dataset
from gonio.resampling.difference import STEEP, Difference
from gonio.units import unit_label

MOST_ROWS = 24


def record(found: Difference, a: str, b: str) -> dict[str, Any]:
    """The whole comparison as plain data."""
    return {
        "file": a,
        "reference": b,
        "unit": dataset.unit(found.points),
        "directions": found.count,
        "measured_in_both": found.exact,
        "interpolated": found.count - found.exact,
        "missing": found.missing,
        "rms": found.rms,
        "rms_steep": found.rms_steep,
        "bias": found.bias,
        "largest": found.largest,
        "where": found.where,
        "largest_absolute": found.largest_absolute,
        "where_absolute": found.where_absolute,
        "without_ratio": found.without_ratio,
        "metrics": metrics(found.points, found.points["other"].values),
        "lg_rmse_points": judged_record(judged(found.points, found.points["other"].values)),
        "by": list(by_incidence(found)),
    }


def by_incidence(found: Difference) -> Iterator[dict[str, Any]]:
    """Each set and incidence angle on its own."""
    points = found.points
    names = (*dataset.sets(points), "theta_i")
    codes = [np.unique(points[n].values, return_inverse=True)[1].ravel() for n in names]
    _, first, group = np.unique(np.column_stack(codes), axis=0, return_index=True, return_inverse=True)
    for k, row in enumerate(first):
        part = Difference(points.isel(direction=np.flatnonzero(group.ravel() == k)), 0)
        named = {n: points[n].values[row].item() for n in names}
        yield named | {"directions": part.count, "rms": part.rms, "bias": part.bias, "largest": part.largest}


def tables(found: Difference, a: str, b: str) -> Iterator[Any]:
    """For people: what was compared, the whole, and each incidence angle."""
    yield strong(f"{a} against {b}", f", {unit_label(dataset.unit(found.points))}")
    if not found.count:
        yield f"nothing in common: {found.missing} directions of {b} lie outside {a}"
        return
    yield f"{found.count} directions: {found.exact} measured in both, {found.count - found.exact} interpolated in {a}"
    if found.missing:
        yield f"{found.missing} directions of {b} lie outside {a} and are left out"
    if found.without_ratio:
        yield (
            f"at {found.without_ratio} of them {b} is zero and {a} is not: these have no relative difference, and "
            "take no part in the largest relative one and delta"
        )
    whole = table("", "")
    whole.show_header = False
    whole.add_row("rms difference, by solid angle", _percent(found.rms))
    whole.add_row(f"the same within {STEEP:g} deg of the normal", _percent(found.rms_steep))
    whole.add_row("bias, by solid angle", _percent(found.bias))
    whole.add_row(f"largest relative, at {_place(found.where)}", _percent(found.largest))
    unit = unit_label(dataset.unit(found.points))
    whole.add_row(f"largest, at {_place(found.where_absolute)}", f"{figure(found.largest_absolute)} {unit}")
    for name, value in metrics(found.points, found.points["other"].values).items():
        whole.add_row(f"{METRICS[name].title}, {METRICS[name].brief}", figure(value))
    yield whole
    yield from judged_lines([judged(found.points, found.points["other"].values)], dataset.unit(found.points))
    rows = list(by_incidence(found))
    names = [n for n in rows[0] if n not in ("directions", "rms", "bias", "largest")]
    parts = table(*(f"{n} [deg]" if n == "theta_i" else n for n in names), "directions", "rms", "bias", "largest")
    for row in rows[:MOST_ROWS]:
        named = [f"{row[n]:g}" if isinstance(row[n], float) else str(row[n]) for n in names]
        parts.add_row(*named, str(row["directions"]), *(_percent(row[k]) for k in ("rms", "bias", "largest")))
    yield parts
    if len(rows) > MOST_ROWS:
        yield f"and {len(rows) - MOST_ROWS} more; --json has them all"


def _place(direction: dict[str, float]) -> str:
    return ", ".join(f"{name} {value:g}" for name, value in direction.items()) + " deg"


def _percent(value: float) -> str:
    return "–" if value != value else f"{100 * value:.3g} %"
