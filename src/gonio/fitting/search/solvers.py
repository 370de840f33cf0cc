"""The solvers by name, and one with its settings from numbers by name."""

import dataclasses
from collections.abc import Mapping

from gonio.fitting.search.anneal import Anneal
from gonio.fitting.search.projection import Projection
from gonio.fitting.search.solver import Solver

SOLVERS: Mapping[str, type[Projection] | type[Anneal]] = {kind.name: kind for kind in (Projection, Anneal)}


def solver(name: str, settings: Mapping[str, float], seed: int = 0, default: Solver | None = None) -> Solver:
    """The solver of that name; `settings` are its fields, and the seed goes to the one that draws random numbers.

    default: whose settings it has where none is given, if it is of that name.
    Raises ValueError for a name that is no solver's, or a setting that it does not have.
    """
    if name not in SOLVERS:
        raise ValueError(f"no solver {name!r}: choose one of {', '.join(SOLVERS)}")
    kind = SOLVERS[name]
    defaults = {f.name: f.default for f in dataclasses.fields(kind) if isinstance(f.default, int | float)}
    given: dict[str, float] = {"seed": seed} if "seed" in defaults else {}
    for field, value in settings.items():
        if field not in defaults:
            raise ValueError(f"the solver {name} has no setting {field!r}; it has {', '.join(defaults)}")
        given[field] = int(value) if isinstance(defaults[field], int) else value
    if isinstance(default, kind):
        return dataclasses.replace(default, **given)  # type: ignore[return-value]
    return kind(**given)  # type: ignore[arg-type]
