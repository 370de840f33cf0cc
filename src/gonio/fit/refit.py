"""Searches of all values from values that are near: the derivative by the weights is exact."""

import numpy as np
import numpy.typing as npt

from gonio.fit.covariance import residual_slopes
from gonio.fit.descent import SEARCHED, Descent, descend, forward_steps
from gonio.fit.problem import Problem

Values = npt.NDArray[np.float64]
SMALLEST = 1e-6  # scale of a value that is zero


def refit(problem: Problem, start: Values, tolerance: float = SEARCHED, max_steps: int = 2000) -> Descent:
    """The minimum downhill of a vector of weights and shape, its last digits left."""
    return descend(
        problem.residual,
        start,
        problem.lower,
        problem.upper,
        scale=np.maximum(np.abs(start), SMALLEST),
        jacobian=lambda vector: _slopes(problem, vector),
        tolerance=tolerance,
        max_steps=max_steps,
        last_digits=False,
    )


def _slopes(problem: Problem, vector: Values) -> Values:
    """The Jacobian of the residual to some 1e-8 from one design: its shapes side by side, each moved forward."""
    n = problem.n_weights
    shape, lower, upper = vector[n:], problem.lower[n:], problem.upper[n:]
    moved = forward_steps(shape, np.maximum(np.abs(shape), SMALLEST), lower, upper)
    matrix, fixed = problem.design(np.concatenate([shape[None], moved]))
    modelled = matrix @ vector[:n] + fixed
    by_shape = (modelled[1:] - modelled[0]).T / (np.diagonal(moved) - shape)
    return residual_slopes(problem, modelled[0], np.concatenate([matrix[0], by_shape], axis=1))
