"""`gonio plot`: a scan drawn with the models fitted to it."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Annotated, ClassVar

from gonio import compare
from gonio.app.help_page import Example
from gonio.app.options import FigureOptions, ModelNames, ScanOptions, Scans, chosen_models
from gonio.app.output import progress_bar
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.search.solvers import SearchOptions
from gonio.options import Option, Panel

EXAMPLES = (
    Example("gonio plot scan.csv", "Draw the scan and four models fitted to it"),
    Example('gonio plot scan.csv --models "" --out scan.png', "Draw the measured values alone"),
    Example("gonio plot scan.csv --models ggx --figure residuals", "Draw what a fit leaves over"),
    Example(
        "gonio plot a.csv b.csv --models lambert,ggx --figure errors", "Draw the errors of models over several scans"
    ),
)


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

    PANEL: ClassVar = Panel.FIGURE
    figure: Annotated[Figure, Option("what to draw")] = Figure.CURVES
    models: ModelNames = "torrance-sparrow,wang-2016,liu-2016,cauchy-lorentz"
    normalised: Annotated[bool, Option("divide each curve by its value at the specular angle")] = False
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
