"""A fit as HTML: a fragment for notebooks, and a page with figures; and the report written to a file.

Every text is escaped, and what is not printable is shown as an escape sequence: names in a file may hold anything.
"""

from collections.abc import Sequence
from html import escape
from pathlib import Path

from gonio.files import replacing
from gonio.fitting.solution import Solution
from gonio.outside import printable
from gonio.plotting.style import svg
from gonio.results.content import HEADS, content, scan_name
from gonio.results.figures import plot
from gonio.results.text import as_text

FIGURES = ("curves", "residuals")
PAGE = """<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"/><title>{title}</title>
<style>body {{ font-family: sans-serif; margin: 2em; }} td, th {{ padding: 0.1em 0.8em; text-align: left; }}
svg {{ max-width: 100%; height: auto; }}</style></head>
<body>
{body}
</body></html>
"""


def as_html(solution: Solution) -> str:
    """The report as one element of well-formed HTML."""
    parts = content(solution)
    facts = "".join(f"<div>{safe(fact)}</div>" for fact in parts.facts)
    rows = "".join(row_of_cells(row, "td") for row in parts.rows)
    table = f"<table><thead>{row_of_cells(HEADS, 'th')}</thead><tbody>{rows}</tbody></table>"
    metrics = "".join(f"<div>{safe(line)}</div>" for line in parts.metrics)
    notes = "".join(f"<li>{safe(note)}</li>" for note in parts.notes)
    listed = f"<ul>{notes}</ul>" if notes else ""
    return f"<div><div><b>{safe(parts.title)}</b></div>{facts}{table}{metrics}{listed}</div>"


def row_of_cells(cells: Sequence[str], tag: str) -> str:
    """One row of a table, each cell in the tag `td` or `th`."""
    return "<tr>" + "".join(f"<{tag}>{safe(cell)}</{tag}>" for cell in cells) + "</tr>"


def safe(text: str) -> str:
    """A text as it may stand in HTML."""
    return escape(printable(text))


def write(solution: Solution, path: Path, force: bool) -> Path:
    """The report in the form that the suffix names, as `Solution.report` says."""
    suffix = path.suffix.lower()
    if suffix == ".html":
        text = _page(solution)
    elif suffix in (".md", ".txt"):
        lines = as_text(solution).splitlines()
        # indented, all of it is a block of code: nothing in a name is taken as markup
        text = "\n".join(f"    {line}".rstrip() if suffix == ".md" else line for line in lines) + "\n"
    else:
        raise ValueError(f"{path}: a report is written as .html, .md or .txt: choose one of these")
    with replacing(path, force) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def _page(solution: Solution) -> str:
    title = safe(f"{solution.model.name} fitted to {scan_name(solution)}")
    return PAGE.format(title=title, body="\n".join([as_html(solution), *(_figure(solution, k) for k in FIGURES)]))


def _figure(solution: Solution, kind: str) -> str:
    """A figure as inline SVG, or in words why there is none."""
    try:
        return svg(plot(solution.scan, solution, kind))
    except ValueError as error:
        return f"<p>No figure of {kind}: {safe(str(error))}</p>"
