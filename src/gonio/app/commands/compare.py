"""`gonio compare`: several models fitted to scans, and ranked."""

from dataclasses import dataclass
from itertools import chain
from typing import Annotated, ClassVar

from gonio import compare
from gonio.app.help_page import Example
from gonio.app.legend import legend
from gonio.app.options import ModelNames, OutputOptions, ScanOptions, Scans, chosen_models, processes
from gonio.app.output import progress_bar
from gonio.app.views import ranking
from gonio.comparison.metrics import METRICS
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.search.solvers import SearchOptions
from gonio.options import Option, Panel, one_of

EXAMPLES = (
    Example("gonio compare scan.csv", "Rank the models of the paper"),
    Example(
        "gonio compare scan.csv --models ggx,ward,gonio-best --weighting log", "Rank models where the wings matter"
    ),
    Example(
        "gonio compare scan.csv --models lambert,ggx --validate theta_i",
        "Rank by the error at incidence angles that the fit was not shown",
    ),
)


@dataclass(frozen=True, kw_only=True)
class RankingOptions:
    """Which models are ranked, and by what."""

    PANEL: ClassVar = Panel.RANKING
    models: ModelNames = "family"
    rank: Annotated[str, Option(f"error that orders the models: {one_of(METRICS)}", names=tuple(METRICS))] = "E"
    by_incidence: Annotated[bool, Option("also print the nRMSE at each incidence angle")] = False
    validate: Annotated[
        str,
        Option(
            "fit again without some points and rank by the error there: theta_i (each incidence angle in turn), "
            "out-of-plane, or a number of blocks such as 5",
            metavar="BY",
            names=("theta_i", "out-of-plane"),
        ),
    ] = ""
    workers: Annotated[
        int, Option("number of processes that share the models; 0 chooses it", panel=Panel.SOLVER, lowest=0)
    ] = 0


def command(
    scans: Scans,
    ranked: RankingOptions,
    problem: ProblemOptions,
    search: SearchOptions,
    scan: ScanOptions,
    output: OutputOptions,
) -> None:
    """Fit several models to scans and rank them."""
    models, solver = chosen_models(ranked.models), search.chosen()
    if not models:
        raise ValueError("--models names no model: there is nothing to compare")
    loaded = [(path, scan.read(path)) for path in scans]
    rankings = []
    with progress_bar("comparing") as progress:
        for done, (path, data) in enumerate(loaded):
            rows = compare(
                data,
                models,
                by=ranked.rank,
                left_out=ranked.validate,
                solver=solver,
                workers=processes(ranked.workers, len(models)),
                progress=lambda fraction, done=done: progress((done + fraction) / len(loaded)),  # type: ignore[misc]
                **problem.given(),
            )
            rankings.append((path, rows))
    lines = (line for path, rows in rankings for line in ranking.lines(path, rows, ranked.by_incidence))
    meanings = legend([rows for _, rows in rankings])
    output.show([ranking.record(path, rows) for path, rows in rankings], chain(lines, meanings))
