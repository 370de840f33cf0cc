"""`gonio diff`: the difference of two files at common directions."""

from pathlib import Path
from typing import Annotated

import typer

from gonio.app import arguments
from gonio.app.options import OutputOptions, ScanOptions, Select
from gonio.app.output import show
from gonio.app.views import difference as view
from gonio.resampling.difference import difference


def command(
    a: Annotated[Path, typer.Argument(help="the file that is compared", show_default=False)],
    b: Annotated[Path, typer.Argument(help="the reference, at whose directions both are taken", show_default=False)],
    output: OutputOptions,
    select: Select = [],  # noqa: B006 - typer reads the default and never changes it
    out: Annotated[str, typer.Option("--out", metavar="FILE", help="a figure too: .png, .svg, or both")] = "",
) -> None:
    """The difference of two files at the directions of the second: a table, and a figure with --out."""
    used = ScanOptions(select=arguments.pairs(select, "--select"))
    first, second = (used.read(path, findings=False) for path in (a, b))
    found = difference(first, second)
    output.show(view.record(found, str(a), str(b)), view.tables(found, a.name, b.name))
    if out:
        from gonio.plotting.difference import difference_figure
        from gonio.plotting.style import save

        target, suffixes = arguments.figure_target(out)
        for path in save(difference_figure(found, a.name, b.name), target, suffixes, output.force):
            if output.json != "-":
                show(f"wrote {path}")
