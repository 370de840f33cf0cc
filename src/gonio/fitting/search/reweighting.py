"""Fits under a robust loss: squared errors, weighted anew from the residuals of the last fit until nothing moves.

Every step is a fit like any other, with the exact weights of the terms (holland1977).
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.loss import LOSSES
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.descent import SEARCHED
from gonio.fitting.search.refit import refit
from gonio.fitting.search.solver import Progress, Solver, silent
from gonio.fitting.solution import Optimum

Values = npt.NDArray[np.float64]

NORMAL_MEDIAN = 0.6745  # median size of a standard normal number
STILL = 1e-4  # of the scale: when no residual moves by more, the weights have settled
ROUNDS = 100  # fits at most; a tenth of that is usual
BETTER = 1e-6  # of the loss: by how much a minimum found elsewhere must be lower


@dataclass(frozen=True)
class Settled:
    """A minimum under a loss: the vector, the problem with the weights that the loss gives its points, and their scale.

    slope: of weight times residual over the weight, at every point; 1 for squared errors.
    """

    vector: Values
    problem: Problem
    scale: float
    slope: Values
    exhausted: bool


def scatter(residual: Values, free: int) -> float:
    """Standard deviation of a normal residual from its median size, which half of the points may not spoil.

    The smallest residuals, as many as `free` values that were fitted to them, tell nothing and are left out.
    """
    size = np.sort(np.abs(residual))
    return float(np.median(size[min(free, len(size) - 1) :])) / NORMAL_MEDIAN


def minimum(problem: Problem, solver: Solver, progress: Progress = silent) -> tuple[Optimum, Settled]:
    """The optimum under the loss of a problem, and how its points were weighted there.

    A search of squared errors may end in a minimum that outliers made: it is repeated with the weights that settled.
    """
    optimum = solver.search(problem, progress)
    if problem.loss == "squared":
        return optimum, Settled(optimum.vector, problem, np.nan, np.ones_like(problem.measured), optimum.exhausted)
    found = settle(problem, optimum.vector)
    again = solver.search(found.problem)
    other = settle(problem, again.vector)
    if _total(problem, other.vector, found.scale) < _total(problem, found.vector, found.scale) * (1 - BETTER):
        found = other
    cost = float(problem.cost(problem.residual(found.vector)))
    evaluations = optimum.evaluations + again.evaluations
    return Optimum(found.vector, cost, found.exhausted, evaluations, optimum.history), found


def settle(problem: Problem, start: Values, tolerance: float = SEARCHED, max_steps: int = 2000) -> Settled:
    """The minimum downhill of a vector of weights and shape under the loss of the problem, as `refit` finds it."""
    vector = refit(problem, start, tolerance, max_steps).point
    if problem.loss == "squared":
        return Settled(vector, problem, np.nan, np.ones_like(problem.measured), False)
    loss = LOSSES[problem.loss]
    given = 1.0 if problem.point_weights is None else problem.point_weights
    residual = _of_points(problem, vector)
    for _ in range(ROUNDS):
        scale = max(scatter(residual, len(vector)), np.finfo(float).eps * float(np.abs(problem.target).max()))
        weights = loss.weight(residual / scale)
        vector = refit(problem, vector, tolerance, max_steps, factors=np.sqrt(weights)).point
        before, residual = residual, _of_points(problem, vector)
        if still := bool(np.abs(residual - before).max() <= STILL * scale):
            break
    return Settled(
        vector,
        replace(problem, point_weights=given * weights),
        scale,
        loss.slope(residual / scale),
        exhausted=not still,
    )


def _of_points(problem: Problem, vector: Values) -> Values:
    """The residual without what holds values smooth, which no loss concerns."""
    return problem.difference(problem.brdf(vector))


def _total(problem: Problem, vector: Values, scale: float) -> float:
    smooth = problem.penalty @ vector / scale
    return float(np.sum(LOSSES[problem.loss].cost(_of_points(problem, vector) / scale)) + smooth @ smooth / 2)
