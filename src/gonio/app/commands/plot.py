"""`gonio plot`: a scan drawn with the models fitted to it."""

from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

from gonio import compare
from gonio.app import arguments
from gonio.app.help_page import Example
from gonio.app.options import FigureOptions, ModelNames, Scale, ScanOptions, Scans, chosen_models
from gonio.app.output import progress_bar
from gonio.comparison.answer import polarised
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.search.solvers import SearchOptions
from gonio.fitting.solution import Solution
from gonio.measured.dataset import is_degree, select
from gonio.options import Option, Panel, one_of
from gonio.results.content import scan_name
from gonio.results.prediction import row_of

if TYPE_CHECKING:
    import xarray as xr

    from gonio.results.view import View

EXAMPLES = (
    Example("gonio plot scan.csv", "Draw the scan and four models fitted to it"),
    Example('gonio plot scan.csv --models "" --out scan.png', "Draw the measured values alone"),
    Example(
        "gonio plot scan.csv --models ggx --size 85x60mm --font 8 --out fig.pdf", "Draw it for a column of a journal"
    ),
    Example(
        "gonio plot scan.csv --models ggx --scale log --theta-i 10,30",
        "Draw two incidence angles on a logarithmic axis",
    ),
    Example("gonio plot scan.csv --models ggx --figure residuals", "Draw what a fit leaves over"),
    Example(
        'gonio plot a.csv --models "" --figure spectrum --at 30,30,180', "Draw values over wavelength at a direction"
    ),
    Example(
        "gonio plot scan.csv --models ggx --figure polar --theta-i 10,30", "Draw two lobes in the plane of incidence"
    ),
    Example("gonio plot scan.csv --models ggx --figure lobe --theta-i 30", "Draw the fitted lobe in space"),
    Example("gonio plot polarised.csv --figure dolp", "Draw the degree of polarisation of readings in s and p"),
    Example('gonio plot a.csv b.csv --models "" --together', "Draw all wavelengths of two samples in one figure"),
    Example(
        "gonio plot a.csv b.csv --models lambert,ggx --figure errors", "Draw the errors of models over several scans"
    ),
)
FOUR = "torrance-sparrow,wang-2016,liu-2016,cauchy-lorentz"


class Figure(StrEnum):
    """What `gonio plot` draws."""

    CURVES = "curves"
    RESIDUALS = "residuals"
    COMPONENTS = "components"
    POLAR = "polar"
    SPECTRUM = "spectrum"
    HEMISPHERE = "hemisphere"
    LOBE = "lobe"
    CONVERGENCE = "convergence"
    SPECTRA = "spectra"
    DOLP = "dolp"
    ERRORS = "errors"


@dataclass(frozen=True, kw_only=True)
class DrawingOptions:
    """What is drawn, and how."""

    PANEL: ClassVar = Panel.FIGURE
    figure: Annotated[Figure, Option(f"what to draw: {one_of(Figure)}", metavar="KIND", names=tuple(Figure))] = (
        Figure.CURVES
    )
    models: ModelNames = FOUR
    normalised: Annotated[bool, Option("divide each curve by its value at the specular angle")] = False
    band: Annotated[bool, Option("shade the 95 % band of every fit")] = False
    scale: Annotated[Scale, Option("scale of the values of curves, components, polar, lobe and spectrum")] = Scale.BOTH
    theta_i: Annotated[str, Option("draw these incidence angles only, with commas", metavar="DEG,..")] = ""
    at: Annotated[
        str,
        Option(
            "directions of spectrum, with semicolons; without it the brightest of the middle incidence angle",
            metavar="THETA_I,THETA_R,PHI",
        ),
    ] = ""
    together: Annotated[bool, Option("draw curves of all channels, wavelengths or scans in the same panels")] = False

    def view(self) -> "View":
        """What of a scan is drawn, and how; ValueError for what is no angle of incidence."""
        from gonio.results.view import View

        return View(
            normalised=self.normalised,
            banded=self.band,
            together=self.together,
            scales=self.scale.scales,
            theta_i=arguments.incidence_angles(self.theta_i) if self.theta_i else (),
            at=arguments.directions(self.at) if self.at else (),
        )


def command(
    scans: Scans,
    drawing: DrawingOptions,
    problem: ProblemOptions,
    search: SearchOptions,
    scan: ScanOptions,
    output: FigureOptions,
) -> None:
    """Draw a scan, or a fit's solution.nc, with the models fitted to it."""
    from gonio.app.views import contents, figures

    kind = drawing.figure.value
    name = f"{scans[0].stem}-{kind}"
    output.target(name)  # refused before the fits
    view = drawing.view()
    names = arguments.listed(drawing.models)
    stored = {one: fit for one in names if (fit := contents.fit_named(one)) is not None}
    models = chosen_models(",".join(one for one in names if one not in stored))
    usual = drawing.models == FOUR
    ranked = {}
    with progress_bar("fitting") as progress:
        for path in scans:
            if (solution := contents.fit_in(path)) is not None:
                data, fits, fitted = _of(path, solution, scan), [solution], drawing.models != FOUR
                title = scan_name(solution)
            else:
                data, fits, fitted, title = scan.read(path), [], True, path.stem
            rows = [row_of(one, data) for one in (*fits, *stored.values())]
            if fitted and models:
                fitting = polarised() if usual and (is_degree(data) or drawing.figure is Figure.DOLP) else models
                rows += compare(data, fitting, solver=search.chosen(), progress=progress, **problem.given())
            ranked[str(path) if title in ranked else title] = (data, rows)
    output.save(lambda: figures.draw(kind, ranked, view), name)


def _of(path: Path, solution: Solution, scan: ScanOptions) -> "xr.Dataset":
    """The scan that a fit holds, or the set of it that was chosen."""
    if scan.blocked or scan.floor:
        raise ValueError(f"{path}: holds the points that were fitted; --blocked and --floor belong to a scan")
    try:
        return select(solution.scan, scan.select)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from error
