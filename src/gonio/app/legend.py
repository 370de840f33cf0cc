"""What the headings and marks of the tables of `gonio compare` mean, below them."""

import math
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from gonio.app.output import faint

if TYPE_CHECKING:
    from rich.text import Text

    from gonio.comparison import Row

# One letter for a status other than converged, so that a fit that failed never looks like a good one.
MARKS = {"AT_BOUND": "b", "NOT_DETERMINED": "?", "STEPS_EXHAUSTED": "!", "TOO_FEW_POINTS": "#"}
FREE = "free: how many values were fitted"
NO_FIGURE = "–: the data do not allow this figure, or the model is compared with itself"
VALIDATED = (
    "fitted: {title} ({brief}) of the fitted points",
    "left out: the same of points that were kept from the fit; the order is by this",
    "behind: by how much it exceeds the first model's, mean over parts ± its error",
)
CRITERIA = "AICc, BIC: misfit with a penalty for each fitted value; smaller is better"


def mark(row: "Row") -> str:
    """The letter of a fit's status; none for one that converged."""
    return MARKS.get(row.solution.status.name, "")


def marks_in_words(rows: Sequence["Row"]) -> Iterator[str]:
    """What the marks of these rows mean, each once."""
    met = {row.solution.status.name: row.solution.status.value.split(":")[0] for row in rows}
    return (f"{letter}: {met[name]}" for name, letter in MARKS.items() if name in met)


def legend(rankings: Sequence[Sequence["Row"]], by: str = "") -> "Iterator[Text]":
    """What the headings of these rankings mean; nothing of a heading that they do not have.

    by: the metric of the fit by which they are ordered, where that is not what was left out.
    """
    rows = [row for ranking in rankings for row in ranking]
    if not rows:
        return
    validated = bool(rows[0].validated) and not by
    yield faint(FREE)
    for line in _of_validation(rows) if validated else _metrics(rankings):
        yield faint(line)
    if validated:
        yield faint(CRITERIA)
    if validated or _has_dash(rankings):
        yield faint(NO_FIGURE)


def _of_validation(rows: Sequence["Row"]) -> Iterator[str]:
    """What the columns of validated models mean, in the metric of each weighting that occurs."""
    from gonio.comparison.metrics import METRICS

    first, *others = VALIDATED
    for name in dict.fromkeys(row.metric for row in rows):
        yield first.format(title=METRICS[name].title, brief=METRICS[name].brief)
    yield from others


def _metrics(rankings: Sequence[Sequence["Row"]]) -> Iterator[str]:
    from gonio.comparison.metrics import METRICS
    from gonio.comparison.ranking import REFERENCES, reference_errors

    for metric in METRICS.values():
        yield f"{metric.title}: {metric.brief}"
    for short in dict.fromkeys(name for rows in rankings for name in reference_errors(rows)):
        models = REFERENCES[short]
        which = f"the better of {' and '.join(models)}" if len(models) > 1 else models[0]
        yield f"vs {short}: nRMSE below (+) or above (-) {which}"


def _has_dash(rankings: Sequence[Sequence["Row"]]) -> bool:
    """Whether a figure is missing, or a row is that of a reference."""
    from gonio.comparison.ranking import reference_errors

    figures = (
        value
        for rows in rankings
        for row in rows
        for value in (*row.metrics.values(), *(m["nrmse"] for m in row.by_incidence.values()))
    )
    return any(map(reference_errors, rankings)) or any(not math.isfinite(value) for value in figures)
