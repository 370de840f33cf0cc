"""`gonio info`: what a file holds and what is wrong with it."""

from gonio.app.help_page import Example
from gonio.app.options import OutputOptions, Scan
from gonio.app.views import contents

EXAMPLES = (
    Example("gonio info scan.csv", "What a scan holds, and whether something is wrong with it"),
    Example("gonio info coating.bsdf --json -", "The same of any format, for a program"),
    Example("gonio info results/solution.nc", "What a fit found"),
)


def command(scan: Scan, output: OutputOptions) -> None:
    """Say what a file holds and what is wrong with it.

    The file may be a scan, a stack of scans, or a fit.
    """
    output.show(*contents.described(scan))
