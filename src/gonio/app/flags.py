"""Options declared in dataclasses as flags of a command, and what every command refuses before it begins."""

import functools
import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, NamedTuple, get_args, get_type_hints

import typer

from gonio.app import arguments, talk
from gonio.options import Option, Panel, declared, split

MOST_CHARACTERS = 1000  # of a text that may be the name of a file
NUMBERS = (int, float, int | None, float | None)
# How the help writes a value of a type, where its option says nothing else.
METAVARS: Mapping[Any, str] = {int: "N", float: "VALUE", str: "NAME", Path: "FILE"}


class _Flag(NamedTuple):
    """One option as a flag: its name, its type as Typer reads it, its default, how text is read."""

    name: str
    annotation: Any
    default: Any
    value: Callable[[Any], Any]


OUTPUTS = ("out", "json", "predict")  # the flags and arguments of all commands that name what is written


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
        for path in (Path(str(target) + suffix) for suffix in ("", ".pdf", ".png", ".svg")):
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
    return [path for path in paths if len(str(path)) < MOST_CHARACTERS and _is_there(path)]


def _is_there(path: Path) -> bool:
    try:
        return path.exists()
    except OSError:  # a text that no file can be called, such as a long title
        return False


def with_options(command: Callable[..., None], in_place: str = "") -> Callable[..., None]:
    """The command with a flag for each of its arguments that has an Option, and for each field of its dataclasses.

    in_place: the argument that the output of the command may be. Besides every command takes `--verbose` and `--quiet`.
    """
    hints = get_type_hints(command, include_extras=True)
    signature, groups, own, parameters = inspect.signature(command), {}, [], []
    for name, parameter in signature.parameters.items():
        of, option = split(hints[name])
        if is_dataclass(of):
            groups[name] = flags = list(_flags(of))  # type: ignore[arg-type]
        elif option:
            flags = [_flag(name, of, option, parameter.default)]
            own += flags
        else:
            flags = [_Flag(name, hints[name], parameter.default, lambda value: value)]
        parameters += [_parameter(flag.name, flag.annotation, flag.default) for flag in flags]
    parameters += [_parameter("verbose", talk.Verbose, False), _parameter("quiet", talk.Quiet, False)]

    @functools.wraps(command)
    def call(verbose: bool, quiet: bool, **given: Any) -> None:
        if verbose or quiet:
            talk.choose(verbose, quiet)
        refuse_standard_streams(given)
        refuse_to_overwrite_inputs(given, in_place)
        built = {
            name: _built(hints[name], {f.name: f.value(given.pop(f.name)) for f in flags})
            for name, flags in groups.items()
        }
        built |= {flag.name: flag.value(given.pop(flag.name)) for flag in own}
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
        if option is not None:
            yield _flag(one.name, of, option, _default(one), getattr(kind, "PANEL", None))
        elif is_dataclass(of):
            yield from _flags(of)  # type: ignore[arg-type]


def _flag(name: str, of: Any, option: Option, default: Any, panel: Panel | None = None) -> _Flag:
    """An option as a flag, in the panel of its dataclass unless it names another."""
    flag = option.flag_of(name)
    text = arguments.TEXTS.get(of)
    typed: Any = of
    read: Callable[[Any], Any] = lambda value: value  # noqa: E731
    if text:
        typed, read, default = text.typed, functools.partial(text.read, option=flag), []
    elif of in NUMBERS:
        read = functools.partial(_within, option, flag)
    declaration = typer.Option(
        flag,
        metavar=option.metavar or _metavar(of),
        help=f"{option.help} ({option.range})" if option.range else option.help,
        show_default=not text,
        rich_help_panel=option.panel or panel,
        autocompletion=option.completed if option.names else None,
    )
    return _Flag(name, Annotated[typed, declaration], default, read)


def _within(option: Option, flag: str, value: float | None) -> float | None:
    return None if value is None else option.within(value, flag)


def _metavar(of: Any) -> str | None:
    """How the help writes a value of a type; None for a truth, which has none."""
    kind = next((kind for kind in get_args(of) if kind is not type(None)), of)
    if isinstance(kind, type) and issubclass(kind, StrEnum):
        return "|".join(kind)
    return METAVARS.get(kind)


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
