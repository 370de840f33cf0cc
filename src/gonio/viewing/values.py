"""The values of a page by name: `width`, or `rho_s[30]` for one value of each group, as a Solution has them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from gonio.fitting.objective.entries import group_label
from gonio.model import Model
from gonio.outside import nearest
from gonio.viewing.fits import record
from gonio.viewing.session import Opened

Nested = list[list[float]]  # for each parameter of a model the values of its groups, as the page has them


@dataclass(frozen=True)
class Layout:
    """The parameters of a model and their groups, in the order of the page.

    model: the model. labels: for each parameter those of its groups, `("",)` for a single value. by: for each parameter
    the coordinates that tell its groups apart, with commas; empty for a single value.
    """

    model: Model
    labels: Sequence[Sequence[str]]
    by: Sequence[str]

    @property
    def names(self) -> list[list[str]]:
        """The names of the values."""
        own = zip(self.model.parameters, self.labels, self.by, strict=True)
        return [[f"{name}[{label}]" if by else name for label in labels] for name, labels, by in own]

    def named(self, values: Any) -> dict[str, float]:
        """Values by name from what a page says; ValueError where it has not a finite number for each."""
        names = self.names
        if not isinstance(values, list) or len(values) != len(names):
            raise ValueError(f"the page says no values of {self.model.name}")
        found: dict[str, float] = {}
        for own, said in zip(names, values, strict=True):
            if not isinstance(said, list) or len(said) != len(own) or not all(map(_is_number, said)):
                raise ValueError(f"the page says no value of {', '.join(own[:3])}")
            found |= {name: float(value) for name, value in zip(own, said, strict=True)}
        return found

    def nested(self, values: Mapping[str, float]) -> Nested:
        """All values in the form of a page."""
        return [[float(values[name]) for name in own] for own in self.names]

    def checked(self, values: Mapping[str, Any]) -> dict[str, float]:
        """Some values by name; KeyError for a name that there is not, ValueError for what is outside its bounds.

        The name of a parameter with several groups stands for all of them.
        """
        every = [name for own in self.names for name in own]
        groups = dict(zip(self.model.parameters, self.names, strict=True))
        found: dict[str, float] = {}
        for name, value in values.items():
            if name not in every and name not in groups:
                raise KeyError(f"{self.model.name} has no value {name!r}; {nearest(str(name), every)}")
            lower, upper = self._bounds(name.partition("[")[0])
            if not _is_number(value) or not lower <= value <= upper:
                raise ValueError(f"{name} is {value!r}: give a number from {lower:g} to {upper:g}")
            found |= dict.fromkeys([name] if name in every else groups[name], float(value))
        return found

    def _bounds(self, parameter: str) -> tuple[float, float]:
        declared = self.model.shape.get(parameter)
        return (declared.lower, declared.upper) if declared else (0.0, math.inf)


def of_fit(opened: Opened, name: str) -> Layout:
    """The layout of a fit."""
    solution = opened.fits[name]
    parameters = record(solution, opened.columns)["parameters"]
    return Layout(solution.model, [p["labels"] for p in parameters], [p["by"] for p in parameters])


def of_model(opened: Opened, model: Model) -> Layout:
    """The layout of a model without a fit: a weight has a value for each set of directions, a shape one for all."""
    header = opened.columns.header
    sets = [",".join(group_label(value) for value in one.values()) for one in header["blocks"]]
    by = ",".join(header["by"])
    several = [name in model.weights for name in model.parameters]
    return Layout(model, [sets if many else [""] for many in several], [by if many else "" for many in several])


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
