"""`gonio models`: the catalogue as a list, or one model in full."""

from typing import Annotated

import typer

from gonio import catalogue
from gonio.app import names
from gonio.app.help_page import Example
from gonio.app.options import OutputOptions
from gonio.app.views.catalogue import BREAKS, model_lines, model_record, models_table
from gonio.options import Option

EXAMPLES = (
    Example("gonio models", "List all models"),
    Example("gonio models cauchy-lorentz", "Equations, parameters and bounds of one"),
    Example("gonio models ggx --json -", "The same for a program"),
)


def command(
    output: OutputOptions,
    name: Annotated[
        str,
        typer.Argument(
            metavar="MODEL",
            help="one model, to be shown in full",
            show_default=False,
            autocompletion=Option("", names=names.models).completed,
        ),
    ] = "",
) -> None:
    """List the models, or show one in full."""
    chosen = [catalogue[name]] if name else list(catalogue.values())
    parts = model_lines(chosen[0]) if name else (models_table(chosen), BREAKS)
    output.show([model_record(model) for model in chosen], parts)
