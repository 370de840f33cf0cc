"""`gonio plot`: a scan drawn with the models fitted to it."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated

from gonio import compare
from gonio.app.options import FigureOptions, ScanOptions, Scans, chosen_models
from gonio.app.output import progress_bar
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.search.solvers import SearchOptions
from gonio.options import Option


class Figure(StrEnum):
    """What `gonio plot` draws."""

    CURVES = "curves"
    RESIDUALS = "residuals"
    COMPONENTS = "components"
    HEMISPHERE = "hemisphere"
    CONVERGENCE = "convergence"
    SPECTRA = "spectra"
    ERRORS = "errors"


@dataclass(frozen=True, kw_only=True)
class DrawingOptions:
    """What is drawn, and how."""

    figure: Annotated[Figure, Option("what to draw")] = Figure.CURVES
    models: Annotated[str, Option("names, family (the paper's) or all", metavar="A,B")] = (
        "torrance-sparrow,wang-2016,liu-2016,cauchy-lorentz"
    )
    normalised: Annotated[bool, Option("curves over their specular value")] = False
    band: Annotated[bool, Option("shade the 95 % band of every fit")] = False


def command(
    scans: Scans,
    drawing: DrawingOptions,
    problem: ProblemOptions,
    search: SearchOptions,
    scan: ScanOptions,
    output: FigureOptions,
) -> None:
    """Draw a scan and the models fitted to it."""
    from gonio.app.views import figures

    models, solver, kind = chosen_models(drawing.models), search.chosen(), drawing.figure.value
    ranked = {}
    with progress_bar("fitting") as progress:
        for path in scans:
            data = scan.read(path)
            rows = compare(data, models, solver=solver, progress=progress, **problem.given())
            ranked[path.stem] = (data, rows)
    drawn = figures.draw(kind, ranked, normalised=drawing.normalised, banded=drawing.band)
    output.save(drawn, f"{scans[0].stem}-{kind}")
