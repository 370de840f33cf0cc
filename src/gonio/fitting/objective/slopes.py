"""How the residual of a problem changes with its values: by weights exactly, by shape parameters by differences.

The BRDF is sum_k w_k t_k(shape), so its derivative by a weight w_k is the term t_k itself. The residual multiplies it
by the root of each point's weight g; for logarithms it also divides by the BRDF, since d ln f = df / f.
"""

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.differences import SMALLEST, derivative, forward_steps
from gonio.fitting.objective.problem import Problem

Values = npt.NDArray[np.float64]


def jacobian(problem: Problem, vector: Values) -> Values:
    """Derivative (points, values) of the residual at a vector of weights and shape, good to some 1e-12.

    This is what uncertainties and the last digits of a minimum are made of. The rows of a penalty are not in it.
    """
    n = problem.n_weights
    weights, shape = vector[:n], vector[n:]

    def brdf(shape: Values) -> Values:
        return problem.brdf(np.concatenate([np.broadcast_to(weights, (*shape.shape[:-1], n)), shape], axis=-1))

    matrix, fixed = problem.design(shape)
    columns = matrix
    if len(shape):
        moved = derivative(brdf, shape, problem.lower[n:], problem.upper[n:], scale=SMALLEST, vectorised=True)
        columns = np.concatenate([matrix, moved], axis=1)
    return residual_slopes(problem, matrix @ weights + fixed, columns)


def quick_jacobian(problem: Problem, vector: Values) -> Values:
    """Derivative (points and rows of the penalty, values) of the whole residual, good to some 1e-8.

    One design of shapes side by side gives it. One difference serves all groups of a shape parameter, since no point
    belongs to two of them: a fit with a thousand groups costs as many designs as one with a single group.
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


def residual_slopes(problem: Problem, modelled: Values, columns: Values) -> Values:
    """Derivative (points, n) of the residual from `columns`, that of the BRDF, which is `modelled` (points,)."""
    if problem.logarithmic:
        seen = modelled > np.finfo(float).tiny  # below, the residual keeps the logarithm of this
        columns = np.where(seen, columns.T / np.where(seen, modelled, 1.0), 0.0).T
    out: Values = problem.root_weights[:, None] * columns
    return out
