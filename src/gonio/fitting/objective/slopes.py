"""How the residual of a problem changes with its values: by weights exactly, by shape parameters by differences.

The BRDF is f = sum_k w_k t_k(shape), so its derivative by a weight w_k is the term t_k itself, a column of the design.
The residual multiplies it by the root of each point's weight g; for logarithms it also divides by the BRDF, since
d ln f = df / f. Two accuracies are offered, because a step of a search needs few digits and should cost little, while
uncertainties and the last digits of a minimum need many: `quick_jacobian` and `jacobian`.
"""

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.differences import SMALLEST, derivative, forward_steps
from gonio.fitting.objective.problem import Problem

Values = npt.NDArray[np.float64]


def jacobian(problem: Problem, vector: Values) -> Values:
    """Derivative (points, values) of the residual at a vector (values,) of weights and shape, good to some 1e-12.

    Uncertainties and the last digits of a minimum are computed from it. The rows of the penalty are not included: they
    are the derivative of the penalty itself, and whoever needs them appends `problem.penalty`.
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
    """Derivative (points and rows of the penalty, values) of the residual with its penalty, good to some 1e-8.

    All shapes go through one call of `design`: the shape itself and, for each shape parameter, one with all of its
    groups moved by a forward difference. One difference serves all groups, since no point belongs to two of them: a fit
    with a thousand groups costs as many designs as one with a single group.
    """
    n = problem.n_weights
    shape, lower, upper = vector[n:], problem.lower[n:], problem.upper[n:]
    # each step towards the farther bound, and of a size of its own even within one parameter
    moved = np.diagonal(forward_steps(shape, np.maximum(np.abs(shape), SMALLEST), lower, upper))
    owner = np.repeat(np.arange(len(problem.free_shape)), [entry.size for entry in problem.free_shape])
    tried = np.where(owner == np.arange(len(problem.free_shape))[:, None], moved, shape)
    matrix, fixed = problem.design(np.concatenate([shape[None], tried]))
    modelled = matrix @ vector[:n] + fixed
    columns, steps, at = [matrix[0]], moved - shape, 0
    # every change goes to the column of its point's group, divided by that group's step
    for entry, change in zip(problem.free_shape, modelled[1:] - modelled[0], strict=True):
        by_group = np.zeros((len(change), entry.size))
        by_group[np.arange(len(change)), entry.group] = change / steps[at : at + entry.size][entry.group]
        columns.append(by_group)
        at += entry.size
    return np.concatenate([residual_slopes(problem, modelled[0], np.concatenate(columns, axis=1)), problem.penalty])


def residual_slopes(problem: Problem, modelled: Values, columns: Values) -> Values:
    """Derivative (points, n) of the residual from that of the BRDF, `columns`; modelled (points,): the BRDF."""
    if problem.logarithmic:
        positive = modelled > np.finfo(float).tiny  # elsewhere the residual has the logarithm of this, a constant
        columns = np.where(positive, columns.T / np.where(positive, modelled, 1.0), 0.0).T
    out: Values = problem.root_weights[:, None] * columns
    return out
