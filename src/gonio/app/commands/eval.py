"""`gonio eval`: a model's values at given directions."""

from typing import Annotated

from gonio.app import arguments
from gonio.app.help_page import Example
from gonio.app.model_options import SurfaceOptions
from gonio.app.options import ModelArgument, OutputOptions
from gonio.app.views import evaluation
from gonio.options import Option, Panel

EXAMPLES = (
    Example('gonio eval cauchy-lorentz --published Al --at "40,40,180"', "The value at the specular direction"),
    Example('gonio eval ggx --set rho_s=0.5 --at "30,10;30,50"', "Two directions in the plane of incidence"),
    Example(
        'gonio eval wellems --set ks=1 --at "50,35,120" --stokes 1,0,0,0',
        "The Stokes vector of what was unpolarised light",
    ),
)


def command(
    model: ModelArgument,
    surface: SurfaceOptions,
    output: OutputOptions,
    at: Annotated[
        str,
        Option(
            'directions "theta_i,theta_r,phi", more after semicolons; without phi in the incidence plane, with theta_r '
            "negative towards the source",
            metavar="DEG",
            panel=Panel.DATA,
        ),
    ],
    stokes: Annotated[
        str,
        Option("Stokes vector of the light that arrives, for a polarised model", metavar="I,Q,U,V", panel=Panel.DATA),
    ] = "",
) -> None:
    """Evaluate a model at given directions."""
    places = arguments.directions(at)
    chosen = surface.of(model)
    records = evaluation.evaluate(chosen, places, arguments.stokes(stokes) if stokes else None)
    output.show(evaluation.record(chosen, places, records), (evaluation.table(chosen, places, records),))
