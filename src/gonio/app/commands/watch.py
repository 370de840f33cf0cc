"""`gonio watch`: the readings of a journal drawn while another process writes it."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gonio.acquisition import read_journal, readings
from gonio.app.help_page import Example
from gonio.app.options import Force
from gonio.app.output import show
from gonio.options import Option, Panel
from gonio.plotting.page import Page, drawn_on, target_of

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from gonio.acquisition.journal import Content

EXAMPLES = (
    Example("gonio watch run.jsonl --once now.png", "Draw what is measured so far"),
    Example("gonio watch run.jsonl --once report.pdf --size 120x90mm", "The same for a report"),
    Example("gonio watch run.jsonl --once now.svg --force", "Over the figure of before"),
)


def command(
    journal: Annotated[
        Path, typer.Argument(metavar="RUN.jsonl", help="the journal of gonio measure", show_default=False)
    ],
    page: Page,
    once: Annotated[
        str, Option("draw once, to this file, instead of in a window", metavar="FILE", panel=Panel.OUTPUT)
    ] = "",
    every: Annotated[
        float, Option("time between two looks at the journal", metavar="S", above=0, panel=Panel.FIGURE)
    ] = 2.0,
    force: Force = False,
) -> None:
    """Watch a measurement: signals, and what should be steady.

    The journal is read and not touched, so the measurement knows nothing of it. Without --once a window is redrawn when
    there is something new, until it is closed; that needs a display and one of Matplotlib's window toolkits.
    """
    if once:
        _draw_once(journal, once, page, force)
    else:
        _in_a_window(journal, every)


def _progress(content: "Content") -> str:
    return f"{len(content.done)} of {len(content.plan.steps)} steps"


def _draw_once(journal: Path, once: str, page: Page, force: bool) -> None:
    from gonio.plotting.measuring import readings_figure
    from gonio.plotting.style import save

    target, suffixes = target_of(once, page.suffixes)
    content = read_journal(journal)
    raw = readings(content)
    with drawn_on(page):
        for path in save(readings_figure(raw, _progress(content)), target, suffixes, force):
            show(f"wrote {path}: {raw.sizes['reading']} readings, {_progress(content)}")


def _in_a_window(journal: Path, every: float) -> None:
    import matplotlib.pyplot as plt

    figure, seen = plt.figure(figsize=(7.2, 5.6), layout="constrained"), -1
    if type(figure.canvas).required_interactive_framework is None:  # a canvas that only writes files
        plt.close(figure)
        raise ValueError("there is no window to draw in: give --once FILE, or install PyQt or Tk and use a display")
    while plt.fignum_exists(figure.number):
        content = read_journal(journal)
        if len(content.records) > seen:
            _redraw(figure, content)
            seen = len(content.records)
        plt.pause(every)


def _redraw(figure: "Figure", content: "Content") -> None:
    from gonio.plotting.measuring import draw_readings

    figure.clear()
    if any("kind" in record for record in content.records):
        draw_readings(figure, readings(content), _progress(content))
