"""`gonio draw`: a model alone as curves, over the hemisphere, or its polarisation."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from gonio.app import arguments
from gonio.app.model_options import SurfaceOptions
from gonio.app.options import FigureOptions, ModelArgument


class Drawing(StrEnum):
    """What `gonio draw` draws."""

    CURVES = "curves"
    HEMISPHERE = "hemisphere"
    DOLP = "dolp"


def command(
    model: ModelArgument,
    surface: SurfaceOptions,
    output: FigureOptions,
    figure: Annotated[Drawing, typer.Option("--figure", help="what to draw")] = Drawing.CURVES,
    theta_i: Annotated[str, typer.Option("--theta-i", metavar="DEG,..", help="incidence angles")] = "30,60",
    stokes: Annotated[str, typer.Option("--stokes", metavar="I,Q,U,V", help="arriving light, for dolp")] = "1,0,0,0",
) -> None:
    """Draw a model: curves, hemisphere, or polarisation."""
    from gonio.app.views import figures

    drawn = figures.draw_model(
        figure.value, surface.of(model), arguments.incidence_angles(theta_i), arguments.stokes(stokes)
    )
    output.save(drawn, f"{Path(model).stem}-{figure.value}")
