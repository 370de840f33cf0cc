"""`gonio info`: what a file holds and what is wrong with it."""

from gonio.app.options import OutputOptions, Scan
from gonio.app.views import file


def command(scan: Scan, output: OutputOptions) -> None:
    """Say what a file holds and what is wrong with it."""
    record = file.describe(scan)
    output.show(record, file.lines(record))
