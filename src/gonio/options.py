"""What an option is: one setting of a dataclass, declared once, for Python, for the command line and for the pages.

    @dataclass(frozen=True, kw_only=True)
    class Example:
        noise_floor: Annotated[float, Option("below it the noise is constant", metavar="VALUE")] = 0.0

In Python that is `Example(noise_floor=0.1)`; a command that takes an Example has the flag `--noise-floor VALUE`. How
text becomes a value follows from the field's type (`gonio.app.options`). A field without an Option is for Python alone.
"""

import functools
from collections.abc import Iterable
from dataclasses import dataclass, fields, is_dataclass
from typing import Annotated, Any, get_args, get_origin, get_type_hints


@dataclass(frozen=True)
class Option:
    """The declaration of one option beside its type and default, written in the annotation of its field.

    help: what it does, in a few words. flag: on the command line, where that is not `--` and the field's name.
    metavar: how the help writes the value. of_parameters: whether its keys, or its items, name parameters of a model.
    """

    help: str
    flag: str = ""
    metavar: str = ""
    of_parameters: bool = False

    def flag_of(self, name: str) -> str:
        """The flag of the field of that name."""
        return self.flag or f"--{name.replace('_', '-')}"


@functools.cache
def declared(kind: type) -> dict[str, tuple[Any, Option | None]]:
    """The type of every field of a dataclass with its Option, None for a field that has none."""
    hints = get_type_hints(kind, include_extras=True)
    return {field.name: _split(hints[field.name]) for field in fields(kind)}


def options_of(kind: type) -> dict[str, Option]:
    """The options of a dataclass by field, those of dataclasses among its fields included."""
    found: dict[str, Option] = {}
    for name, (of, option) in declared(kind).items():
        if option:
            found[name] = option
        elif is_dataclass(of):
            found |= options_of(of)  # type: ignore[arg-type]
    return found


def one_of(names: Iterable[str]) -> str:
    """Names in a sentence: `uniform, relative or log`."""
    *most, last = names
    return f"{', '.join(most)} or {last}" if most else last


def _split(annotation: Any) -> tuple[Any, Option | None]:
    if get_origin(annotation) is not Annotated:
        return annotation, None
    of, *extras = get_args(annotation)
    return of, next((extra for extra in extras if isinstance(extra, Option)), None)
