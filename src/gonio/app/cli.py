"""The command line: each command is a few lines around library calls."""

import sys
import warnings
from pathlib import Path
from typing import Annotated, Any

import typer

from gonio.app import conversion, fetching, fits, models, stacks  # noqa: F401 - their commands register themselves
from gonio.app.options import Force, Json, Scan, Seed
from gonio.app.terminal import app


@app.command("info")
def describe(scan: Scan, json: Json = "", force: Force = False) -> None:
    """Say what a file holds and what is wrong with it."""
    from gonio.app import inspection, present

    record = inspection.describe(scan)
    if json:
        present.emit_json(record, json, force)
    if json != "-":
        for part in inspection.tables(record):
            present.console().print(part)


@app.command("demo")
def run_demo(
    out: Annotated[str, typer.Option("--out", metavar="DIR", help="where the page and the tables go")] = "demo",
    seed: Seed = 2023,
    force: Force = False,
) -> None:
    """Run the paper's study and write it as one page."""
    from gonio.app import present
    from gonio.app.report.demo import write_demo

    with present.progress_bar("the paper's study") as progress:
        page = write_demo(Path(out), seed=seed, force=force, progress=progress)
    present.console().print(f"wrote {page}")


def _warn(message: Warning | str, *_: Any, **__: Any) -> None:
    print(f"gonio: {message}", file=sys.stderr)


def main() -> None:
    """Run the command line; whatever is wrong with the input is one line on standard error and exit code 1."""
    warnings.showwarning = _warn
    try:
        app()
    except (ValueError, KeyError, OSError) as error:
        message = error.args[0] if isinstance(error, KeyError) and error.args else error
        print(f"gonio: {message}", file=sys.stderr)
        sys.exit(1)
