"""`gonio materials`: optical constants as a list, or those of one material."""

from typing import Annotated

import typer

from gonio.app import names
from gonio.app.help_page import Example
from gonio.app.options import OutputOptions
from gonio.app.views.catalogue import material_lines, material_record, materials_table
from gonio.materials import material, materials
from gonio.options import Option

EXAMPLES = (
    Example("gonio materials", "List the materials that come with gonio"),
    Example("gonio materials gold", "Index, extinction and reflectance of one, with the source"),
    Example("gonio materials coating.yml", "The same of a file from refractiveindex.info"),
)


def command(
    output: OutputOptions,
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME|FILE",
            help="one material, or a file of constants",
            show_default=False,
            autocompletion=Option("", names=names.materials).completed,
        ),
    ] = "",
) -> None:
    """List optical constants, or show those of one material."""
    chosen = [material(name)] if name else list(materials.values())
    parts = material_lines(chosen[0]) if name else (materials_table(chosen),)
    output.show([material_record(one) for one in chosen], parts)
