"""`gonio info`: what a file holds and what is wrong with it."""

from gonio.app.options import OutputOptions, Scan
from gonio.app.views import contents


def command(scan: Scan, output: OutputOptions) -> None:
    """Say what a file holds and what is wrong with it: a scan, a stack of scans, or a fit."""
    output.show(*contents.described(scan))
