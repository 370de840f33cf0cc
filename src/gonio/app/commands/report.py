"""`gonio report`: a scan or a fit as one page for people."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

import typer

from gonio.app.answering import AnswerOptions, watched
from gonio.app.help_page import Example
from gonio.app.options import NO_PIPES, Force, Models, ScanOptions, chosen_models
from gonio.app.output import command_line, show
from gonio.app.views import contents
from gonio.comparison import answer as answering
from gonio.files import refuse_existing
from gonio.fitting.covariance_kinds import COVARIANCES, DEFAULT
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.search.solvers import SearchOptions
from gonio.fitting.stored import SOLUTION_FILE
from gonio.options import Option, Panel
from gonio.reporting.about import read_about
from gonio.reporting.case import Case, Known
from gonio.reporting.entry import dated, sources, with_points
from gonio.reporting.interactive import kilobytes
from gonio.reporting.page import refuse_other_suffix, write
from gonio.reporting.pdf import SUFFIX

if TYPE_CHECKING:
    from gonio.fitting.solution import Solution

EXAMPLES = (
    Example("gonio report scan.csv --out page.html", "Fit the best model, and write all that is known on one page"),
    Example("gonio report results --out page.html", "The page of a fit that is there already"),
    Example(
        "gonio report results --scan scan.csv --about about.yml --out page.html",
        "The same with the header of the scan, and what the laboratory says",
    ),
    Example(
        "gonio report results --pdf page.pdf", "The page printed to PDF, by an installed Chromium or by WeasyPrint"
    ),
    Example(
        "gonio report results --interactive --out page.html", "With the page of gonio view, and its sliders, at the end"
    ),
    Example(
        "gonio report scan.csv --model ggx --date 2026-01-31 --out page.html",
        "Fit one model; with a date the page is the same each time",
    ),
)


@dataclass(frozen=True, kw_only=True)
class ReportOptions:
    """What neither a scan nor a fit says, and how scans are fitted for the report."""

    PANEL: ClassVar = Panel.OUTPUT
    about: Annotated[
        str,
        Option(
            "what is known of sample, instrument and environment: YAML with the names of BiRD",
            metavar="FILE",
            panel=Panel.DATA,
        ),
    ] = ""
    scan: Annotated[
        tuple[str, ...],
        Option("the scan of a fit, for what the fit does not hold", metavar="FILE", panel=Panel.DATA),
    ] = ()
    joint: Annotated[bool, Option("fit several scans together", panel=Panel.DATA)] = False
    covariance: Annotated[
        str,
        Option(
            "where uncertainties come from: robust, scaled or absolute",
            panel=Panel.UNCERTAINTY,
            names=tuple(COVARIANCES),
        ),
    ] = DEFAULT
    pdf: Annotated[
        str, Option("also print the page to PDF, by an installed Chromium or by WeasyPrint", metavar="FILE.pdf")
    ] = ""
    interactive: Annotated[
        bool, Option("end the page in that of gonio view, with a slider for every parameter: some 400 kB more")
    ] = False
    date: Annotated[str, Option("date of the report; without it today", metavar="YYYY-MM-DD")] = ""
    force: Force = False


def command(
    targets: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE", help=f"scans, or a fit: solution.nc or its folder ({NO_PIPES})", show_default=False
        ),
    ],
    problem: ProblemOptions,
    search: SearchOptions,
    used: ScanOptions,
    answered: AnswerOptions,
    page: ReportOptions,
    out: Annotated[
        Path | None,
        Option(
            "the file to write: a page as .html or .pdf, a short text as .md or .txt",
            metavar="FILE",
            panel=Panel.OUTPUT,
        ),
    ] = None,
    model: Models = "",
) -> None:
    """Write a report: one page with figures, tables, uncertainties and checks.

    Of a scan the best model is fitted first, as gonio fit does. The page needs no script and no other file.
    """
    first, *more = _outputs(out, page)
    known = Known(
        about=read_about(Path(page.about)) if page.about else {}, date=dated(page.date), command=command_line()
    )
    if (stored := _stored(targets)) is None:
        case = _fitted(targets, problem, search, used, answered, page, model)
    else:
        _refuse_options_of_fits(targets[0], problem, search, answered, page, model)
        files = [Path(name) for name in page.scan]
        if not files:
            used.refuse_for(targets[0], "a fit")
        data = used.read_joint(files, joint=True) if files else None
        case = Case(with_points(stored, data), data, Known(files=sources(files)))
    known = replace(known, files=case.known.files, seed=case.known.seed)
    write(replace(case, known=known), first, page.force, *more, with_sliders=page.interactive)
    for path in (first, *more):
        size = f" ({kilobytes(path.stat().st_size)})" if page.interactive and path.is_file() else ""
        show(f"wrote {path}{size}")


def _outputs(out: Path | None, page: ReportOptions) -> list[Path]:
    """The files to write; ValueError where there is none, FileExistsError for one that is there, without --force."""
    if page.pdf and Path(page.pdf).suffix.lower() != SUFFIX:
        raise ValueError(f"{page.pdf}: --pdf writes PDF: name a file that ends in {SUFFIX}")
    paths = ([out] if out else []) + ([Path(page.pdf)] if page.pdf else [])
    if page.interactive and ".html" not in {path.suffix.lower() for path in paths}:
        raise ValueError("--interactive ends a page of HTML in one with sliders: give --out page.html")
    if not paths:
        raise ValueError("a report is a file: give --out page.html, or --pdf page.pdf")
    for path in paths:
        refuse_other_suffix(path)
        refuse_existing(path, page.force)
    return paths


def _stored(targets: list[Path]) -> "Solution | None":
    """The fit that is named; None for scans. Raises ValueError for several files one of which is a fit."""
    found = [contents.fit_in(_file_of(path)) for path in targets]
    if any(found) and len(found) > 1:
        raise ValueError("a report is of one fit, or of scans: name one, and give scans of the fit by --scan")
    if found[0] is None and contents.stack_in(targets[0]) is not None:
        raise ValueError(f"{targets[0]}: holds many scans, and a report takes one: gonio fit-stack fits each")
    return found[0]


def _file_of(path: Path) -> Path:
    """The fit in a folder that `gonio fit --out` wrote, or the path itself."""
    return path / SOLUTION_FILE if (path / SOLUTION_FILE).is_file() else path


def _fitted(
    targets: list[Path],
    problem: ProblemOptions,
    search: SearchOptions,
    used: ScanOptions,
    answered: AnswerOptions,
    page: ReportOptions,
    model: str,
) -> Case:
    """The best fit of the scans, as `gonio fit` finds it."""
    if page.scan:
        raise ValueError("--scan belongs to a report on a fit, and scans are named: leave it out")
    data = used.read_joint(targets, page.joint)
    models = chosen_models(model) if model else answering.everything()
    asked = answered.asked(len(models), solver=search.chosen(), covariance=page.covariance)
    with watched("fitting") as watch:
        found = answering.answer(data, models, asked, watch, **problem.given())
    return Case(
        with_points(found.best.solution, found.problem.data), data, Known(files=sources(targets), seed=search.seed)
    )


def _refuse_options_of_fits(
    path: Path,
    problem: ProblemOptions,
    search: SearchOptions,
    answered: AnswerOptions,
    page: ReportOptions,
    model: str,
) -> None:
    """ValueError where a stored fit is reported, and it is said how to fit."""
    asked = (problem.given(), search, answered, page.covariance, page.joint, model)
    if asked != (ProblemOptions().given(), SearchOptions(), AnswerOptions(), DEFAULT, False, ""):
        raise ValueError(
            f"{path}: holds a fit, and options of fitting belong to a scan: leave them out, or name the scan"
        )
