"""`gonio diff`: the difference of two files at common directions."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gonio import read
from gonio.app.help_page import Example
from gonio.app.options import NO_PIPES, AlsoFigure, OutputOptions, Select, refuse_unused
from gonio.app.output import show
from gonio.app.views import difference as view
from gonio.measured.dataset import select as select_sets
from gonio.plotting.page import Page, drawn_on, target_of
from gonio.resampling.difference import difference

if TYPE_CHECKING:
    import xarray as xr

EXAMPLES = (
    Example("gonio diff a.csv b.csv", "Compare two scans"),
    Example(
        "gonio diff coating.bsdf scan.csv --out difference.png", "Compare a written file with its scan, and draw it"
    ),
    Example("gonio diff a.csv b.csv --select wavelength=550", "Compare one wavelength of each"),
)


def command(
    a: Annotated[
        Path, typer.Argument(metavar="FILE", help=f"the file that is compared ({NO_PIPES})", show_default=False)
    ],
    b: Annotated[
        Path,
        typer.Argument(
            metavar="REFERENCE", help="the file it is compared with, at whose directions", show_default=False
        ),
    ],
    output: OutputOptions,
    select: Select,
    page: Page,
    out: AlsoFigure = "",
) -> None:
    """Compare two files at the directions of the second."""
    refuse_unused(page, out)
    target, suffixes = target_of(out, page.suffixes)
    first, second = _selected([read(a), read(b)], select)
    found = difference(first, second)
    output.show(view.record(found, str(a), str(b)), view.tables(found, a.name, b.name))
    if out:
        from gonio.plotting.difference import difference_figure
        from gonio.plotting.style import save

        with drawn_on(page):
            for path in save(difference_figure(found, a.name, b.name), target, suffixes, output.force):
                if output.json != "-":
                    show(f"wrote {path}")


def _selected(scans: "list[xr.Dataset]", choice: Mapping[str, str]) -> "list[xr.Dataset]":
    """Each scan reduced by what it has a coordinate for; ValueError for a coordinate that none of them has."""
    for name in choice:
        if not any(name in scan.coords for scan in scans):
            raise ValueError(f"neither file has a coordinate {name!r} to select")
    return [select_sets(scan, {n: v for n, v in choice.items() if n in scan.coords}) for scan in scans]
