"""`gonio reduce`: raw sheets of one sample made into a BRDF."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from gonio import convert, read
from gonio.app import arguments
from gonio.app.options import Force, Scans, To
from gonio.app.output import show
from gonio.measured.reduction import Shadow, reduce, turned
from gonio.options import Option
from gonio.resampling.conversion import in_words


@dataclass(frozen=True, kw_only=True)
class ReductionOptions:
    """What is subtracted from the readings, and which are repeats of one another."""

    phi_i: Annotated[str, Option("azimuth of the incident light on the sample, one a file", metavar="DEG,..")] = ""
    mirror: Annotated[bool, Option("average directions on both sides of the plane of incidence")] = False
    floor: Annotated[
        bool, Option("take the least signal of each scan as the detector's zero", "--subtract-floor/--keep-floor")
    ] = False
    keep_shadow: Annotated[bool, Option("keep directions where the receiver stands in the beam")] = False


def command(
    scans: Scans,
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="the file to write", show_default=False)],
    options: ReductionOptions,
    blank: Annotated[
        Path | None, typer.Option("--blank", metavar="FILE", help="a scan without sample, to subtract")
    ] = None,
    to: To = "",
    force: Force = False,
) -> None:
    """Raw sheets of one sample into a BRDF: blank subtracted, repeats averaged, with uncertainty."""
    samples, angles = [read(path) for path in scans], arguments.azimuths(options.phi_i, len(scans))
    reduced = reduce(
        [turned(*pair) for pair in zip(samples, angles, strict=True)] if angles else samples,
        None if blank is None else read(blank),
        floor=options.floor,
        shadow=None if options.keep_shadow else Shadow(),
        mirror=options.mirror,
    )
    done = convert(reduced, out, to, force=force)
    for line in reduced.attrs["history"].splitlines():
        show(line)
    show(f"wrote {done.path} as {done.format.title}, {reduced.sizes['direction']} directions")
    for line in done.left_out:
        show(f"left out: {line}")
    show(f"as the file reads now: {in_words(done.error, done.format)}")
