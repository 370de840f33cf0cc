"""`gonio fit`: the model that describes a scan, or a model that is named, fitted to one scan or several jointly."""

from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import Annotated, ClassVar

from gonio.app.answering import AnswerOptions, watched
from gonio.app.help_page import Example
from gonio.app.options import Models, OutputOptions, ScanOptions, Scans, chosen_models, refuse_unused
from gonio.app.output import command_line, emit_json, show
from gonio.app.views.fit import answer as answer_report
from gonio.app.views.fit import report as fit_report
from gonio.app.views.fit import written
from gonio.app.views.fit.certainty import CertaintyOptions, ask
from gonio.comparison import answer as answering
from gonio.comparison.answer import Answer
from gonio.comparison.ranking import problems_of, settled
from gonio.files import filling, refuse_existing
from gonio.fitting.certainty.outliers import scrutinise
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.search.solvers import SearchOptions
from gonio.options import Option, Panel
from gonio.plotting.page import Page

EXAMPLES = (
    Example("gonio fit scan.csv", "Which model describes the scan, how well, and how sure"),
    Example("gonio fit scan.csv --model ggx --out results", "Fit one model, and keep the fit and its figures"),
    Example(
        "gonio fit scan.csv --model cauchy-lorentz --group ks=theta_i",
        "One ks for each incidence angle, as in the paper",
    ),
    Example(
        "gonio fit scan.csv --model ggx --hold index=1.5 --hold extinction=0", "Fit the rest with two values fixed"
    ),
    Example("gonio fit a.csv b.csv --model ggx --joint", "Two samples at once, with one shape for both"),
)


@dataclass(frozen=True, kw_only=True)
class FitOptions(AnswerOptions):
    """What models are judged by, whether scans are fitted together, and where the results go."""

    PANEL: ClassVar = Panel.OUTPUT
    joint: Annotated[
        bool,
        Option("fit several scans together: one shape for all, weights for each", panel=Panel.DATA),
    ] = False
    out: Annotated[str, Option("write the fit, its JSON, its figures and a report to this folder", metavar="DIR")] = ""
    page: Page = field(default_factory=Page)


def command(
    scans: Scans,
    problem: ProblemOptions,
    search: SearchOptions,
    scan: ScanOptions,
    certainty: CertaintyOptions,
    fitted: FitOptions,
    output: OutputOptions,
    model: Models = "",
) -> None:
    """Say which model describes a scan, how well, with which values, and how sure.

    Without --model every model of the catalogue is tried, and ranked by what it predicts at directions that its fit was
    not shown. With --model that one is fitted. Several scans are fitted together by --joint.
    """
    refuse_unused(fitted.page, fitted.out)
    data = scan.read_joint(scans, fitted.joint)
    models = chosen_models(model) if model else answering.everything()
    if len(models) == 1:
        certainty.refuse_unfit(problems_of(data, models, settled(data, problem.given()))[0])
    out = Path(fitted.out) if fitted.out else None
    if out:
        refuse_existing(out, output.force)
        written.refuse_without_room(fitted.page, data, models, problem, certainty)
    asked = fitted.asked(len(models), solver=search.chosen(), covariance=certainty.covariance)
    with watched("fitting") as watch:
        found = answering.answer(data, models, asked, watch, **problem.given())
    row = found.best
    scrutiny = scrutinise(found.problem, row.solution.vector(found.problem.names))
    answers = ask(found.problem, row.solution, certainty, search.seed)
    record = fit_report.solution_record(row, scrutiny, answers) | found.record() | {"seed": search.seed}
    if out:
        with filling(out, output.force) as folder:
            emit_json(record, str(folder / "fit.json"))
            written.write(fitted.page, folder, found.problem.data, row, answers)
            _report(scans, found, search.seed, folder / "report.html")
    which = scans[0].name if len(scans) == 1 else f"{len(scans)} scans jointly"
    output.show(record, chain(answer_report.lines(which, found), fit_report.lines(which, row, scrutiny, answers)))
    if out and output.json != "-":
        show(f"wrote {out}/")


def _report(scans: list[Path], found: Answer, seed: int | None, path: Path) -> None:
    """The page of the fit; what makes it is loaded for who asked for it."""
    from gonio.reporting.case import Case, Known
    from gonio.reporting.entry import dated, sources, with_points
    from gonio.reporting.page import write

    known = Known(date=dated(), command=command_line(), seed=seed, files=sources(scans))
    write(Case(with_points(found.best.solution, found.problem.data), found.problem.data, known), path, force=True)
