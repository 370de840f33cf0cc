"""A fit as plain text: one line, or a report of at most 30."""

from gonio.fitting.solution import Solution
from gonio.results.content import HEADS, Cells, content, scan_name
from gonio.results.numbers import figure, name

GAP = "  "


def in_a_line(solution: Solution) -> str:
    """What it is, for lists and consoles; `print(solution)` says more."""
    attrs, status = solution.dataset.attrs, str(solution.status).partition(":")[0]
    what = f"{name(solution.model.name)} fitted to {scan_name(solution)}"
    return f"<Solution: {what}, {attrs['points']} points, E {figure(solution.cost)}, {status}>"


def as_text(solution: Solution) -> str:
    """The report of a fit, of at most `content.MOST_LINES` lines."""
    parts = content(solution)
    lines = [parts.title, *parts.facts, "", *_table([HEADS, *parts.rows]), "", *parts.metrics]
    return "\n".join(line.rstrip() for line in [*lines, *(f"- {note}" for note in parts.notes)])


def _table(rows: list[Cells]) -> list[str]:
    """Rows in columns as wide as their longest cell; a row of one cell alone does not widen its column."""
    full = [row for row in rows if any(row[1:])]
    widths = [max(len(row[k]) for row in full) for k in range(len(rows[0]))]
    return [GAP.join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in rows]
