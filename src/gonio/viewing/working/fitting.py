"""Fits that a page asks for, done in a process of their own."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.comparison.answer import answer
from gonio.comparison.race import FEWEST
from gonio.comparison.runs import Asked, Watch
from gonio.fitting.fitting import fit
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.slopes import quick_jacobian
from gonio.fitting.search.descent import LeastSquares, descend
from gonio.fitting.search.projection import BETTER, Projection
from gonio.fitting.search.refit import smallest
from gonio.fitting.search.solver import Optimum, Progress, silent
from gonio.fitting.solution import Solution
from gonio.model import Model
from gonio.processes.portable import cores

Values = npt.NDArray[np.float64]
Tell = Callable[[dict[str, Any]], None]
Starts = Mapping[str, Mapping[str, float]]  # by parameter and by the label of a group


@dataclass(frozen=True)
class FromHere:
    """Variable projection, and a search downhill of the values that a page shows; the lower of both minima.

    start: values by parameter and label. A group that it has no value for makes it no start.
    """

    start: Starts = field(repr=False)
    name = "projection"

    def search(self, problem: Problem, progress: Progress = silent) -> Optimum:
        """The values of least E."""
        found = Projection().search(problem, lambda part: progress(0.9 * part))
        vector = self._vector(problem)
        if vector is None or not len(vector) or problem.smooth or problem.is_large:
            return found
        squares = LeastSquares(
            problem.residual,
            problem.lower,
            problem.upper,
            scale=np.maximum(np.abs(vector), smallest(problem)),
            jacobian=lambda one: quick_jacobian(problem, one),
        )
        end = descend(squares, vector)
        cost = float(problem.cost(problem.residual(end.point)))
        if not cost < found.cost * (1 - BETTER):
            return found
        history = np.append(found.history, cost) if found.history.ndim == 1 else found.history
        rivals = (*found.rivals, found.vector)
        evaluations = found.evaluations + end.evaluations
        return Optimum(end.point, cost, end.exhausted, evaluations, history, found.searched, rivals)

    def _vector(self, problem: Problem) -> Values | None:
        values = []
        for entry in problem.free:
            of_entry = self.start.get(entry.name, {})
            if any(label not in of_entry for label in entry.labels):
                return None
            values += [of_entry[label] for label in entry.labels]
        return np.clip(np.array(values), problem.lower, problem.upper)


def fit_one(scan: xr.Dataset, model: Model, start: Starts, options: Mapping[str, Any], tell: Tell) -> Solution:
    """A model fitted to a scan; options are those of a Problem."""
    tell({"fraction": 0.0, "name": model.name})
    problem = Problem(model, scan, **options)
    return fit(problem, FromHere(start), lambda part: tell({"fraction": part, "name": model.name}))


def fit_best(
    scan: xr.Dataset, models: Sequence[Model], options: Mapping[str, Any], tell: Tell
) -> tuple[Solution, list[dict[str, Any]], str]:
    """The best of some models, as `gonio fit` finds it; the ranking of those that came near, and the verdict."""
    tell({"fraction": 0.0, "name": "all models"})
    workers = max(min(cores(), len(models) // FEWEST), 1)
    watch = Watch(lambda part, name: tell({"fraction": part, "name": name}))
    found = answer(scan, models, Asked(workers=workers), watch, **options)
    ranking = [
        {"model": row.model.name, "error": row.validated.get(row.metric) or row.metrics[row.metric]}
        for row in found.rows
    ]
    return found.best.solution, ranking, found.verdict.words


def ready() -> None:
    """Nothing: what a process is asked first, so that all is imported when it answers."""
