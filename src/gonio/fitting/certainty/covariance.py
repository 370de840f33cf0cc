"""How sure a fitted value is: covariance and systematic shift from the full Jacobian, projected weights included."""

import functools
from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.weighting import stated
from gonio.fitting.search.descent import Tangent, derivative

Values = npt.NDArray[np.float64]
Estimator = Callable[[Tangent, Values], Values]

COVARIANCES: Mapping[str, str] = {
    "robust": "from the scatter about the fit, however it depends on the signal (HC3)",
    "scaled": "from the scatter about the fit, alike at every weighted point",
    "absolute": "from the uncertainty that the scan states, taken at its word",
}
DEFAULT, ABSOLUTE = "robust", "absolute"
ALONE = 1 - 1e-9  # leverage of a point that one value fits exactly, which says nothing about its error


def covariance(problem: Problem, vector: Values, kind: str = DEFAULT, slope: Values | None = None) -> Values:
    """Covariance of the free values of a problem at an optimum (n, n), of a kind of COVARIANCES."""
    return estimator(problem, kind, slope)(tangent(problem, vector), problem.difference(problem.brdf(vector)))


def tangent(problem: Problem, vector: Values) -> Tangent:
    """The tangent plane of the whole residual: of the points, then of what holds values smooth."""
    return Tangent(np.concatenate([jacobian(problem, vector), problem.penalty]))


def estimator(problem: Problem, kind: str, slope: Values | None = None) -> Estimator:
    """How tangent plane and residual of the points at an optimum become a covariance (n, n).

    slope: as `robust` takes it. Raises ValueError for a kind that is none of COVARIANCES, where the scan does not state
    what `absolute` needs, or for another kind than `robust` under a robust loss.
    """
    if kind not in COVARIANCES:
        raise ValueError(f"no covariance {kind!r}: choose one of {', '.join(COVARIANCES)}")
    if kind == DEFAULT:
        return functools.partial(robust, slope=slope)
    if problem.loss != "squared":
        raise ValueError(f"{kind} covariance is of squared errors, and this is a {problem.loss} loss: choose robust")
    if kind == ABSOLUTE:
        error = problem.error(stated(problem.points, "absolute covariance", "choose robust or scaled"))
        return lambda plane, residual: absolute(plane, error)
    return scaled


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
    error, alone = left_out(plane, residual)
    basis, held = plane.basis[: len(residual)], plane.basis[len(residual) :]
    inverse = plane.directions @ basis.T
    if slope is not None and not np.all(slope == 1):
        bread = basis.T @ (slope[:, None] * basis) + held.T @ held
        inverse = plane.directions @ np.linalg.pinv(bread) @ basis.T
    spread = inverse * error
    unknown = plane.blind
    if alone.any():
        unknown = unknown | (np.abs(inverse[:, alone]).max(axis=1) > 1e-9 * np.abs(inverse).max(axis=1))
    spread = inverse * error
    return infinite(spread @ spread.T, unknown)


def scaled(plane: Tangent, residual: Values) -> Values:
    """The textbook's covariance s^2 (J'J)^-1, which holds where the residual scatters alike at every point."""
    basis = plane.basis[: len(residual)]
    freedom = len(residual) - float(np.sum(basis**2))  # a penalty leaves fewer values than it holds
    if freedom < 1:
        return infinite(np.zeros((len(plane.blind),) * 2), np.ones_like(plane.blind))
    spread = plane.directions @ basis.T
    return infinite(residual @ residual / freedom * (spread @ spread.T), plane.blind)


def absolute(plane: Tangent, error: Values) -> Values:
    """Covariance from the standard deviation of every residual: the law of propagation, under any weighting."""
    spread = (plane.directions @ plane.basis[: len(error)].T) * error
    return infinite(spread @ spread.T, plane.blind)


def left_out(plane: Tangent, residual: Values) -> tuple[Values, npt.NDArray[np.bool_]]:
    """The residual of each point in a fit without it, to first order, and which points a value fits alone (zero)."""
    leverage = np.sum(plane.basis[: len(residual)] ** 2, axis=1)
    alone = leverage > ALONE
    return np.where(alone, 0.0, residual / np.where(alone, 1.0, 1 - leverage)), alone


def systematic_shift(slopes: Values, error: Values, pinned: npt.NDArray[np.bool_]) -> Values:
    """Change of the values (n,) where every residual changes by its `error` at once; infinite where not determined.

    slopes: the Jacobian (points and rows of a penalty, n); the latter have no error. pinned: values at a bound, which
    stay there.
    """
    shift = np.zeros(slopes.shape[1])
    plane = Tangent(slopes[:, ~pinned])
    shift[~pinned] = np.where(plane.blind, np.inf, plane.directions @ (plane.basis[: len(error)].T @ error))
    return shift


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


def infinite(found: Values, unknown: npt.NDArray[np.bool_]) -> Values:
    """The covariance with the values that are not determined marked."""
    found[unknown, :] = found[:, unknown] = 0.0
    found[unknown, unknown] = np.inf
    return found
