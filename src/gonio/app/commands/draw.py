"""`gonio draw`: a model alone as curves, over the hemisphere, or its polarisation."""

from enum import StrEnum
from pathlib import Path
from typing import Annotated

from gonio.app import arguments
from gonio.app.help_page import Example
from gonio.app.model_options import SurfaceOptions
from gonio.app.options import FigureOptions, ModelArgument, Scale
from gonio.options import Option, Panel

EXAMPLES = (
    Example("gonio draw ggx --set rho_s=0.5 --set width=0.2", "Draw a model at incidence angles of 30 and 60 deg"),
    Example(
        "gonio draw cauchy-lorentz --published Al --theta-i 20,40 --out al.png", "Draw it with constants of the paper"
    ),
    Example("gonio draw ggx --set rho_s=0.5 --figure lobe --theta-i 30", "Draw its lobe in space"),
    Example("gonio draw wellems --set ks=1 --figure dolp", "Draw the degree of polarisation over the hemisphere"),
)


class Drawing(StrEnum):
    """What `gonio draw` draws."""

    CURVES = "curves"
    POLAR = "polar"
    HEMISPHERE = "hemisphere"
    LOBE = "lobe"
    DOLP = "dolp"


def command(
    model: ModelArgument,
    surface: SurfaceOptions,
    output: FigureOptions,
    figure: Annotated[Drawing, Option("what to draw", panel=Panel.FIGURE)] = Drawing.CURVES,
    theta_i: Annotated[str, Option("incidence angles, with commas", metavar="DEG,..", panel=Panel.FIGURE)] = "30,60",
    scale: Annotated[
        Scale, Option("scale of curves, which are logarithmic without it, polar and lobe", panel=Panel.FIGURE)
    ] = Scale.BOTH,
    stokes: Annotated[
        str,
        Option(
            "Stokes vector of the light that arrives, for dolp (the degree of polarisation)",
            metavar="I,Q,U,V",
            panel=Panel.FIGURE,
        ),
    ] = "1,0,0,0",
) -> None:
    """Draw a model alone: curves, lobes, a hemisphere, or its polarisation."""
    from gonio.app.views import figures

    alone, angles, light = surface.of(model), arguments.incidence_angles(theta_i), arguments.stokes(stokes)
    output.save(
        lambda: figures.draw_model(figure.value, alone, angles, light, scale.scales),
        f"{Path(model).stem}-{figure.value}",
    )
