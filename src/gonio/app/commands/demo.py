"""`gonio demo`: the paper's study as one page."""

from pathlib import Path
from typing import Annotated

from gonio.app.help_page import Example
from gonio.app.options import Force
from gonio.app.output import progress_bar, show
from gonio.app.report.demo import write_demo
from gonio.options import Option, Panel

EXAMPLES = (
    Example("gonio demo", "Write the page to demo/index.html"),
    Example("gonio demo --out study", "Write it to another folder"),
    Example("gonio demo --out study --seed 7 --force", "Repeat the study with other random noise"),
)


def command(
    out: Annotated[str, Option("folder of the page and its tables", metavar="DIR", panel=Panel.OUTPUT)] = "demo",
    seed: Annotated[int, Option("seed of the random numbers", panel=Panel.SOLVER, lowest=0)] = 2023,
    force: Force = False,
) -> None:
    """Run the paper's study and write it as one page."""
    with progress_bar("the paper's study") as progress:
        page = write_demo(Path(out), seed=seed, force=force, progress=progress)
    show(f"wrote {page}")
