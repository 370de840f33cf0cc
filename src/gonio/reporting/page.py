"""Blocks into HTML by templates that escape everything; and the report written to a file."""

import functools
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from gonio.files import replacing
from gonio.fitting.solution import Solution
from gonio.fitting.status import Status
from gonio.outside import printable
from gonio.reporting import checks, circumstances, fitted, measurement, pdf
from gonio.reporting.blocks import Cell, Facts, Section, count, data, percent
from gonio.reporting.case import Case
from gonio.reporting.interactive import interactive
from gonio.results.content import HEADS, content, scan_name
from gonio.results.sparkline import sparkline
from gonio.results.text import as_text

SUFFIXES = (".html", pdf.SUFFIX, ".md", ".txt")


@functools.cache
def templates() -> Any:
    """The templates of this package; what is not printable becomes an escape sequence, and all else is escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    def harmless(value: Any) -> Any:
        return printable(value) if isinstance(value, str) and not isinstance(value, Markup) else value

    options: dict[str, Any] = {"trim_blocks": True, "lstrip_blocks": True, "undefined": StrictUndefined}
    found = Environment(loader=PackageLoader("gonio.reporting"), autoescape=True, finalize=harmless, **options)
    found.filters["markup"] = Markup
    return found


def as_html(solution: Solution) -> str:
    """What `print(solution)` says as one element of well-formed HTML with a small picture, for a notebook."""
    picture = sparkline(solution.scan, solution.brdf) if solution.has_scan else ""
    told = {"status": str(solution.status), "is_good": solution.status == Status.CONVERGED, "picture": picture}
    text: str = templates().get_template("fragment.html").render(heads=HEADS, **vars(content(solution)), **told)
    return "".join(line.strip() for line in text.splitlines())


def page(case: Case, with_sliders: bool = False) -> str:
    """The report as one page without scripts, whose data stand in it as JSON too.

    with_sliders: whether the interactive page stands at its end, which has scripts in a frame of its own.
    """
    told = sections(case)
    shown = interactive(case) if with_sliders else None
    text: str = (
        templates()
        .get_template("page.html")
        .render(
            title=title(case),
            subject="on simulated values" if "simulated" in case.scan.attrs else "of a measurement of scattered light",
            date=case.known.date,
            verdict=verdict(case),
            grade=case.solution.answer.get("verdict", {}).get("grade", ""),
            summary=_summary(case),
            sections=told,
            record=_in_a_script(record(case, told)),
            interactive=shown,
            policy=shown.policy if shown else "",
        )
    )
    return text


def title(case: Case) -> str:
    """What the report is about."""
    return f"{case.model} fitted to {scan_name(case.solution)}"


def verdict(case: Case) -> str:
    """How well the model describes the scan, in a sentence; of a fit without an answer how its search ended."""
    found = case.solution.answer.get("verdict", {})
    return str(found.get("words", "")) or f"{case.model} was fitted: {case.solution.status}"


def _summary(case: Case) -> Facts:
    """The numbers that a reader looks for first."""
    attrs, found = case.solution.dataset.attrs, case.solution.answer.get("verdict", {})
    rows = [("model", Cell(case.model)), ("points", count(attrs["points"]))]
    for key, label in (
        ("typical_error", "typical error"),
        ("left_out_error", "error where not fitted"),
        ("scatter", "scatter of the scan"),
    ):
        if found.get(key) is not None:
            rows.append((label, percent(found[key], 2)))
    return Facts(rows)


def sections(case: Case) -> Sequence[Section]:
    """The sections in their order."""
    before, missing = circumstances.sections(case)
    return [
        *before,
        measurement.results(case),
        measurement.uncertainty(case),
        fitted.section(case),
        checks.plausibility(case),
        checks.software(case),
        checks.warnings(case),
        checks.citation(case),
        missing,
    ]


def record(case: Case, told: Sequence[Section]) -> Mapping[str, Any]:
    """The same for programs."""
    first = {"title": printable(title(case)), "verdict": printable(verdict(case)), "summary": _summary(case).data()}
    return first | dict(data(told))


def _in_a_script(record: Mapping[str, Any]) -> Any:
    """JSON that ends no element and begins none, whatever the names in it."""
    from markupsafe import Markup

    text = json.dumps(record, ensure_ascii=True, allow_nan=False, indent=1)
    for character in "<>&":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return Markup(text)


def refuse_other_suffix(path: Path) -> None:
    """ValueError for a file whose suffix names no form of a report, and for PDF where nothing prints it."""
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(f"{path}: a report is written as .html, .pdf, .md or .txt: choose one of these")
    if path.suffix.lower() == pdf.SUFFIX:
        pdf.refuse_no_printer()


def write(case: Case, path: Path, force: bool, *more: Path, with_sliders: bool = False) -> Path:
    """The report in the form that each suffix names; ValueError for another, FileExistsError without `force`.

    with_sliders: whether a page of HTML ends in the interactive one; ValueError where no page is written.
    """
    paths = (path, *more)
    for one in paths:
        refuse_other_suffix(one)
    suffixes = {one.suffix.lower() for one in paths}
    if with_sliders and ".html" not in suffixes:
        raise ValueError("the interactive page stands in a report of HTML: name a file that ends in .html")
    html = page(case, with_sliders) if ".html" in suffixes else ""
    for one in paths:
        if one.suffix.lower() == pdf.SUFFIX:
            pdf.write_pdf(page(case) if with_sliders or not html else html, one, force)
            continue
        with replacing(one, force) as temporary:
            temporary.write_text(html if one.suffix.lower() == ".html" else _short(case, one), encoding="utf-8")
    return path


def _short(case: Case, path: Path) -> str:
    """What `print(solution)` says, as text or as Markdown."""
    # indented, all of it is a block of code: nothing in a name is taken as markup
    indent = "    " if path.suffix.lower() == ".md" else ""
    return (
        "\n".join(f"{indent}{line}".rstrip() if indent else line for line in as_text(case.solution).splitlines()) + "\n"
    )
