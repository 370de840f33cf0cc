"""Models side by side, the nearest first, as plain data and as tables like those of the paper."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gonio.app.legend import mark, marks_in_words
from gonio.app.output import figure, table
from gonio.app.views.fit import provisos
from gonio.app.views.fit.answer import dropped_lines, head_lines
from gonio.app.views.judged import judged_lines, judged_record

if TYPE_CHECKING:
    from rich.table import Table

    from gonio.comparison import Row
    from gonio.comparison.answer import Answer


def ranking_table(scan: str, rows: Sequence["Row"], by: str = "") -> "Table":
    """Models side by side, by what was left out, or by a metric of the fit where nothing was or `by` names one."""
    from gonio.comparison.metrics import METRICS
    from gonio.comparison.ranking import drop, reference_errors

    if rows and rows[0].validated and not by:
        return _validated_table(scan, rows)
    references = reference_errors(rows)
    heads = [metric.title for metric in METRICS.values()]
    floored = ["floored"] if any(row.judged.floored for row in rows) else []
    out = table("model", "", "free", *heads, *floored, *(f"vs {name}" for name in references), title=scan)
    for row in rows:
        own = row.metrics["nrmse"]
        drops = [_percent(drop(error, own)) if error and error != own else "–" for error in references.values()]
        found = (figure(row.metrics[name]) for name in METRICS)
        out.add_row(row.model.name, mark(row), _count(row), *found, *(str(row.judged.floored) for _ in floored), *drops)
    return out


def notes(rows: Sequence["Row"], by: str = "") -> Iterator[str]:
    """What holds for the fits of one table: what their marks mean, which models are alike, what was left out."""
    yield from marks_in_words(rows)
    is_validated = bool(rows[0].validated) and not by
    if is_validated:
        yield _alike_in_words(rows)
    if not is_validated or rows[0].metric == "log10_rmse":  # E knows no logarithm
        counts = [(row.judged_left_out if is_validated else None) or row.judged for row in rows]
        yield from judged_lines(counts, rows[0].solution.unit)


def _alike_in_words(rows: Sequence["Row"]) -> str:
    from gonio.comparison.assessment import FEWEST_PARTS, scored_parts

    parts = len(scored_parts(rows[0]))
    of_parts = f"{parts} part{'s' * (parts != 1)}"
    if parts < FEWEST_PARTS:
        return f"{of_parts}, too few to say which models are alike"
    return f"≈: no significant difference from the first, by Student's t over {of_parts} (95 %)"


def _validated_table(scan: str, rows: Sequence["Row"]) -> "Table":
    """Models by their error where they were not shown the measurement, and which differences mean something."""
    from gonio.comparison.assessment import alike, behind
    from gonio.comparison.metrics import METRICS

    counts = [row.judged_left_out or row.judged for row in rows]
    floored = ["floored"] if rows[0].metric == "log10_rmse" and any(one.floored for one in counts) else []
    heads = ("free", "fitted", "left out", *floored, "behind", "AICc", "BIC")
    out = table("model", "", *heads, title=f"{scan}, {METRICS[rows[0].metric].title}")
    for row, count in zip(rows, counts, strict=True):
        mean, error = behind(row, rows[0])
        if row is rows[0]:
            apart = "–"
        else:
            apart = f"{mean:.4f}±{error:.4f}" if math.isfinite(error) else _four(mean)
            apart += " ≈" if alike(row, rows[0]) else "  "
        errors = (row.metrics[row.metric], row.validated[row.metric])
        out.add_row(
            row.model.name,
            mark(row),
            _count(row),
            *map(_four, errors),
            *(str(count.floored) for _ in floored),
            apart,
            *(f"{v:.0f}" if math.isfinite(v) else "–" for v in (row.aicc, row.bic)),
        )
    return out


def _four(value: float) -> str:
    return f"{value:.4f}" if math.isfinite(value) else "–"


def _count(row: "Row") -> str:
    """How many values a fit had the use of: a whole number where nothing is smooth."""
    return f"{row.effective_values:.1f}".removesuffix(".0")


def _percent(value: float) -> str:
    """A drop in eight characters; one far below zero says only that, and a dash that there is none."""
    if not math.isfinite(value):
        return "–"
    if value < -1e4:
        return "< -1e4%"
    return f"{value:+.1f}%" if abs(value) < 100 else f"{value:+.0f}%"


ANGLES_A_TABLE = 7


def incidence_tables(rows: Sequence["Row"]) -> "Iterator[Table]":
    """NRMSE of every model at every incidence angle."""
    angles = list(rows[0].by_incidence)
    for start in range(0, len(angles), ANGLES_A_TABLE):
        some = angles[start : start + ANGLES_A_TABLE]
        out = table("nRMSE at theta_i [deg]", *(f"{angle:g}" for angle in some))
        for row in rows:
            out.add_row(row.model.name, *(figure(row.by_incidence[angle]["nrmse"]) for angle in some))
        yield out


def record(path: Path, answer: "Answer") -> dict[str, Any]:
    """A ranking as plain data."""
    rows = answer.rows
    ranking = [
        {
            "model": row.model.name,
            "free_parameters": row.free_parameters,
            "effective_values": row.effective_values,
            "status": str(row.solution.status),
            "instrument": provisos.instrument_record(row.solution),
            "metrics": dict(row.metrics),
            "lg_rmse_points": judged_record(row.judged),
            "aicc": row.aicc,
            "bic": row.bic,
            "validated": dict(row.validated),
            **_corrected_record(row),
            "lg_rmse_points_left_out": judged_record(row.judged_left_out) if row.judged_left_out else {},
            "by_fold": dict(row.by_fold),
            "by_incidence": {f"{angle:g}": dict(m) for angle, m in row.by_incidence.items()},
        }
        for row in rows
    ]
    return {"scan": str(path), "ranking": ranking} | answer.record()


def _corrected_record(row: "Row") -> dict[str, Any]:
    """What a correction adds: the errors without it, and how often the intervals hold; nothing without one."""
    if row.intervals is None:
        return {}
    return {"validated_plain": dict(row.validated_plain), "intervals": {"level": 0.95} | asdict(row.intervals)}


def _corrected_lines(rows: Sequence["Row"]) -> Iterator[str]:
    """The same in words."""
    for row in rows:
        if row.intervals is not None:
            held = row.intervals
            plain, corrected = (_four(errors[row.metric]) for errors in (row.validated_plain, row.validated))
            words = f"{row.model.name}: left out {plain} without the correction, {corrected} with it"
            inside = f"; 95 % intervals hold {_of(held.interior_held, held.interior)}"
            steep = f", at the steepest angle {_of(held.steepest_held, held.steepest)}" if held.steepest else ""
            yield words + inside + steep


def _of(part: int, whole: int) -> str:
    return f"{100 * part / whole:.0f} % of {whole} values" if whole else "no value"


def lines(path: Path, answer: "Answer", by: str = "", by_incidence: bool = False) -> Iterator[Any]:
    """A ranking for people, with the errors at each incidence angle where they are asked for."""
    rows = answer.rows
    yield from head_lines(path.name, answer)
    yield ranking_table(path.stem, rows, by)
    yield from notes(rows, by)
    yield from _corrected_lines(rows)
    yield from dropped_lines(answer)
    yield from provisos.instrument_lines([row.solution for row in rows])
    if by_incidence:
        yield from incidence_tables(rows)
