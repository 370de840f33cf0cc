"""The solvers by name, and the options by which one is chosen.

A setting is a field of the solver that has a number as its default. What is no number, such as the bounds `lb` and `ub`
of Anneal, cannot be set by a command: its `--bound` narrows the problem itself.
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from gonio.fitting.search.anneal import Anneal
from gonio.fitting.search.projection import Projection
from gonio.options import Option, Panel

SOLVERS: Mapping[str, type[Projection] | type[Anneal]] = {kind.name: kind for kind in (Projection, Anneal)}


@dataclass(frozen=True, kw_only=True)
class SearchOptions:
    """A solver by its name, its settings by theirs, and the seed of whatever draws random numbers."""

    PANEL: ClassVar = Panel.SOLVER
    solver: Annotated[
        str,
        Option(
            "projection (searches the shape, weights are exact) or anneal (simulated annealing, as in the paper)",
            names=tuple(SOLVERS),
        ),
    ] = "projection"
    setting: Annotated[
        Mapping[str, float], Option("change a setting of the solver: searches=8", metavar="NAME=VALUE")
    ] = field(default_factory=dict)
    seed: Annotated[int, Option("seed of the random numbers", lowest=0)] = 0

    def chosen(self, default: Projection | Anneal | None = None) -> Projection | Anneal:
        """The solver; settings that are not given are those of `default`, if that is a solver of the same name.

        Raises ValueError for a name that is no solver's, or a setting that it does not have.
        """
        if self.seed < 0:
            raise ValueError(f"the seed is {self.seed}: give zero or more")
        if self.solver not in SOLVERS:
            raise ValueError(f"no solver {self.solver!r}: choose one of {', '.join(SOLVERS)}")
        kind = SOLVERS[self.solver]
        defaults = {f.name: f.default for f in dataclasses.fields(kind) if isinstance(f.default, int | float)}
        changed: dict[str, float] = {"seed": self.seed} if "seed" in defaults else {}  # a projection draws nothing
        for name, value in self.setting.items():
            if name not in defaults:
                raise ValueError(f"the solver {self.solver} has no setting {name!r}; it has {', '.join(defaults)}")
            if isinstance(defaults[name], int) and value != int(value):
                raise ValueError(f"the setting {name} is a whole number, and is {value:g}")
            changed[name] = int(value) if isinstance(defaults[name], int) else value  # commands give floats
        base = default if isinstance(default, kind) else kind()
        return dataclasses.replace(base, **changed)  # type: ignore[arg-type]
