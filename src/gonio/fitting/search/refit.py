"""Searches of all values from values that are near: a little change to a problem moves its minimum and makes none."""

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.differences import SMALLEST
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.slopes import quick_jacobian
from gonio.fitting.search.descent import SEARCHED, Descent, LeastSquares, descend

Values = npt.NDArray[np.float64]


def refit(
    problem: Problem,
    start: Values,
    tolerance: float = SEARCHED,
    max_steps: int = 2000,
    *,
    factors: Values | float = 1.0,
    offset: Values | float = 0.0,
    held: int | None = None,
) -> Descent:
    """The minimum downhill of a vector (n,) of weights and shape; its last digits are not sought.

    factors, offset (points,): what the residual of each point is multiplied by, and what is then added. held: the place
    of a value that stays as it starts. tolerance and max_steps are those of `descend`.
    """
    points, lower, upper = len(problem.measured), problem.lower.copy(), problem.upper.copy()
    if held is not None:
        lower[held] = upper[held] = start[held]
    scales, shifts = np.ones(points + len(problem.penalty)), np.zeros(points + len(problem.penalty))
    scales[:points], shifts[:points] = factors, offset
    squares = LeastSquares(
        lambda vector: scales * problem.residual(vector) + shifts,
        lower,
        upper,
        scale=np.maximum(np.abs(start), SMALLEST),
        jacobian=lambda vector: scales[:, None] * quick_jacobian(problem, vector),
    )
    return descend(squares, start, tolerance=tolerance, max_steps=max_steps, last_digits=False)
