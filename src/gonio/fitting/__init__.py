"""Finding the values of a model that explain a scan: a Problem and a solver give a Solution.

    objective    what is minimised: a model, a scan and options become a Problem
    search       solvers: variable projection, and the simulated annealing of guo2023
    certainty    covariances, intervals, bootstrap, validation and outliers of a fit
    many         fits of many scans at once, compiled by JAX
    stack        fits of stacks on disk, block by block, on Dask

A solver is an immutable value whose fields are its settings, and the same solver serves one scan and many. Names are
loaded on first use: who reads options of a fit need not wait for the solvers.
"""

import importlib
from typing import TYPE_CHECKING, Any

_HOMES = {
    "Anneal": "gonio.fitting.search.anneal",
    "FOR_MANY": "gonio.fitting.search.projection",
    "Problem": "gonio.fitting.objective.problem",
    "ProblemOptions": "gonio.fitting.objective.options",
    "Projection": "gonio.fitting.search.projection",
    "Smooth": "gonio.fitting.objective.smooth",
    "Solution": "gonio.fitting.solution",
    "Solver": "gonio.fitting.search.solver",
    "Status": "gonio.fitting.status",
    "fit": "gonio.fitting.fitting",
    "fit_many": "gonio.fitting.many.fit_many",
    "solution_of": "gonio.fitting.many.results",
}

__all__ = [
    "FOR_MANY",
    "Anneal",
    "Problem",
    "ProblemOptions",
    "Projection",
    "Smooth",
    "Solution",
    "Solver",
    "Status",
    "fit",
    "fit_many",
    "solution_of",
]

if TYPE_CHECKING:
    from gonio.fitting.fitting import fit
    from gonio.fitting.many.fit_many import fit_many
    from gonio.fitting.many.results import solution_of
    from gonio.fitting.objective.options import ProblemOptions
    from gonio.fitting.objective.problem import Problem
    from gonio.fitting.objective.smooth import Smooth
    from gonio.fitting.search.anneal import Anneal
    from gonio.fitting.search.projection import FOR_MANY, Projection
    from gonio.fitting.search.solver import Solver
    from gonio.fitting.solution import Solution
    from gonio.fitting.status import Status


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"gonio.fitting has no public name {name!r}; it has {', '.join(__all__)}")
    return getattr(importlib.import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return list(__all__)
