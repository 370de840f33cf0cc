"""`gonio plot`: a scan drawn with the models fitted to it."""

from enum import StrEnum
from typing import Annotated

import typer

from gonio import compare
from gonio.app import arguments, options
from gonio.app.options import Models, ScanOptions, Scans, chosen_models
from gonio.app.output import console, progress_bar
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.search.solvers import SearchOptions


class Figure(StrEnum):
    """What `gonio plot` draws."""

    CURVES = "curves"
    RESIDUALS = "residuals"
    COMPONENTS = "components"
    HEMISPHERE = "hemisphere"
    CONVERGENCE = "convergence"
    SPECTRA = "spectra"
    ERRORS = "errors"


def command(
    scans: Scans,
    problem: ProblemOptions,
    search: SearchOptions,
    scan: ScanOptions,
    figure: Annotated[Figure, typer.Option("--figure", help="what to draw")] = Figure.CURVES,
    models: Models = "torrance-sparrow,wang-2016,liu-2016,cauchy-lorentz",
    normalised: Annotated[bool, typer.Option("--normalised", help="curves over their specular value")] = False,
    band: Annotated[bool, typer.Option("--band", help="shade the 95 % band of every fit")] = False,
    out: options.Figure = "",
    force: options.Force = False,
) -> None:
    """Draw a scan and the models fitted to it."""
    from gonio.app.views import figures
    from gonio.plotting.style import save

    chosen, solver = chosen_models(models), search.chosen()
    target, suffixes = arguments.figure_target(out or f"{scans[0].stem}-{figure.value}")
    ranked = {}
    with progress_bar("fitting") as progress:
        for path in scans:
            data = scan.read(path)
            rows = compare(data, chosen, solver=solver, progress=progress, **problem.given())
            ranked[path.stem] = (data, rows)
    drawn = figures.draw(figure.value, ranked, normalised=normalised, banded=band)
    for path in save(drawn, target, suffixes, force):
        console().print(f"wrote {path}")
