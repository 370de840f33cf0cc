"""`gonio stack`: files of scans made into one stack, which `gonio fit-stack` fits."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

import typer

from gonio.app.help_page import Example
from gonio.app.options import NO_PIPES, OutputOptions, ScanOptions
from gonio.app.output import progress_bar
from gonio.app.views.stacks import made as view
from gonio.files import refuse_existing
from gonio.options import Option, Panel
from gonio.stacking import stack as make_stack

EXAMPLES = (
    Example("gonio stack wafers --out wafers.zarr", "All scans in a folder, under the names of their files"),
    Example("gonio stack one.csv two.csv --out pair.zarr", "These files, in this order"),
    Example(
        "gonio stack a.csv one.csv --select wavelength=650 --out red.zarr --resample",
        "One wavelength of each, at the directions of the first",
    ),
)


@dataclass(frozen=True, kw_only=True)
class CommonDirections:
    """At which directions all scans are taken, where theirs differ."""

    PANEL: ClassVar = Panel.RESAMPLING
    onto: Annotated[Path | None, Option("take all scans at the directions of this file", metavar="FILE")] = None
    resample: Annotated[bool, Option("take all scans at the directions of the first", flag="--resample")] = False


def command(
    scans: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE|FOLDER",
            help=f"measured scans, in any format of `gonio formats` ({NO_PIPES}), or folders of them",
            show_default=False,
        ),
    ],
    out: Annotated[Path, Option("the stack to write", metavar="STACK.zarr", panel=Panel.OUTPUT)],
    used: ScanOptions,
    directions: CommonDirections,
    output: OutputOptions,
) -> None:
    """Make one stack of many scans, for fit-stack.

    A folder stands for all files in it that can be read, in the order of their names (s2 before s10). The stack keeps
    the names of the files, without suffix, as its coordinate sample; where two are alike, their paths.

    All scans need the same directions, wavelengths or channels, and unit. Others are refused, with the first place
    where they differ. --resample and --onto interpolate between measured directions; outside are gaps, and the error
    is kept in the history of the stack. Masked values become gaps.
    """
    if output.json not in ("", "-"):
        refuse_existing(Path(output.json), output.force)
    with progress_bar("stacking") as bar:
        done = make_stack(
            scans,
            out,
            onto=directions.onto,
            resample=directions.resample,
            read=lambda path: used.read(path, findings=False),
            force=output.force,
            progress=bar,
        )
    view.warn_of_skipped(done)
    output.show(view.record(done), view.lines(done))
