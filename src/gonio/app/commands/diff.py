"""`gonio diff`: the difference of two files at common directions."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gonio import read
from gonio.app import arguments
from gonio.app.options import NO_PIPES, OutputOptions, Select
from gonio.app.output import show
from gonio.app.views import difference as view
from gonio.measured.dataset import select as select_sets
from gonio.resampling.difference import difference

if TYPE_CHECKING:
    import xarray as xr


def command(
    a: Annotated[Path, typer.Argument(help=f"the file that is compared ({NO_PIPES})", show_default=False)],
    b: Annotated[Path, typer.Argument(help="the reference, at whose directions both are taken", show_default=False)],
    output: OutputOptions,
    select: Select = [],  # noqa: B006 - typer reads the default and never changes it
    out: Annotated[str, typer.Option("--out", metavar="FILE", help="a figure too: .png, .svg, or both")] = "",
) -> None:
    """The difference of two files at the directions of the second: a table, and a figure with --out."""
    first, second = _selected([read(a), read(b)], arguments.pairs(select, "--select"))
    found = difference(first, second)
    output.show(view.record(found, str(a), str(b)), view.tables(found, a.name, b.name))
    if out:
        from gonio.plotting.difference import difference_figure
        from gonio.plotting.style import save

        target, suffixes = arguments.figure_target(out)
        for path in save(difference_figure(found, a.name, b.name), target, suffixes, output.force):
            if output.json != "-":
                show(f"wrote {path}")


def _selected(scans: "list[xr.Dataset]", choice: dict[str, str]) -> "list[xr.Dataset]":
    """Each scan reduced by what it has a coordinate for; ValueError for a coordinate that none of them has."""
    for name in choice:
        if not any(name in scan.coords for scan in scans):
            raise ValueError(f"neither file has a coordinate {name!r} to select")
    return [select_sets(scan, {n: v for n, v in choice.items() if n in scan.coords}) for scan in scans]
