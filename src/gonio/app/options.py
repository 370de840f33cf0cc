"""What several commands share: groups of options as dataclasses.

A command takes a dataclass as one argument; on the command line each of its fields that has an Option is a flag
(`gonio.app.flags`). So an option is declared once, in the dataclass, whatever the number of commands that have it.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import typer

from gonio.app import arguments
from gonio.app.names import formats_written, models, models_or_groups
from gonio.findings.corrections import Corrections
from gonio.options import Option, Panel
from gonio.plotting.page import Page, drawn_on, target_of

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from gonio.model import Model

NO_PIPES = "files, not pipes or -"  # which formats cannot be recognised in, as a file is opened more than once
Scan = Annotated[
    Path,
    typer.Argument(
        metavar="FILE", help=f"a measured scan, in any format of `gonio formats` ({NO_PIPES})", show_default=False
    ),
]
Scans = Annotated[
    list[Path],
    typer.Argument(
        metavar="FILE", help=f"measured scans, in any format of `gonio formats` ({NO_PIPES})", show_default=False
    ),
]
ModelName = Annotated[
    str, Option("the model to fit, one of `gonio models`", "--model", "MODEL", panel=Panel.MODEL, names=models)
]
ModelArgument = Annotated[
    str,
    typer.Argument(
        metavar="MODEL",
        help="a model of `gonio models`, or the file solution.nc of a fit",
        show_default=False,
        autocompletion=Option("", names=models).completed,
    ),
]
To = Annotated[
    str,
    Option(
        "format to write, one of `gonio formats`; without it that of the suffix",
        metavar="FORMAT",
        panel=Panel.OUTPUT,
        names=formats_written,
    ),
]
AlsoFigure = Annotated[
    str,
    Option(
        "also draw a figure: NAME.pdf, NAME.png, NAME.svg, or NAME for those of --format",
        metavar="FILE",
        panel=Panel.OUTPUT,
    ),
]
Force = Annotated[bool, Option("overwrite files that exist", panel=Panel.OUTPUT)]
Select = Annotated[
    Mapping[str, str],
    Option("use one channel, wavelength or scan only: channel=R", metavar="COORD=VALUE", panel=Panel.DATA),
]
ModelNames = Annotated[
    str,
    Option(
        "models to fit: names with commas, family (those of the paper) or all",
        metavar="A,B|family|all",
        panel=Panel.MODEL,
        names=models_or_groups,
    ),
]
Models = Annotated[
    str,
    Option(
        "fit this model, or the best of several; without it the best of all",
        "--model",
        metavar="A,B|family|all",
        panel=Panel.MODEL,
        names=models_or_groups,
    ),
]

MODELS_A_WORKER = 8  # fewer are fitted before another process has started


@dataclass(frozen=True, kw_only=True)
class OutputOptions:
    """What a command prints, and whether it may write over what is there."""

    PANEL: ClassVar = Panel.OUTPUT
    json: Annotated[
        str, Option("write the results as JSON to a file, or for - to standard output", metavar="FILE|-")
    ] = ""
    force: Force = False

    def show(self, record: Any, parts: Iterable[Any]) -> None:
        """The record as JSON where that is asked for, and the parts for people unless JSON goes to standard output."""
        from gonio.app.output import emit_json, show

        if self.json:
            emit_json(record, self.json, self.force)
        if self.json != "-":
            for part in parts:
                show(part)


class Scale(StrEnum):
    """The scale of an axis of values."""

    BOTH = "both"
    LINEAR = "linear"
    LOG = "log"

    @property
    def scales(self) -> tuple[str, ...]:
        """The scales by name, linear first."""
        return ("linear", "log") if self is Scale.BOTH else (self.value,)


@dataclass(frozen=True, kw_only=True)
class FigureOptions:
    """The page of a figure, where it goes, and whether it may be written over what is there."""

    PANEL: ClassVar = Panel.OUTPUT
    page: Page = field(default_factory=Page)
    out: Annotated[
        str, Option("file of the figure: NAME.pdf, NAME.png, NAME.svg, or NAME for those of --format", metavar="FILE")
    ] = ""
    force: Force = False

    def target(self, name: str) -> tuple[Path, tuple[str, ...]]:
        """Where the figure goes, `name` where no place is given, and its suffixes; ValueError for another suffix."""
        return target_of(self.out, self.page.suffixes) if self.out else (Path(name), self.page.suffixes)

    def save(self, draw: "Callable[[], Figure]", name: str) -> None:
        """Draw the figure for the page, write it, under `name` where no place is given, and say where it is."""
        from gonio.app.output import show
        from gonio.plotting.style import save

        target, suffixes = self.target(name)
        with drawn_on(self.page):
            for path in save(draw(), target, suffixes, self.force):
                show(f"wrote {path}")


def refuse_unused(page: Page, out: str) -> None:
    """ValueError where a page is described and no figure is written."""
    if page != Page() and not out:
        raise ValueError("the options of figures need --out, which writes one: add it, or leave them out")


@dataclass(frozen=True, kw_only=True)
class ScanOptions:
    """What mends a scan, and which part of it is used; values of options are those of the mended scan."""

    PANEL: ClassVar = Panel.DATA
    blocked: Annotated[
        float,
        Option(
            "leave out directions nearer than this to the incident beam, where the detector stands in it",
            metavar="DEG",
            lowest=0,
            highest=180,
        ),
    ] = 0.0
    floor: Annotated[str, Option("leave out values below this noise floor", metavar="VALUE")] = ""
    select: Select = field(default_factory=dict)
    corrections: Corrections = field(default_factory=Corrections)

    def refuse_for(self, path: Path, what: str) -> None:
        """ValueError where anything is asked of a scan and the path holds something else, `what`."""
        if self != ScanOptions():
            raise ValueError(f"{path}: holds {what}, and --select, masks and corrections belong to a scan")

    def read(self, path: Path, findings: bool = True) -> "xr.Dataset":
        """A scan mended, masked and reduced as asked.

        With `findings` the errors of `check` are raised and its warnings go to standard error. What is only converted
        or compared may be wrong: it is not made worse by that.
        """
        from gonio import check, read
        from gonio.app.output import warn
        from gonio.measured.check import Severity
        from gonio.measured.dataset import select
        from gonio.measured.masking import mask

        data = self.corrections.mended(select(read(path), self.select))
        if self.blocked or self.floor:
            floor = arguments.number(self.floor, "--floor") if self.floor else None
            data = mask(data, blocked=self.blocked, floor=floor)
        for finding in check(data) if findings else ():
            if finding.severity is Severity.ERROR:
                raise ValueError(f"{path}: {finding}")
            if finding.severity is Severity.WARNING:
                warn(path, finding)
        return data

    def read_joint(self, paths: list[Path], joint: bool) -> "xr.Dataset":
        """The one scan, or several joined under the names of their files."""
        from gonio import join

        scans = [self.read(path) for path in paths]
        if len(scans) == 1:
            return scans[0]
        if not joint:
            raise ValueError(f"{len(scans)} scans are given: add --joint to fit them together, or fit one at a time")
        names = [path.stem for path in paths]
        if len(set(names)) < len(names):
            names = [str(path) for path in paths]
        if len(set(names)) < len(names):
            raise ValueError("a scan is given twice")
        return join(dict(zip(names, scans, strict=True)))


def chosen_models(names: str) -> "list[Model]":
    """Models by name, the paper's family, or all of them."""
    from gonio import catalogue
    from gonio.comparison.ranking import FAMILY

    if names == "all":
        return list(catalogue.values())
    if names == "family":
        return [catalogue[name] for name in FAMILY]
    return [catalogue[name] for name in arguments.listed(names)]


def processes(asked: int, models: int) -> int:
    """The number of processes: what was asked for, or for 0 every core that this many models keep busy."""
    from gonio.processes.portable import cores

    return asked or max(min(cores(), models // MODELS_A_WORKER), 1)
