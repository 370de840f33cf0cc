"""A reduction as one page of HTML: its budget as table and figure, and the steps that led to the scan."""

from pathlib import Path

import xarray as xr
from markupsafe import Markup

from gonio.files import replacing
from gonio.plotting.budget.figure import budget_figure
from gonio.plotting.style import svg
from gonio.reduction.budget import Budget, budget
from gonio.reduction.reduce import flags
from gonio.reporting.page import templates
from gonio.results.reduction import HEADS, NOTE, TITLE, rows


def write_report(scan: xr.Dataset, path: Path, force: bool = False) -> Path:
    """The budget, its figure, flags and steps of a reduced scan as one page of HTML.

    Raises FileExistsError where the file exists, without `force`.
    """
    found = budget(scan)
    steps = [*scan.attrs.get("provenance", "").splitlines(), *scan.attrs.get("history", "").splitlines()]
    text: str = (
        templates()
        .get_template("reduction.html")
        .render(
            title=path.stem,
            budget=TITLE,
            heads=HEADS,
            rows=rows(found),
            note=NOTE,
            figure=_figure(found),
            steps=steps,
            flags=len(flags(scan)),
        )
    )
    with replacing(path, force) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def _figure(found: Budget) -> str:
    """The figure as SVG, or in words why there is none."""
    try:
        return Markup(svg(budget_figure(found)))
    except ValueError as error:
        return f"No figure of the budget: {error}"
