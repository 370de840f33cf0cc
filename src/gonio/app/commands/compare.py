"""`gonio compare`: several models fitted to scans, and ranked."""

from typing import Annotated

import typer

from gonio import compare
from gonio.app.options import Models, OutputOptions, ScanOptions, Scans, Workers, chosen_models, processes
from gonio.app.output import progress_bar
from gonio.app.views import ranking
from gonio.comparison.metrics import METRICS
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.search.solvers import SearchOptions
from gonio.options import one_of


def command(
    scans: Scans,
    problem: ProblemOptions,
    search: SearchOptions,
    scan: ScanOptions,
    output: OutputOptions,
    models: Models = "family",
    rank_by: Annotated[str, typer.Option("--rank", help=one_of(METRICS))] = "E",
    by_incidence: Annotated[bool, typer.Option("--by-incidence", help="nRMSE at each incidence angle too")] = False,
    validate: Annotated[
        str,
        typer.Option("--validate", metavar="BY", help="rank by what is left out: theta_i, out-of-plane, 5 (blocks)"),
    ] = "",
    workers: Workers = 0,
) -> None:
    """Fit several models to scans and rank them."""
    chosen, solver = chosen_models(models), search.chosen()
    loaded = [(path, scan.read(path)) for path in scans]
    rankings = []
    with progress_bar("comparing") as progress:
        for done, (path, data) in enumerate(loaded):
            rows = compare(
                data,
                chosen,
                by=rank_by,
                left_out=validate,
                solver=solver,
                workers=processes(workers, len(chosen)),
                progress=lambda fraction, done=done: progress((done + fraction) / len(loaded)),  # type: ignore[misc]
                **problem.given(),
            )
            rankings.append((path, rows))
    lines = (line for path, rows in rankings for line in ranking.lines(path, rows, by_incidence))
    output.show([ranking.record(path, rows) for path, rows in rankings], lines)
