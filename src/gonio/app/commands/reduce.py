"""`gonio reduce`: raw sheets of one sample made into a BRDF."""

from pathlib import Path
from typing import Annotated

import typer

from gonio import convert, read
from gonio.app.options import Force, Scans, To
from gonio.app.output import show
from gonio.measured.reduction import Shadow, reduce
from gonio.resampling.conversion import in_words


def command(
    scans: Scans,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="the file to write", show_default=False)],
    blank: Annotated[
        Path | None, typer.Option("--blank", metavar="FILE", help="a scan without sample, to subtract")
    ] = None,
    keep_floor: Annotated[
        bool, typer.Option("--keep-floor", help="do not subtract the least signal, the detector's zero")
    ] = False,
    keep_shadow: Annotated[
        bool, typer.Option("--keep-shadow", help="keep directions where the receiver stands in the beam")
    ] = False,
    to: To = "",
    force: Force = False,
) -> None:
    """Raw sheets of one sample into a BRDF: blank subtracted, repeats and mirror images averaged, with uncertainty."""
    reduced = reduce(
        [read(path) for path in scans],
        None if blank is None else read(blank),
        floor=not keep_floor,
        shadow=None if keep_shadow else Shadow(),
    )
    done = convert(reduced, out, to, force=force)
    for line in reduced.attrs["history"].splitlines():
        show(line)
    show(f"wrote {done.path} as {done.format.title}, {reduced.sizes['direction']} directions")
    for line in done.left_out:
        show(f"left out: {line}")
    show(f"as the file reads now: {in_words(done.error)}")
