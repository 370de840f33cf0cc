"""A reduction as one page: its budget as table and figures, and the steps that led to the scan."""

from collections.abc import Iterator
from pathlib import Path

import xarray as xr

from gonio.files import replacing
from gonio.reduction.reduce import flags
from gonio.reporting import pdf
from gonio.reporting.blocks import Notes, Section, filled
from gonio.reporting.budget import budget_blocks
from gonio.reporting.page import templates

SUFFIXES = (".html", pdf.SUFFIX)


def refuse_other_suffix(path: Path) -> None:
    """ValueError for a file whose suffix names no form of the page, and for PDF where nothing prints it."""
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(
            f"{path}: a report of a reduction is written as .html or .pdf; --figure writes .pdf, .png, .svg"
        )
    if path.suffix.lower() == pdf.SUFFIX:
        pdf.refuse_no_printer()


def write_report(scan: xr.Dataset, path: Path, force: bool = False) -> Path:
    """The budget, its figures, flags and steps of a reduced scan as one page of HTML, or as PDF.

    Raises ValueError as `refuse_other_suffix`, and FileExistsError where the file exists, without `force`.
    """
    refuse_other_suffix(path)
    sections = [
        Section("budget", "Budget of the uncertainty", filled(budget_blocks(scan))),
        Section("steps", "Steps and flags", filled(_steps(scan))),
    ]
    text: str = templates().get_template("reduction.html").render(title=path.stem, sections=sections)
    if path.suffix.lower() == pdf.SUFFIX:
        return pdf.write_pdf(text, path, force)
    with replacing(path, force) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def _steps(scan: xr.Dataset) -> Iterator[object]:
    lines = [*scan.attrs.get("provenance", "").splitlines(), *scan.attrs.get("history", "").splitlines()]
    yield Notes("steps", lines)
    yield Notes("flags", [f"{len(flags(scan))} flags of single readings"], plain=True)
