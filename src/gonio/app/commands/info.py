"""`gonio info`: what a file holds and what is wrong with it."""

from dataclasses import dataclass
from typing import Annotated, ClassVar

from gonio.app.help_page import Example
from gonio.app.options import OutputOptions, Scan, ScanOptions
from gonio.app.views import contents
from gonio.options import Option, Panel

EXAMPLES = (
    Example("gonio info scan.csv", "What a scan holds, and whether something is wrong with it"),
    Example("gonio info coating.bsdf --json -", "The same of any format, for a program"),
    Example("gonio info results/solution.nc", "What a fit found"),
    Example("gonio info run.jsonl", "How far a measurement is, and the command that goes on with it"),
)


@dataclass(frozen=True, kw_only=True)
class InfoOptions:
    """What is told besides."""

    PANEL: ClassVar = Panel.OUTPUT
    gamma: Annotated[bool, Option("also the half width that the paper reads behind the normal, gamma")] = False


def command(scan: Scan, used: ScanOptions, info: InfoOptions, output: OutputOptions) -> None:
    """Say what a file holds and what is wrong with it.

    The file may be a scan, a stack of scans, a fit, the fits of a stack, the journal of a measurement, or raw readings.
    """
    output.show(*contents.described(scan, used, info.gamma))
