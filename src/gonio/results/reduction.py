"""A reduction to read: its budget as rows in the style of the GUM, and a page of HTML with figure, flags and steps."""

from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.files import replacing
from gonio.plotting.budget.figure import budget_figure
from gonio.plotting.style import svg
from gonio.reduction.budget import Budget, budget
from gonio.reduction.reduce import flags
from gonio.results.page import PAGE, row_of_cells, safe

HEADS = ("cause", "type", "distribution", "over angles", "u [%]", "least", "largest")
LEFT = 4  # columns of text, before those of numbers
TITLE = "uncertainty budget, (1/f) (df/dx) u(x)"
NOTE = "combined: root of the sum of squares; expanded: k = 2 times that, about 95 %"


def rows(found: Budget) -> list[tuple[str, ...]]:
    """The lines of a budget by HEADS: relative standard uncertainties in per cent over the directions in use.

    u is the root of the mean square over directions, then the least and the largest. The last two are the combined
    uncertainty and the expanded one.
    """
    out = [
        (
            row.cause + f" ({len(row.parts)})" * (len(row.parts) > 1),
            row.type,
            row.distribution,
            row.shape,
            *_percent(row.by_direction),
        )
        for row in found.rows
    ]
    out.append(("combined", "", "", "", *_percent(found.combined)))
    return [*out, ("expanded, k=2", "", "", "", *_percent(found.expanded))]


def _percent(values: npt.NDArray[np.float64]) -> tuple[str, str, str]:
    size = 100 * np.abs(values)
    if not len(size):
        return "–", "–", "–"
    return f"{np.sqrt(np.mean(size**2)):.3g}", f"{size.min():.3g}", f"{size.max():.3g}"


def write_report(scan: xr.Dataset, path: Path, force: bool = False) -> Path:
    """The budget, its figure, flags and steps of a reduced scan as one page of HTML.

    Raises FileExistsError where the file exists, without `force`.
    """
    found = budget(scan)
    body = "".join(row_of_cells(row, "td") for row in rows(found))
    parts = [
        f"<h1>{safe(path.stem)}</h1>",
        f"<h2>{safe(TITLE)}</h2><table><thead>{row_of_cells(HEADS, 'th')}</thead><tbody>{body}</tbody></table>",
        f"<p>{safe(NOTE)}</p>",
        _figure(found),
        "<h2>steps and flags</h2>",
        _listed([*scan.attrs.get("provenance", "").splitlines(), *scan.attrs.get("history", "").splitlines()]),
        f"<p>{len(flags(scan))} flags of single readings</p>",
    ]
    with replacing(path, force) as temporary:
        temporary.write_text(PAGE.format(title=safe(path.stem), body="\n".join(parts)), encoding="utf-8")
    return path


def _figure(found: Budget) -> str:
    try:
        return svg(budget_figure(found))
    except ValueError as error:
        return f"<p>No figure of the budget: {safe(str(error))}</p>"


def _listed(lines: list[str]) -> str:
    return f"<ul>{''.join(f'<li>{safe(line)}</li>' for line in lines)}</ul>"
