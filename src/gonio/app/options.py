"""What several commands share: groups of options as dataclasses, and the decorator that makes flags of their fields.

A command takes a dataclass as one argument; on the command line each of its fields that has an Option is a flag. So an
option is declared once, in the dataclass, whatever the number of commands that have it.
"""

import functools
import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, Field, dataclass, field, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, get_type_hints

import typer

from gonio.app import arguments
from gonio.findings.corrections import Corrections
from gonio.options import Option, declared

if TYPE_CHECKING:
    import xarray as xr

    from gonio.model import Model

NO_PIPES = "files, not pipes or -"  # which formats cannot be recognised in, as a file is opened more than once
Scan = Annotated[
    Path,
    typer.Argument(help=f"a measured scan, in any format of `gonio formats` ({NO_PIPES})", show_default=False),
]
Scans = Annotated[
    list[Path],
    typer.Argument(help=f"measured scans, in any format of `gonio formats` ({NO_PIPES})", show_default=False),
]
ModelName = Annotated[str, typer.Option("--model", help="a model of `gonio models`", show_default=False)]
ModelArgument = Annotated[str, typer.Argument(help="a model of `gonio models`", show_default=False)]
To = Annotated[str, typer.Option("--to", metavar="FORMAT", help="a format of `gonio formats`; else by the suffix")]

Force = Annotated[bool, typer.Option("--force", help="overwrite what is there")]
Select = Annotated[list[str], typer.Option("--select", metavar="COORD=VALUE", help="one channel or wavelength")]

MOST_CHARACTERS = 1000  # of a text that may be the name of a file
MODELS_A_WORKER = 8  # fewer are fitted before another process has started


@dataclass(frozen=True, kw_only=True)
class OutputOptions:
    """What a command prints, and whether it may write over what is there."""

    json: Annotated[str, Option("write JSON to a file, or to standard output", metavar="FILE|-")] = ""
    force: Annotated[bool, Option("overwrite what is there")] = False

    def show(self, record: Any, parts: Iterable[Any]) -> None:
        """The record as JSON where that is asked for, and the parts for people unless JSON goes to standard output."""
        from gonio.app.output import emit_json, show

        if self.json:
            emit_json(record, self.json, self.force)
        if self.json != "-":
            for part in parts:
                show(part)


@dataclass(frozen=True, kw_only=True)
class FigureOptions:
    """Where a figure goes, and whether it may be written over what is there."""

    out: Annotated[str, Option(".png, .svg, or a name for both", metavar="FILE")] = ""
    force: Annotated[bool, Option("overwrite what is there")] = False

    def save(self, figure: Any, name: str) -> None:
        """Write the figure, under `name` where no place is given, and say where it is."""
        from gonio.app.output import show
        from gonio.plotting.style import save

        target, suffixes = arguments.figure_target(self.out or name)
        for path in save(figure, target, suffixes, self.force):
            show(f"wrote {path}")


