"""How sure a fitted value is: the covariance from the full Jacobian, projected weights included."""

import numpy as np
import numpy.typing as npt

from gonio.fit.descent import Tangent, derivative
from gonio.fit.problem import Problem

Values = npt.NDArray[np.float64]


def covariance(problem: Problem, vector: Values, slope: Values | None = None) -> Values:
    """`robust` covariance of the free values of a problem at an optimum (n, n)."""
    plane = Tangent(np.concatenate([jacobian(problem, vector), problem.penalty]))
    return robust(plane, problem.difference(problem.brdf(vector)), slope)


def robust(plane: Tangent, residual: Values, slope: Values | None = None) -> Values:
    """Covariance of the values (n, n), infinite where the data do not determine a value.

    The heteroscedasticity-consistent estimate HC3 (mackinnon1985): it needs no assumption on how the noise depends on
    the signal, and so holds for constant and for proportional noise under any weighting. It assumes that errors of
    different points are independent and the model right; where the model is wrong it is a lower bound.

    Rows of the plane beyond the residual are those of a penalty: they hold the values, and have no error of their own.
    The covariance is then that of a biased estimate about its own mean, and does not hold what smoothing takes away.
    slope (points,): by how much less than for squared errors the loss pulls back a residual that grows, from -1 to 1,
    for residuals that hold the loss's weights: then it is the sandwich of an estimate under that loss (huber1967).
    """
    basis = plane.basis[: len(residual)]
    leverage = np.sum(basis**2, axis=1)
    alone = leverage > 1 - 1e-9  # a point that one value fits exactly says nothing about its error
    error = np.where(alone, 0.0, residual / np.where(alone, 1.0, 1 - leverage))
    inverse = plane.directions @ basis.T
    if slope is not None and not np.all(slope == 1):
        held = plane.basis[len(residual) :]
        bread = basis.T @ (slope[:, None] * basis) + held.T @ held
        inverse = plane.directions @ np.linalg.pinv(bread) @ basis.T
    spread = inverse * error
    unknown = plane.blind
    if alone.any():
        unknown = unknown | (np.abs(inverse[:, alone]).max(axis=1) > 1e-9 * np.abs(inverse).max(axis=1))
    return _infinite(spread @ spread.T, unknown)


def classic(plane: Tangent, residual: Values) -> Values:
    """The textbook's covariance s^2 (J'J)^-1, which holds where the residual scatters alike at every point."""
    variance = residual @ residual / (len(residual) - len(plane.directions))
    return _infinite(variance * (plane.directions @ plane.directions.T), plane.blind)


def _infinite(found: Values, unknown: npt.NDArray[np.bool_]) -> Values:
    """The covariance with the values that are not determined marked."""
    found[unknown, :] = found[:, unknown] = 0.0
    found[unknown, unknown] = np.inf
    return found


def jacobian(problem: Problem, vector: Values) -> Values:
    """Derivative of the residual (points, n) with respect to weights (exact) and shape (differences)."""
    n = problem.n_weights
    weights, shape = vector[:n], vector[n:]

    def brdf(shape: Values) -> Values:
        return problem.brdf(np.concatenate([np.broadcast_to(weights, (*shape.shape[:-1], n)), shape], axis=-1))

    matrix, fixed = problem.design(shape)
    columns = matrix
    if len(shape):
        # scale of a value that is zero: little against what any unit of ours resolves
        moved = derivative(brdf, shape, problem.lower[n:], problem.upper[n:], scale=1e-3, vectorised=True)
        columns = np.concatenate([matrix, moved], axis=1)
    return residual_slopes(problem, matrix @ weights + fixed, columns)


def residual_slopes(problem: Problem, modelled: Values, columns: Values) -> Values:
    """Derivative of the residual (points, n) from that of the BRDF, `modelled` at every point."""
    if problem.logarithmic:
        seen = modelled > np.finfo(float).tiny  # below, the residual keeps the logarithm of this
        columns = np.where(seen, columns.T / np.where(seen, modelled, 1.0), 0.0).T
    out: Values = problem.root_weights[:, None] * columns
    return out
