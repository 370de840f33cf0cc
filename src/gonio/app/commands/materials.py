"""`gonio materials`: optical constants as a list, or those of one material."""

from typing import Annotated

import typer

from gonio.app.options import OutputOptions
from gonio.app.views.catalogue import material_lines, material_record, materials_table
from gonio.materials import material, materials


def command(
    output: OutputOptions,
    name: Annotated[str, typer.Argument(help="one material or a file of constants", show_default=False)] = "",
) -> None:
    """List optical constants, or show one material's."""
    chosen = [material(name)] if name else list(materials.values())
    parts = material_lines(chosen[0]) if name else (materials_table(chosen),)
    output.show([material_record(one) for one in chosen], parts)
