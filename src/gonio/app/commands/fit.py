"""`gonio fit`: one model fitted to a scan, or to several jointly."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from gonio import Problem, catalogue
from gonio import fit as fit_problem
from gonio.app.options import ModelName, OutputOptions, ScanOptions, Scans
from gonio.app.output import emit_json, progress_bar, show
from gonio.app.views.fit import report as fit_report
from gonio.app.views.fit.certainty import CertaintyOptions, ask
from gonio.comparison import assess
from gonio.files import filling, refuse_existing
from gonio.fitting.certainty.bootstrap import kept
from gonio.fitting.certainty.outliers import scrutinise
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.search.solvers import SearchOptions
from gonio.options import Option

if TYPE_CHECKING:
    import xarray as xr

    from gonio.app.views.fit.certainty import Certainty
    from gonio.comparison import Row


@dataclass(frozen=True, kw_only=True)
class FitOptions:
    """Whether scans are fitted together, and where the results go."""

    joint: Annotated[bool, Option("several scans at once: weights one a scan, the shape shared")] = False
    out: Annotated[str, Option("write the solution, its JSON and figures", metavar="DIR")] = ""


def command(
    scans: Scans,
    model: ModelName,
    problem: ProblemOptions,
    search: SearchOptions,
    scan: ScanOptions,
    certainty: CertaintyOptions,
    fitted: FitOptions,
    output: OutputOptions,
) -> None:
    """Fit one model to a scan, or to several jointly: values, uncertainties, metrics."""
    data = scan.read_joint(scans, fitted.joint)
    asked = Problem(catalogue[model], data, **problem.given())
    certainty.refuse_unfit(asked)
    out = Path(fitted.out) if fitted.out else None
    if out:
        refuse_existing(out, output.force)
    with progress_bar(f"fitting {model}") as progress:
        row = assess(asked, fit_problem(asked, search.chosen(), progress, certainty.covariance))
    scrutiny = scrutinise(asked, row.solution.vector(asked.names))
    answers = ask(asked, row.solution, certainty, search.seed)
    record = fit_report.solution_record(row, scrutiny, answers)
    if out:
        with filling(out, output.force) as folder:
            emit_json(record, str(folder / "fit.json"))
            _write(folder, data, row, answers)
    which = scans[0].name if len(scans) == 1 else f"{len(scans)} scans jointly"
    output.show(record, fit_report.lines(which, row, scrutiny, answers))
    if out and output.json != "-":
        show(f"wrote {out}/")


def _write(folder: Path, data: "xr.Dataset", row: "Row", answers: "Certainty") -> None:
    """The solution as a file, and the figures that it has something for."""
    from gonio.app.views import figures
    from gonio.plotting.profiles import profiles
    from gonio.plotting.style import save
    from gonio.results.figures import has_spectra

    solution = row.solution if answers.drawn is None else kept(row.solution, answers.drawn)
    solution.save(folder / "solution.nc")
    kinds = ["curves", "residuals", "components"] + ["convergence"] * (solution.dataset.attrs["solver"] == "anneal")
    kinds += ["spectra"] * has_spectra(solution)
    for kind in kinds:
        drawn = figures.draw(kind, {row.model.name: (data, [row])}, banded=kind == "curves")
        save(drawn, folder / kind)
    if answers.profiles:
        shown = profiles(answers.profiles, row.solution.uncertainties, title=row.model.name)
        save(shown, folder / "profiles")
