"""How sure a fitted value is: covariance and systematic shift from the full Jacobian, projected weights included."""

from collections.abc import Callable, Mapping

import numpy as np
import numpy.typing as npt

from gonio.fit.descent import Tangent, derivative
from gonio.fit.problem import Problem
from gonio.fit.weighting import stated

Values = npt.NDArray[np.float64]
Estimator = Callable[[Tangent, Values], Values]

COVARIANCES: Mapping[str, str] = {
    "robust": "from the scatter about the fit, however it depends on the signal (HC3)",
    "scaled": "from the scatter about the fit, alike at every weighted point",
    "absolute": "from the uncertainty that the scan states, taken at its word",
}
DEFAULT, ABSOLUTE = "robust", "absolute"


def covariance(problem: Problem, vector: Values, kind: str = DEFAULT) -> Values:
    """Covariance of the free values of a problem at an optimum (n, n), of a kind of COVARIANCES."""
    return estimator(problem, kind)(Tangent(jacobian(problem, vector)), problem.residual(vector))


def estimator(problem: Problem, kind: str) -> Estimator:
    """How tangent plane and residual at an optimum become a covariance (n, n).

    Raises ValueError for a kind that is none of COVARIANCES, or where the scan does not state what `absolute` needs.
    """
    if kind == ABSOLUTE:
        error = problem.error(stated(problem.points, "absolute covariance", "choose robust or scaled"))
        return lambda plane, residual: absolute(plane, error)
    if kind not in COVARIANCES:
        raise ValueError(f"no covariance {kind!r}: choose one of {', '.join(COVARIANCES)}")
    return robust if kind == DEFAULT else scaled


def robust(plane: Tangent, residual: Values) -> Values:
    """Covariance of the values (n, n), infinite where the data do not determine a value.

    The heteroscedasticity-consistent estimate HC3 (mackinnon1985): it needs no assumption on how the noise depends on
    the signal, and so holds for constant and for proportional noise under any weighting. It assumes that errors of
    different points are independent and the model right; where the model is wrong it is a lower bound.
    """
    error, alone = left_out(plane, residual)
    inverse = plane.directions @ plane.basis.T
    unknown = plane.blind
    if alone.any():
        unknown = unknown | (np.abs(inverse[:, alone]).max(axis=1) > 1e-9 * np.abs(inverse).max(axis=1))
    spread = inverse * error
    return _infinite(spread @ spread.T, unknown)


def scaled(plane: Tangent, residual: Values) -> Values:
    """The textbook's covariance s^2 (J'J)^-1, which holds where the residual scatters alike at every point."""
    freedom = len(residual) - plane.directions.shape[1]
    if freedom < 1:
        return _infinite(np.zeros((len(plane.blind),) * 2), np.ones_like(plane.blind))
    variance = residual @ residual / freedom
    return _infinite(variance * (plane.directions @ plane.directions.T), plane.blind)


def absolute(plane: Tangent, error: Values) -> Values:
    """Covariance from the standard deviation of every residual: the law of propagation, under any weighting."""
    spread = (plane.directions @ plane.basis.T) * error
    return _infinite(spread @ spread.T, plane.blind)


def left_out(plane: Tangent, residual: Values) -> tuple[Values, npt.NDArray[np.bool_]]:
    """The residual of each point in a fit without it, to first order, and which points a value fits alone (zero)."""
    leverage = np.sum(plane.basis**2, axis=1)
    alone = leverage > 1 - 1e-9  # a point that one value fits exactly says nothing about its error
    return np.where(alone, 0.0, residual / np.where(alone, 1.0, 1 - leverage)), alone


def systematic_shift(slopes: Values, error: Values, pinned: npt.NDArray[np.bool_]) -> Values:
    """Change of the values (n,) where every residual changes by its `error` at once; infinite where not determined.

    slopes: the Jacobian (points, n). pinned: values at a bound, which stay there.
    """
    shift = np.zeros(slopes.shape[1])
    plane = Tangent(slopes[:, ~pinned])
    shift[~pinned] = np.where(plane.blind, np.inf, plane.directions @ (plane.basis.T @ error))
    return shift


def jacobian(problem: Problem, vector: Values) -> Values:
    """Derivative of the residual (points, n) with respect to weights (exact) and shape (differences)."""
    n = problem.n_weights
    weights, shape = vector[:n], vector[n:]
    matrix, fixed = problem.design(shape)
    columns = matrix
    if len(shape):
        moved = derivative(
            lambda shape: problem.brdf(np.concatenate([weights, shape])),
            shape,
            problem.lower[n:],
            problem.upper[n:],
            scale=1e-3,  # of a value that is zero, and little against what any unit of ours resolves
        )
        columns = np.concatenate([matrix, moved], axis=1)
    return residual_slopes(problem, matrix @ weights + fixed, columns)


def residual_slopes(problem: Problem, modelled: Values, columns: Values) -> Values:
    """Derivative of the residual (points, n) from that of the BRDF, `modelled` at every point."""
    if problem.logarithmic:
        columns = columns / np.maximum(modelled, np.finfo(float).tiny)[:, None]
    out: Values = problem.root_weights[:, None] * columns
    return out


def _infinite(found: Values, unknown: npt.NDArray[np.bool_]) -> Values:
    """The covariance with the values that are not determined marked."""
    found[unknown, :] = found[:, unknown] = 0.0
    found[unknown, unknown] = np.inf
    return found
