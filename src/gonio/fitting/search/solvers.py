"""The solvers by name, and the options by which one is chosen."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from gonio.fitting.search.anneal import Anneal
from gonio.fitting.search.projection import Projection
from gonio.options import Option

SOLVERS: Mapping[str, type[Projection] | type[Anneal]] = {kind.name: kind for kind in (Projection, Anneal)}


@dataclass(frozen=True, kw_only=True)
class SearchOptions:
    """A solver by its name, its settings by theirs, and the seed of whatever draws random numbers."""

    solver: Annotated[str, Option("projection (exact weights) or anneal (Appendix A)")] = "projection"
    setting: Annotated[Mapping[str, float], Option("a setting of the solver", metavar="NAME=VALUE")] = field(
        default_factory=dict
    )
    seed: Annotated[int, Option("seed of the random numbers")] = 0

    def chosen(self, default: Projection | Anneal | None = None) -> Projection | Anneal:
        """The solver; the settings of `default` are its own where none is given, if it is of that name.

        Raises ValueError for a name that is no solver's, or a setting that it does not have.
        """
        if self.solver not in SOLVERS:
            raise ValueError(f"no solver {self.solver!r}: choose one of {', '.join(SOLVERS)}")
        kind = SOLVERS[self.solver]
        defaults = {f.name: f.default for f in dataclasses.fields(kind) if isinstance(f.default, int | float)}
        given: dict[str, float] = {"seed": self.seed} if "seed" in defaults else {}
        for name, value in self.setting.items():
            if name not in defaults:
                raise ValueError(f"the solver {self.solver} has no setting {name!r}; it has {', '.join(defaults)}")
            given[name] = int(value) if isinstance(defaults[name], int) else value
        return dataclasses.replace(default if isinstance(default, kind) else kind(), **given)  # type: ignore[arg-type]
