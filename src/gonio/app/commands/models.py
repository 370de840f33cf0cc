"""`gonio models`: the catalogue as a list, or one model in full."""

from typing import Annotated

import typer

from gonio import catalogue
from gonio.app.options import OutputOptions
from gonio.app.views.catalogue import BREAKS, model_lines, model_record, models_table


def command(
    output: OutputOptions,
    name: Annotated[str, typer.Argument(help="one model, in full", show_default=False)] = "",
) -> None:
    """List the models, or show one in full."""
    chosen = [catalogue[name]] if name else list(catalogue.values())
    parts = model_lines(chosen[0]) if name else (models_table(chosen), BREAKS)
    output.show([model_record(model) for model in chosen], parts)
