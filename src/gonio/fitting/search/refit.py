"""Searches of all values from values that are near: a little change to a problem moves its minimum and makes none."""

import numpy as np
import numpy.typing as npt

from gonio.fitting.certainty.covariance import residual_slopes
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.descent import SEARCHED, Descent, descend, forward_steps

Values = npt.NDArray[np.float64]
SMALLEST = 1e-3  # scale of a value that is zero, as the covariance takes it


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
    """The minimum downhill of a vector of weights and shape, its last digits left.

    factors, offset (points,): what the residual of each point is multiplied by, and what is then added. held: the place
    of a value that stays as it starts. tolerance and max_steps are those of `descend`.
    """
    points, lower, upper = len(problem.measured), problem.lower.copy(), problem.upper.copy()
    if held is not None:
        lower[held] = upper[held] = start[held]
    scales, shifts = np.ones(points + len(problem.penalty)), np.zeros(points + len(problem.penalty))
    scales[:points], shifts[:points] = factors, offset
    return descend(
        lambda vector: scales * problem.residual(vector) + shifts,
        start,
        lower,
        upper,
        scale=np.maximum(np.abs(start), SMALLEST),
        jacobian=lambda vector: scales[:, None] * slopes(problem, vector),
        tolerance=tolerance,
        max_steps=max_steps,
        last_digits=False,
    )


def slopes(problem: Problem, vector: Values) -> Values:
    """The Jacobian of the residual to some 1e-8, from one design of shapes side by side.

    One difference serves all groups of a shape parameter, since no point sees two of them.
    """
    n = problem.n_weights
    shape, lower, upper = vector[n:], problem.lower[n:], problem.upper[n:]
    moved = np.diagonal(forward_steps(shape, np.maximum(np.abs(shape), SMALLEST), lower, upper))
    owner = np.repeat(np.arange(len(problem.free_shape)), [entry.size for entry in problem.free_shape])
    tried = np.where(owner == np.arange(len(problem.free_shape))[:, None], moved, shape)
    matrix, fixed = problem.design(np.concatenate([shape[None], tried]))
    modelled = matrix @ vector[:n] + fixed
    columns, steps, at = [matrix[0]], moved - shape, 0
    for entry, change in zip(problem.free_shape, modelled[1:] - modelled[0], strict=True):
        by_group = np.zeros((len(change), entry.size))
        by_group[np.arange(len(change)), entry.group] = change / steps[at : at + entry.size][entry.group]
        columns.append(by_group)
        at += entry.size
    return np.concatenate([residual_slopes(problem, modelled[0], np.concatenate(columns, axis=1)), problem.penalty])
