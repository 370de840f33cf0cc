"""`gonio compare`: several models fitted to scans, and ranked."""

from dataclasses import dataclass
from typing import Annotated

from gonio import compare
from gonio.app.options import OutputOptions, ScanOptions, Scans, chosen_models, processes
from gonio.app.output import progress_bar
from gonio.app.views import ranking
from gonio.comparison.metrics import METRICS
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.search.solvers import SearchOptions
from gonio.options import Option, one_of


@dataclass(frozen=True, kw_only=True)
class RankingOptions:
    """Which models are ranked, and by what."""

    models: Annotated[str, Option("names, family (the paper's) or all", metavar="A,B")] = "family"
    rank: Annotated[str, Option(one_of(METRICS))] = "E"
    by_incidence: Annotated[bool, Option("nRMSE at each incidence angle too")] = False
    validate: Annotated[str, Option("rank by what is left out: theta_i, out-of-plane, 5 (blocks)", metavar="BY")] = ""
    workers: Annotated[int, Option("processes that share the models; 0: as many as pay off", metavar="N")] = 0


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
    output.show([ranking.record(path, rows) for path, rows in rankings], lines)
