"""Searches of all values from values that are near: a little change to a problem moves its minimum and makes none.

Resampled points, a value held a little aside, other strengths of smoothing or weights of a robust loss are such
changes. One local search from the old minimum then does, over weights and shape together: every residual can have a
factor and an offset here, and logarithms are allowed, for which `projection` has no exact weights.
"""

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.cells.structure import in_cells
from gonio.fitting.objective.differences import SMALLEST
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.slopes import quick_jacobian
from gonio.fitting.search.cells.descent import changed
from gonio.fitting.search.cells.descent import descend as descend_in_cells
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

    factors, offset (points,): what the residual of each point is multiplied by, and what is then added. An offset of
    -s e is what a measured value higher by e does, with s the root weight (`Problem.error` gives s e). The penalty of
    smooth parameters stays as it is. held: the place of a value that stays as it starts. tolerance and max_steps are
    those of `descend`. The cost of the result is the squared sum of the changed residual, not divided by a scale.
    """
    if cells := in_cells(problem):
        in_place = None if held is None else (held, float(start[held]))
        return descend_in_cells(changed(problem, cells, factors, offset, in_place), start, tolerance, max_steps)
    points, lower, upper = len(problem.measured), problem.lower.copy(), problem.upper.copy()
    if held is not None:  # between equal bounds a value presses against one of them wherever downhill is
        lower[held] = upper[held] = start[held]
    scales, shifts = np.ones(points + len(problem.penalty)), np.zeros(points + len(problem.penalty))
    scales[:points], shifts[:points] = factors, offset
    squares = LeastSquares(
        lambda vector: scales * problem.residual(vector) + shifts,
        lower,
        upper,
        scale=np.maximum(np.abs(start), smallest(problem)),  # near zero a value keeps its start's size
        jacobian=lambda vector: scales[:, None] * quick_jacobian(problem, vector),
    )
    return descend(squares, start, tolerance=tolerance, max_steps=max_steps, last_digits=False)


def smallest(problem: Problem) -> Values:
    """The scale (n,) of values that are zero: that of differences; for weights of dim data, times the size of these."""
    scale = np.full(len(problem.names), SMALLEST)
    scale[: problem.n_weights] *= min(1.0, float(np.abs(problem.measured).max()))
    return scale
