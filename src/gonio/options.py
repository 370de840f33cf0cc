"""What an option is: one setting of a dataclass, declared once, for Python, for the command line and for the pages.

    @dataclass(frozen=True, kw_only=True)
    class Example:
        PANEL: ClassVar = Panel.WEIGHTS
        noise_floor: Annotated[float, Option("below it the noise is constant", metavar="VALUE", lowest=0)] = 0.0

In Python that is `Example(noise_floor=0.1)`; a command that takes an Example has the flag `--noise-floor VALUE`, which
its help lists under Weights. How text becomes a value follows from the field's type (`gonio.app.options`). A field
without an Option is for Python alone.
"""

import functools
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, fields, is_dataclass
from enum import StrEnum
from typing import Annotated, Any, get_args, get_origin, get_type_hints

Names = Iterable[str] | Callable[[], Iterable[str]]


class Panel(StrEnum):
    """The groups of options in a help, in its order. A dataclass names that of its options as its PANEL."""

    MEASUREMENT = "Measurement"
    DATA = "Data"
    MODEL = "Model"
    LIGHT = "Light"
    WEIGHTS = "Weights"
    UNCERTAINTY = "Uncertainty"
    SOLVER = "Solver"
    RANKING = "Ranking"
    PLAN = "Plan"
    RESAMPLING = "Resampling"
    READINGS = "Raw readings"
    REDUCTION = "Reduction"
    FIGURE = "Figure"
    CLUSTER = "Cluster"
    OUTPUT = "Output"
    GENERAL = "General"


@dataclass(frozen=True)
class Option:
    """The declaration of one option beside its type and default, written in the annotation of its field.

    help: what it does, in a few words. flag: on the command line, where that is not `--` and the field's name.
    metavar: how the help writes the value. of_parameters: whether its keys, or its items, name parameters of a model.
    panel: the group in the help, where that is not the PANEL of the dataclass. lowest, highest: the bounds of a number.
    above: a bound that the number itself must exceed. names: words that a shell completes, or a function that lists
    them, where that takes time.
    """

    help: str
    flag: str = ""
    metavar: str = ""
    of_parameters: bool = False
    panel: Panel | None = None
    lowest: float = -math.inf
    highest: float = math.inf
    above: float = -math.inf
    names: Names = ()

    def flag_of(self, name: str) -> str:
        """The flag of the field of that name."""
        return self.flag or f"--{name.replace('_', '-')}"

    @property
    def range(self) -> str:
        """The bounds in words: `0 or more`, `above 0`, `0 to 180`; empty without bounds."""
        if math.isfinite(self.above):
            return f"above {self.above:g}"
        if math.isfinite(self.highest):
            return f"{self.lowest:g} to {self.highest:g}" if math.isfinite(self.lowest) else f"{self.highest:g} or less"
        return f"{self.lowest:g} or more" if math.isfinite(self.lowest) else ""

    def within(self, value: float, flag: str) -> float:
        """The number; ValueError with the flag and the remedy where it is not finite or beyond the bounds."""
        if not (math.isfinite(value) and self.lowest <= value <= self.highest and value > self.above):
            words = "a number from " * (" to " in self.range) + "a number " * self.range.startswith("above")
            raise ValueError(f"{flag} is {value:g}: give {words}{self.range or 'a finite number'}")
        return value

    def completed(self, incomplete: str) -> list[str]:
        """The names that begin as the last of `a,b` does, for a shell."""
        before, comma, last = incomplete.rpartition(",")
        names = self.names() if callable(self.names) else self.names
        return [before + comma + name for name in names if name.startswith(last)]


@functools.cache
def declared(kind: type) -> dict[str, tuple[Any, Option | None]]:
    """The type of every field of a dataclass with its Option, None for a field that has none."""
    hints = get_type_hints(kind, include_extras=True)
    return {field.name: split(hints[field.name]) for field in fields(kind)}


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


def split(annotation: Any) -> tuple[Any, Option | None]:
    """The type that an annotation names, and its Option, None where it has none."""
    if get_origin(annotation) is not Annotated:
        return annotation, None
    of, *extras = get_args(annotation)
    return of, next((extra for extra in extras if isinstance(extra, Option)), None)
