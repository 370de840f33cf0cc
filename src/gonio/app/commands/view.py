"""`gonio view`: scans and fits on a page that answers at once."""

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

import typer

from gonio import catalogue
from gonio.app import names, talk
from gonio.app.help_page import Example
from gonio.app.model_options import ValueOptions
from gonio.app.options import Force, ScanOptions, Scans
from gonio.app.output import Plain, progress_bar, show
from gonio.door.json_text import load
from gonio.fitting.solution import Solution
from gonio.fitting.stored import SOLUTION_FILE, is_solution
from gonio.options import Option, Panel
from gonio.outside import nearest

if TYPE_CHECKING:
    from gonio.viewing.session import Opened, Session

UNITS = {"s": 1.0, "m": 60.0, "min": 60.0, "h": 3600.0}
EXAMPLES = (
    Example("gonio view scan.csv", "Open the scan in a browser, with a model whose sliders move its curve"),
    Example("gonio view scan.csv --solution results", "The same with a fit, its band and its uncertainties"),
    Example("gonio view results --out page.html", "One file that opens anywhere, without gonio"),
    Example("gonio view --diff before.csv after.csv", "Two scans, and how they differ"),
)


@dataclass(frozen=True, kw_only=True)
class ViewOptions:
    """What is shown, and how the page is served."""

    PANEL: ClassVar = Panel.OUTPUT
    solution: Annotated[
        tuple[str, ...],
        Option("a fit of the scan: solution.nc or its folder", metavar="FILE", panel=Panel.MODEL),
    ] = ()
    model: Annotated[str, Option("the model to begin with", metavar="MODEL", panel=Panel.MODEL, names=names.models)] = (
        ""
    )
    diff: Annotated[bool, Option("show how the first two files differ", panel=Panel.DATA)] = False
    out: Annotated[str, Option("write the page to a file instead of serving it", metavar="PAGE.html")] = ""
    no_browser: Annotated[bool, Option("print the address, and open no browser")] = False
    state: Annotated[str, Option("begin as a page was: the state.json of its Share", metavar="FILE")] = ""
    port: Annotated[
        int, Option("the port to listen at; without it one that is free", metavar="N", lowest=0, highest=65535)
    ] = 0
    host: Annotated[str, Option("the address to listen at; another than this machine's needs --expose")] = "127.0.0.1"
    expose: Annotated[bool, Option("let other machines in")] = False
    idle: Annotated[str, Option("end when nobody has asked for so long: 30m, 90s, 2h", metavar="TIME")] = ""
    upload_limit: Annotated[float, Option("largest file that the page may open, in MB", metavar="MB", above=0)] = 256.0
    force: Force = False


def command(files: Scans, view: ViewOptions, values: ValueOptions, used: ScanOptions) -> None:
    """Look at scans and fits on a page: sliders, curves, hemispheres.

    The model is fitted to a scan that comes without a fit, unless values are given. The page is served to this machine
    alone, and needs no network. It ends with Ctrl-C.
    """
    idle = _seconds(view.idle)
    session = _session(files, view, values, used)
    session.refuse_unshown()
    if view.out:
        _write(session, view)
        return
    from gonio.viewing.serving.running import Serving, serve

    def ready(address: str) -> None:
        show(Plain(address))
        if not view.no_browser:
            typer.launch(address)

    serving = Serving(view.port, view.host, view.expose, idle, int(view.upload_limit * 2**20))
    serve(session, serving, ready, talk.tell)


def _seconds(text: str) -> float:
    """A time such as `30m` in seconds, 0 for none."""
    if not text:
        return 0.0
    match = re.fullmatch(r"(\d+(?:\.\d+)?)\s*(s|m|min|h)", text.strip())
    if not match or not float(match[1]):
        raise ValueError(f"--idle {text!r} is no time: write 30m, 90s or 2h")
    return float(match[1]) * UNITS[match[2]]


def _write(session: "Session", view: ViewOptions) -> None:
    from gonio.viewing.assembled import in_one_file, refuse_unwritable, written
    from gonio.viewing.working.beginning import fit_first

    path = Path(view.out)
    refuse_unwritable(path, view.force)
    with progress_bar("fitting") as progress:
        failed = fit_first(session, told=progress)
    for words in failed:
        talk.tell(f"gonio: warning: {words}")
    show(f"wrote {written(in_one_file(session, session.needed()), path, view.force)}")


def _session(files: list[Path], view: ViewOptions, values: ValueOptions, used: ScanOptions) -> "Session":
    from gonio.viewing.session import FIRST, Session

    if view.model and view.model not in catalogue:
        raise ValueError(f"{view.model}: there is no such model; {nearest(view.model, catalogue)}")
    given = _given(view.model or FIRST, values)
    opened = [_opened(path, used) for path in files]
    for name in view.solution:
        solution = _fit_in(Path(name))
        if solution is None:
            raise ValueError(f"{name}: holds no fit: give what gonio fit --out writes")
        opened[0].fits[_called(Path(name))] = solution
    if view.diff and len(opened) < 2:
        raise ValueError("--diff compares two files: name both")
    return Session(
        opened,
        model=view.model or FIRST,
        values=given,
        pair=(0, 1) if view.diff else (),
        begin_with_model=bool(view.model),
        state=load(Path(view.state)).value if view.state else {},
    )


def _given(name: str, values: ValueOptions) -> dict[str, float]:
    """The values that the model begins with; ValueError for a parameter that it lacks, or beyond its bounds."""
    model, given = catalogue[name], values.values()
    for parameter, value in given.items():
        if parameter not in model.parameters:
            raise ValueError(f"{name} has no parameter {parameter!r}; it has {', '.join(model.parameters)}")
        lower, upper = (0.0, math.inf)
        if parameter in model.shape:
            lower, upper = model.shape[parameter].lower, model.shape[parameter].upper
        if not lower <= value <= upper:
            raise ValueError(f"{parameter} is {value:g}: {name} takes {lower:g} to {upper:g}")
    return given


def _opened(path: Path, used: ScanOptions) -> "Opened":
    from gonio.viewing.session import Opened

    solution: Solution | None = _fit_in(path)
    if solution is None:
        return Opened(path.name, used.read(path))
    used.refuse_for(path, "a fit")
    if not solution.has_scan:
        raise ValueError(f"{path}: holds a fit without its scan: give the scan, and the fit by --solution")
    return Opened(path.name, solution.scan, {_called(path): solution})


def _called(path: Path) -> str:
    return path.parent.name or path.name if path.name == SOLUTION_FILE else path.name


def _fit_in(path: Path) -> Solution | None:
    """The fit in a file, or in a folder that `gonio fit --out` wrote; None where the path holds something else."""
    inside = path / SOLUTION_FILE
    file = inside if inside.is_file() else path
    return Solution.load(file) if is_solution(file) else None
