"""How sure a fitted value is: the covariance from the full Jacobian, projected weights included."""

import numpy as np
import numpy.typing as npt

from gonio.fit.problem import Problem

Values = npt.NDArray[np.float64]
STEP = 6e-6  # cube root of the rounding error: where a central difference is best


def covariance(problem: Problem, vector: Values) -> Values:
    """Covariance of the free values at an optimum (n, n), infinite where the data do not determine a value.

    The heteroscedasticity-consistent estimate HC3 (mackinnon1985): it needs no assumption on how the noise depends on
    the signal, and so holds for constant and for proportional noise under any weighting. It assumes that errors of
    different points are independent and the model right; where the model is wrong it is a lower bound.
    """
    jacobian, residual = _jacobian(problem, vector), problem.residual(vector)
    length = np.sqrt(np.sum(jacobian**2, axis=0))
    unseen = ~(length > 0)
    length[unseen] = 1.0
    u, s, vt = np.linalg.svd(jacobian / length, full_matrices=False)
    kept = s > 1e-10 * s.max(initial=0.0)
    inverse = (vt[kept].T / s[kept]) @ u[:, kept].T  # pseudo-inverse, (n, points)
    leverage = np.sum(u[:, kept] ** 2, axis=1)
    alone = leverage > 1 - 1e-9  # a point that one value fits exactly says nothing about its error
    error = np.where(alone, 0.0, residual / np.where(alone, 1.0, 1 - leverage))
    spread = inverse * error
    found: Values = (spread @ spread.T) / np.outer(length, length)
    blind = unseen | (np.abs(vt[~kept]).max(axis=0, initial=0.0) > 1e-6)
    if alone.any():
        blind |= np.abs(inverse[:, alone]).max(axis=1) > 1e-9 * np.abs(inverse).max()
    found[blind, :] = found[:, blind] = 0.0
    found[blind, blind] = np.inf
    return found


def _jacobian(problem: Problem, vector: Values) -> Values:
    """Derivative of the residual with respect to weights (exact) and shape (central differences)."""
    n = problem.n_weights
    matrix, fixed = problem.design(vector[n:])
    columns = [matrix]
    for k in range(n, len(vector)):
        step = STEP * max(abs(vector[k]), 1e-3)
        ahead, behind = vector.copy(), vector.copy()
        ahead[k] += step
        behind[k] -= step
        columns.append(((problem.brdf(ahead) - problem.brdf(behind)) / (2 * step))[:, None])
    derivative = np.concatenate(columns, axis=1)
    if problem.logarithmic:
        modelled = matrix @ vector[:n] + fixed
        derivative = derivative / np.maximum(modelled, np.finfo(float).tiny)[:, None]
    out: Values = problem.root_weights[:, None] * derivative
    return out