@dataclass(frozen=True, kw_only=True)
class ScanOptions:
    """What mends a scan, and which part of it is used; values of options are those of the mended scan."""

    blocked: Annotated[float, Option("mask directions this near to the beam", metavar="DEG")] = 0.0
    floor: Annotated[str, Option("mask values below this noise floor", metavar="VALUE")] = ""
    select: Annotated[Mapping[str, str], Option("one channel or wavelength", metavar="COORD=VALUE")] = field(
        default_factory=dict
    )
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
    from gonio.portable import cores

    return asked or max(min(cores(), models // MODELS_A_WORKER), 1)


class _Flag(NamedTuple):
    """One field of a dataclass as a flag: its name, its type as Typer reads it, its default, how text is read."""

    name: str
    annotation: Any
    default: Any
    value: Callable[[Any], Any]


OUTPUTS = ("out", "json")  # the flags and arguments of all commands that name what is written


STANDARD_STREAM = "-"


def refuse_standard_streams(given: Mapping[str, Any]) -> None:
    """ValueError where `-` stands for a file: only JSON goes to standard output, and nothing is read from input.

    given: the values of the command line by name.
    """
    for name, value in given.items():
        named = value if isinstance(value, list | tuple) else [value]
        if name != "json" and any(str(one) == STANDARD_STREAM for one in named):
            if name == "out":
                raise ValueError("the output is '-', and only --json writes to standard output: name a file")
            raise ValueError("'-' is no file, and gonio reads no standard input: save what it holds as a file first")


def refuse_to_overwrite_inputs(given: Mapping[str, Any], in_place: str = "") -> None:
    """ValueError where what a command writes is what it reads, or lies inside or around it, whatever --force says.

    FileNotFoundError where it would lie in a folder that is not there. Both are told before the work is done.
    given: the values of the command line by name. in_place: the argument that an output may be, where a command
    changes a file.
    """
    from gonio.files import refuse_no_folder, refuse_overlap

    outputs = {name: given[name] for name in OUTPUTS if given.get(name) and str(given[name]) != "-"}
    read = {name: _paths(value) for name, value in given.items() if name not in OUTPUTS}
    for name, target in outputs.items():
        # The name of a figure may come without its suffix.
        for path in (Path(str(target) + suffix) for suffix in ("", ".png", ".svg")):
            inputs = [p for other, some in read.items() for p in some if other != in_place or not _are_one(p, path)]
            refuse_overlap(path, inputs)
        for other, second in outputs.items():
            if other < name and Path(second).resolve() == Path(target).resolve():
                raise ValueError(f"--{other} and --{name} both name {target}: give two names")
        refuse_no_folder(Path(target))


def _are_one(path: Path, other: Path) -> bool:
    return path.resolve() == other.resolve()


def _paths(value: Any) -> list[Path]:
    """What a value of the command line names that is there: a file may be given where a name may stand."""
    texts = value if isinstance(value, list | tuple) else [value]
    paths = [Path(text) for text in texts if isinstance(text, str | Path) and str(text)]
    return [path for path in paths if len(str(path)) < MOST_CHARACTERS and path.exists()]


def with_options(command: Callable[..., None], in_place: str = "") -> Callable[..., None]:
    """The command with a flag for each Option of the dataclasses that are its arguments.

    in_place: the argument that the output of the command may be.
    """
    hints = get_type_hints(command, include_extras=True)
    signature, groups, parameters = inspect.signature(command), {}, []
    for name, parameter in signature.parameters.items():
        if is_dataclass(hints[name]):
            groups[name] = flags = list(_flags(hints[name]))
            parameters += [_parameter(flag.name, flag.annotation, flag.default) for flag in flags]
        else:
            parameters.append(_parameter(name, hints[name], parameter.default))

    @functools.wraps(command)
    def call(**given: Any) -> None:
        refuse_standard_streams(given)
        refuse_to_overwrite_inputs(given, in_place)
        built = {
            name: _built(hints[name], {f.name: f.value(given.pop(f.name)) for f in flags})
            for name, flags in groups.items()
        }
        try:
            command(**given, **built)
        except EOFError as error:  # which Typer would take for the end of standard input, and say no more than Aborted
            raise OSError(f"something ended before it was complete: {error or 'a file'}") from error

    call.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    call.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return call


def _parameter(name: str, annotation: Any, default: Any) -> inspect.Parameter:
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, annotation=annotation, default=default)


def _flags(kind: type) -> Iterable[_Flag]:
    """The flags of a dataclass, those of dataclasses among its fields included."""
    for one in fields(kind):
        of, option = declared(kind)[one.name]
        if option is None:
            if is_dataclass(of):
                yield from _flags(of)  # type: ignore[arg-type]
            continue
        flag = option.flag_of(one.name)
        text = arguments.TEXTS.get(of)
        typed, read = (text.typed, functools.partial(text.read, option=flag)) if text else (of, lambda value: value)
        default = [] if text else _default(one)
        declaration = typer.Option(flag, metavar=option.metavar or None, help=option.help, show_default=not text)
        yield _Flag(one.name, Annotated[typed, declaration], default, read)


def _default(one: Field[Any]) -> Any:
    return one.default_factory() if one.default_factory is not MISSING else one.default


def _built(kind: Any, given: dict[str, Any]) -> Any:
    """The dataclass from values by field, those of dataclasses among its fields included."""
    own = {}
    for name, (of, option) in declared(kind).items():
        if option is not None:
            own[name] = given[name]
        elif is_dataclass(of):
            own[name] = _built(of, given)
    return kind(**own)
