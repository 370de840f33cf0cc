"""Fits that start from a fit: a little change to its problem moves the minimum and makes no new one."""

import numpy as np
import numpy.typing as npt

from gonio.fit.covariance import residual_slopes
from gonio.fit.descent import FORWARD, Descent, descend
from gonio.fit.problem import Problem

Values = npt.NDArray[np.float64]
SMALLEST = 1e-6  # scale of a value that is zero


def refit(
    problem: Problem,
    start: Values,
    factor: Values | float = 1.0,
    offset: Values | float = 0.0,
    held: int | None = None,
) -> Descent:
    """The minimum downhill of `start`, where every residual is multiplied by `factor` and `offset` is then added.

    held: the place of a value that stays as it starts.
    """
    lower, upper = problem.lower.copy(), problem.upper.copy()
    if held is not None:
        lower[held] = upper[held] = start[held]
    factors = np.broadcast_to(factor, problem.measured.shape)
    return descend(
        lambda vector: factors * problem.residual(vector) + offset,
        start,
        lower,
        upper,
        scale=np.maximum(np.abs(start), SMALLEST),
        jacobian=lambda vector: factors[:, None] * _slopes(problem, vector),
        last_digits=False,
    )


def _slopes(problem: Problem, vector: Values) -> Values:
    """The Jacobian of the residual to some 1e-8 from one design: its shapes side by side, each moved forward."""
    n = problem.n_weights
    shape = vector[n:]
    step = FORWARD * np.maximum(np.abs(shape), SMALLEST)
    step = np.where(problem.upper[n:] - shape >= shape - problem.lower[n:], step, -step)
    moved = np.vstack([shape, shape + np.diag(step)])
    matrix, fixed = problem.design(moved)
    modelled = matrix @ vector[:n] + fixed
    columns = (modelled[1:] - modelled[0]) / (moved[1:] - shape).diagonal()[:, None]
    return residual_slopes(problem, modelled[0], np.concatenate([matrix[0], columns.T], axis=1))
