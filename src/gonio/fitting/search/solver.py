"""What every solver is: an immutable value that searches a Problem and hands back an Optimum."""

from collections.abc import Callable
from typing import Protocol

from gonio.fitting.objective.problem import Problem
from gonio.fitting.solution import Optimum

Progress = Callable[[float], None]  # told the fraction that is done


def silent(fraction: float) -> None:
    """No progress is shown."""


class Solver(Protocol):
    """An immutable value; its fields are its settings."""

    @property
    def name(self) -> str: ...

    def search(self, problem: Problem, progress: Progress = silent) -> Optimum: ...
