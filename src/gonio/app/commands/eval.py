"""`gonio eval`: a model's values at given directions."""

from typing import Annotated

import typer

from gonio.app import arguments
from gonio.app.model_options import SurfaceOptions
from gonio.app.options import ModelArgument, OutputOptions
from gonio.app.views import evaluation


def command(
    model: ModelArgument,
    surface: SurfaceOptions,
    output: OutputOptions,
    at: Annotated[str, typer.Option("--at", metavar="DEG", help='"theta_i,theta_r,phi;.." in degrees')],
    stokes: Annotated[
        str, typer.Option("--stokes", metavar="I,Q,U,V", help="arriving light, for a polarised model")
    ] = "",
) -> None:
    """Evaluate a model at given directions."""
    places = arguments.directions(at)
    chosen = surface.of(model)
    records = evaluation.evaluate(chosen, places, arguments.stokes(stokes) if stokes else None)
    output.show(evaluation.record(chosen, places, records), (evaluation.table(chosen, places, records),))
