"""`gonio check`: positivity, reciprocity and energy of a model, a scan or a fit."""

from typing import Annotated

import typer

from gonio.app import names
from gonio.app.help_page import Example
from gonio.app.model_options import ValueOptions
from gonio.app.options import NO_PIPES, OutputOptions, ScanOptions
from gonio.app.views import physics
from gonio.options import Option, Panel

EXAMPLES = (
    Example("gonio check scan.csv", "Check measured values"),
    Example("gonio check ggx --set rho_s=0.3 --set width=0.2", "Check a model with values given by hand"),
    Example("gonio check results/solution.nc --json check.json", "Check a fit, and keep the verdicts as JSON"),
)


def command(
    target: Annotated[
        str,
        typer.Argument(
            metavar="MODEL|FILE",
            help=f"a model, a scan, or a fit's solution.nc ({NO_PIPES})",
            show_default=False,
            autocompletion=Option("", names=names.models).completed,
        ),
    ],
    values: ValueOptions,
    scan: ScanOptions,
    output: OutputOptions,
    samples: Annotated[
        int,
        Option(
            "compute the reflectance from this many random directions, for lobes too narrow for the quadrature",
            panel=Panel.MODEL,
            lowest=0,
        ),
    ] = 0,
) -> None:
    """Check positivity, reciprocity and energy; of a scan also what mistakes of measurements it shows."""
    checked = physics.check(target, values.values(), samples, scan)
    output.show(physics.record(checked), physics.lines(checked))
