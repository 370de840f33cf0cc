"""What every solver is: an immutable value that searches a Problem and hands back an Optimum."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.problem import Problem

Values = npt.NDArray[np.float64]
Progress = Callable[[float], None]  # called with the fraction that is done, 0 to 1


def silent(fraction: float) -> None:
    """No progress is shown."""


@dataclass(frozen=True)
class Optimum:
    """What a solver hands back: the vector of weights and shape, E there, and the course of the search.

    `vector` (n,) has the order of `Problem.names`. `cost` is E, with the penalty where parameters are smooth.
    `evaluations`: of the residual, one for each vector or shape that was tried.
    `history` holds the best E after each step, (steps,) or (steps, chains). `exhausted`: the search ran out of steps.
    `searched` is on how many points starts were searched, 0 for all. `rivals` are the vectors of other minima that were
    met.
    """

    vector: Values
    cost: float
    exhausted: bool
    evaluations: int
    history: Values
    searched: int = 0
    rivals: tuple[Values, ...] = ()


class Solver(Protocol):
    """An immutable value; its fields are its settings, and are the same for one scan and for many."""

    @property
    def name(self) -> str:
        """The name by which a command asks for it."""

    def search(self, problem: Problem, progress: Progress = silent) -> Optimum:
        """The values of least E (guo2023, eq 11), within the bounds of the problem, under squared errors.

        A search that runs out of steps raises nothing: its Optimum says so. A robust loss is not the solver's concern
        (`reweighting`).
        """
