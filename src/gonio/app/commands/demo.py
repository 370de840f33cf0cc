"""`gonio demo`: the paper's study as one page."""

from pathlib import Path
from typing import Annotated

import typer

from gonio.app.options import Force
from gonio.app.output import progress_bar, show
from gonio.app.report.demo import write_demo


def command(
    out: Annotated[str, typer.Option("--out", metavar="DIR", help="where the page and the tables go")] = "demo",
    seed: Annotated[int, typer.Option("--seed", min=0, help="seed of the random numbers")] = 2023,
    force: Force = False,
) -> None:
    """Run the paper's study and write it as one page."""
    with progress_bar("the paper's study") as progress:
        page = write_demo(Path(out), seed=seed, force=force, progress=progress)
    show(f"wrote {page}")
