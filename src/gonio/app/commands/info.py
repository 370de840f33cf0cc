"""`gonio info`: what a file holds and what is wrong with it."""

from typing import Annotated

import typer

from gonio.app.options import OutputOptions, Scan, ScanOptions
from gonio.app.views import contents


def command(
    scan: Scan,
    used: ScanOptions,
    output: OutputOptions,
    gamma: Annotated[bool, typer.Option("--gamma", help="the paper's gamma too, read behind the normal")] = False,
) -> None:
    """Say what a file holds and what is wrong with it: a scan, a stack of scans, or a fit."""
    output.show(*contents.described(scan, used, gamma))
