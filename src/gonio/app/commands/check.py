"""`gonio check`: positivity, reciprocity and energy of a model, a scan or a fit."""

from typing import Annotated

import typer

from gonio.app.model_options import ValueOptions
from gonio.app.options import NO_PIPES, OutputOptions, ScanOptions
from gonio.app.views import physics


def command(
    target: Annotated[
        str, typer.Argument(help=f"a model, a scan, or a fit's solution.nc ({NO_PIPES})", show_default=False)
    ],
    values: ValueOptions,
    scan: ScanOptions,
    output: OutputOptions,
    samples: Annotated[
        int, typer.Option("--samples", min=0, help="reflectance from so many drawn directions, for narrow lobes")
    ] = 0,
) -> None:
    """Check positivity, reciprocity and energy; of a scan also what mistakes of measurements it shows."""
    checked = physics.check(target, values.values(), samples, scan)
    output.show(physics.record(checked), physics.lines(checked))
