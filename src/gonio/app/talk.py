"""How much a command tells on standard error: its errors alone, the usual, or every step.

What is told at each step is logged by the libraries of gonio under the name `gonio`, so that a script has it from
`logging` as well.
"""

import sys
from enum import IntEnum
from typing import Annotated

import typer

from gonio.options import Panel
from gonio.outside import printable

Verbose = Annotated[
    bool,
    typer.Option(
        "--verbose", "-v", help="tell each step, such as files read and fits made", rich_help_panel=Panel.GENERAL
    ),
]
Quiet = Annotated[
    bool,
    typer.Option(
        "--quiet", "-q", help="print results and errors only: no progress, no warnings", rich_help_panel=Panel.GENERAL
    ),
]


class Level(IntEnum):
    """How much is told."""

    QUIET = 0
    USUAL = 1
    VERBOSE = 2


_level = Level.USUAL


def choose(verbose: bool, quiet: bool) -> None:
    """The level that the two options ask for; ValueError where both are given."""
    global _level
    if verbose and quiet:
        raise ValueError("--verbose and --quiet contradict each other: give one of them")
    _level = Level.VERBOSE if verbose else Level.QUIET if quiet else Level.USUAL
    if verbose:
        _tell_what_is_logged()


def is_quiet() -> bool:
    """Whether only results and errors are printed."""
    return _level is Level.QUIET


def tell(line: str) -> None:
    """One line on standard error, unless that is to be quiet."""
    if not is_quiet():
        print(printable(line), file=sys.stderr, flush=True)


def _tell_what_is_logged() -> None:
    import logging

    class Told(logging.Handler):
        """Writes to what standard error is at that moment: a progress bar stands in for it while it is drawn."""

        def emit(self, record: logging.LogRecord) -> None:
            if _level is Level.VERBOSE:
                tell(f"gonio: {record.getMessage()}")

    logger = logging.getLogger("gonio")
    logger.setLevel(logging.INFO)
    logger.handlers = [Told()]
