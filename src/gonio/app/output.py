"""What people and programs see: tables, progress bars and JSON."""

import json
import math
import shlex
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gonio.app import talk
from gonio.files import naming, replacing
from gonio.outside import printable
from gonio.results.numbers import LEVEL, figure, uncertain

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

__all__ = [
    "LEVEL",
    "Plain",
    "command_line",
    "console",
    "emit_json",
    "faint",
    "figure",
    "finite",
    "progress_bar",
    "show",
    "strong",
    "table",
    "uncertain",
    "warn",
    "without_infinities",
]

STANDARD_OUTPUT = Path("standard output")  # what an error calls it, which may go to a file on a full disk


def command_line() -> str:
    """What was typed, as a shell takes it."""
    return shlex.join(["gonio", *sys.argv[1:]])


def console() -> "Console":
    from rich.console import Console

    return Console(highlight=False, markup=False)  # brackets in names are names, and no markup


class Plain(str):
    """Text that is printed in its own lines, however long: a path, a licence."""


def show(part: Any) -> None:
    """Print a table, a sentence, or a Plain text; characters that a terminal would obey are shown as escapes."""
    with naming(STANDARD_OUTPUT):
        if isinstance(part, Plain):
            print(printable(part, keep="\n\t"), flush=True)
        else:
            console().print(printable(part, keep="\n") if isinstance(part, str) else part)


def warn(path: Path, what: Any) -> None:
    """Say on standard error what a file's values mean for what comes."""
    talk.tell(f"gonio: {path}: {what}")


def strong(text: str, rest: str = "") -> "Text":
    """A sentence that begins in bold."""
    from rich.text import Text

    return Text.assemble((printable(text), "bold"), printable(rest))


def faint(text: str) -> "Text":
    """A sentence of less weight."""
    from rich.text import Text

    return Text(printable(text), "dim")


def emit_json(data: Any, target: str, force: bool = False) -> None:
    """Write plain data as JSON to a file, or to standard output for `-`; NaN and infinities become null."""
    text = json.dumps(without_infinities(data), indent=2, ensure_ascii=False, allow_nan=False)
    if target == "-":
        with naming(STANDARD_OUTPUT):
            print(text, flush=True)
        return
    with replacing(Path(target), force) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")


def finite(value: float) -> float | None:
    """For JSON, which has neither NaN nor infinity."""
    return value if math.isfinite(value) else None


def without_infinities(data: Any) -> Any:
    """The same plain data with NaN and infinities as None."""
    if isinstance(data, Mapping):
        return {key: without_infinities(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [without_infinities(value) for value in data]
    return finite(data) if isinstance(data, float) else data


@contextmanager
def progress_bar(description: str) -> Iterator[Callable[..., None]]:
    """A bar on standard error while work goes on, drawn only where a person looks at a terminal.

    What it yields takes the fraction that is done, and what was done last, in a word.
    """
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    terminal = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeRemainingColumn())
    disabled = talk.is_quiet() or not terminal.is_terminal
    with Progress(*columns, console=terminal, transient=True, disable=disabled) as bar:
        task = bar.add_task(description, total=1.0)

        def done(fraction: float, what: str = "") -> None:
            bar.update(task, completed=fraction, description=f"{description}: {what}" if what else description)

        yield done


def table(*headings: str, title: str = "", left: int = 1) -> "Table":
    """A table of one line a row; the first `left` columns are text, the others numbers."""
    from rich import box
    from rich.table import Table

    class Printable(Table):
        """Cells without characters that a terminal would obey."""

        def add_row(self, *cells: Any, **options: Any) -> None:
            super().add_row(*(printable(c) if isinstance(c, str) else c for c in cells), **options)

    out = Printable(
        title=printable(title) or None,
        box=box.SIMPLE_HEAD,
        title_justify="left",
        title_style="bold",
        pad_edge=False,
        padding=0,
    )
    for k, heading in enumerate(headings):
        out.add_column(printable(heading), justify="left" if k < left else "right", no_wrap=True, overflow="ellipsis")
    return out
