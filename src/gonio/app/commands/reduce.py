"""`gonio reduce`: raw sheets of one sample made into a BRDF."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from gonio import convert, read
from gonio.app import arguments
from gonio.app.help_page import Example
from gonio.app.options import Force, Scans, To
from gonio.app.output import show
from gonio.measured.reduction import Shadow, reduce, turned
from gonio.options import Option, Panel
from gonio.resampling.conversion import in_words

EXAMPLES = (
    Example("gonio reduce one.csv two.csv --out scan.csv", "Average repeats, with the uncertainty of their mean"),
    Example("gonio reduce one.csv --blank blank.csv --out scan.nc", "Subtract what is measured without a sample"),
    Example(
        "gonio reduce one.csv two.csv --mirror --out mean.csv", "Average both sides of the plane of incidence as well"
    ),
)


@dataclass(frozen=True, kw_only=True)
class ReductionOptions:
    """What is subtracted from the readings, and which are repeats of one another."""

    PANEL: ClassVar = Panel.REDUCTION
    phi_i: Annotated[
        str, Option("azimuth of the incident light on the sample, one for each file, with commas", metavar="DEG,..")
    ] = ""
    mirror: Annotated[bool, Option("average directions on both sides of the plane of incidence")] = False
    floor: Annotated[
        bool,
        Option("subtract the least signal of each scan, as the detector's zero", "--subtract-floor/--keep-floor"),
    ] = False
    keep_shadow: Annotated[bool, Option("keep directions where the receiver stands in the beam")] = False


def command(
    scans: Scans,
    out: Annotated[Path, Option("the file to write", metavar="FILE", panel=Panel.OUTPUT)],
    options: ReductionOptions,
    blank: Annotated[
        Path | None, Option("subtract this scan, measured without a sample", metavar="FILE", panel=Panel.REDUCTION)
    ] = None,
    to: To = "",
    force: Force = False,
) -> None:
    """Make one BRDF with uncertainty of the raw scans of a sample."""
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
