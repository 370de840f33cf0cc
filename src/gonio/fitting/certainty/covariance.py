"""How sure a fitted value is: covariance and systematic shifts from the full Jacobian, projected weights included.

With J the derivative (points, values) of the residual r, and A = (J'J)^-1 J', a change e of the measured values moves
the fitted ones by A e. Every kind of covariance is A S A', with S what it takes for the covariance of e:

    robust     S = diag(r_k^2 / (1 - h_k)^2), with the leverage h_k = (J A)_kk (HC3, mackinnon1985)
    scaled     S = s^2 I, with s^2 = r'r / (points - values)
    absolute   S = diag(u_k^2), with u_k the stated uncertainty times the root weight of each point

A is computed from the tangent plane (`objective.tangent`), A = D U' with D its directions and U its basis: no J'J is
formed, whose condition is the square of that of J. The model is taken as linear in the values over their uncertainty,
and values as though they had no bounds. docs/intervals.md says how often the resulting intervals hold the truth.
"""

import functools
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from gonio.fitting.certainty import bulk
from gonio.fitting.covariance_kinds import ABSOLUTE, COVARIANCES, DEFAULT, infinite
from gonio.fitting.objective.blocks import in_blocks
from gonio.fitting.objective.cells.linear import Plane, linearised, plane_of
from gonio.fitting.objective.cells.plane import CellPlane
from gonio.fitting.objective.cells.slopes import Slopes
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.tangent import ALONE, Tangent
from gonio.fitting.objective.weighting import stated
from gonio.measured.causes import SYSTEMATIC, WHOLE, causes

Values = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Estimator = Callable[[Plane, Values], Values]


def covariance(problem: Problem, vector: Values, kind: str = DEFAULT, slope: Values | None = None) -> Values:
    """Covariance (n, n) of the free values of a problem at an optimum (n,), of a kind of COVARIANCES.

    slope (points,): as `robust` takes it. Infinite on the diagonal for values that the data do not determine, which
    then have no correlation with others. Raises ValueError as `estimator` does.
    """
    _refuse_unknown(kind)
    if blocked := in_blocks(problem):
        return bulk.covariance(problem, blocked, vector, kind)
    residual = problem.difference(problem.brdf(vector))
    return estimator(problem, kind, slope)(tangent(problem, vector), residual)


def tangent(problem: Problem, vector: Values) -> Plane:
    """The tangent plane of the whole residual: the points first, then the rows of the penalty of smooth parameters."""
    return plane_of(linearised(problem, vector))


def estimator(problem: Problem, kind: str, slope: Values | None = None) -> Estimator:
    """How tangent plane and residual of the points at an optimum become a covariance (n, n).

    slope: as `robust` takes it. Raises ValueError for a kind that is none of COVARIANCES, where the scan does not state
    what `absolute` needs, or for another kind than `robust` under a robust loss.
    """
    _refuse_unknown(kind)
    if kind == DEFAULT:
        return functools.partial(robust, slope=slope)
    if problem.loss != "squared":
        raise ValueError(f"{kind} covariance is of squared errors, and this is a {problem.loss} loss: choose robust")
    if kind == ABSOLUTE:
        error = problem.error(stated(problem.points, "absolute covariance", "choose robust or scaled"))
        return lambda plane, residual: absolute(plane, error)
    return scaled


def _refuse_unknown(kind: str) -> None:
    if kind not in COVARIANCES:
        raise ValueError(f"no covariance {kind!r}: choose one of {', '.join(COVARIANCES)}")


def robust(plane: Plane, residual: Values, slope: Values | None = None) -> Values:
    """Covariance of the values (n, n), infinite where the data do not determine a value.

    The heteroscedasticity-consistent estimate HC3 (mackinnon1985): it needs no assumption on how the noise depends on
    the signal, and so holds for constant and for proportional noise under any weighting. It assumes that errors of
    different points are independent and the model right; where the model is wrong it is a lower bound.

    Rows of the plane beyond the residual are those of a penalty: they hold the values, and have no error of their own.
    The covariance is then that of a biased estimate about its own mean, and does not contain the bias of smoothing.
    slope (points,): by how much less than for squared errors the loss pulls back a residual that grows, from -1 to 1,
    for residuals that hold the loss's weights: then it is the sandwich of an estimate under that loss (huber1967).

    A value that rests on a point which some value fits exactly is not determined: such a point has no residual.
    """
    error, alone = left_out(plane, residual)
    if slope is not None and np.all(slope == 1):
        slope = None  # squared errors, whose normal equations the plane has solved
    unknown = plane.blind.copy()
    if alone.any():
        for places, moved in plane.moves(len(residual), slope):
            size = np.abs(moved)
            unknown[places] |= size[:, alone].max(axis=1) > 1e-9 * size.max(axis=1)
    return infinite(plane.covariance(error, slope), unknown)


def scaled(plane: Plane, residual: Values) -> Values:
    """The textbook's covariance s^2 (J'J)^-1 (n, n), for residuals that scatter by the same amount at every point.

    s^2 is r'r over the degrees of freedom, points less values; a point of no weight counts for none. With fewer than
    one of these no value is determined.
    """
    leverage = plane.leverage(len(residual))
    points = np.count_nonzero((residual != 0) | (leverage > 0))
    freedom = points - plane.effective_values(len(residual))  # effective values, which a penalty makes fewer
    if freedom < 1:
        return infinite(np.zeros((len(plane.blind),) * 2), np.ones_like(plane.blind))
    covariance = plane.covariance(np.ones_like(residual))
    covariance *= residual @ residual / freedom
    return infinite(covariance, plane.blind)


def absolute(plane: Plane, error: Values) -> Values:
    """Covariance (n, n) from the standard deviation (points,) of every residual: the law of propagation."""
    return infinite(plane.covariance(error), plane.blind)


def left_out(plane: Plane, residual: Values) -> tuple[Values, Mask]:
    """The residual (points,) of each point in a fit without it, r_k / (1 - h_k) to first order.

    Also which points some value fits exactly: for these that is zero over zero, and zero is returned.
    """
    leverage = plane.leverage(len(residual))
    alone = leverage > ALONE
    return np.where(alone, 0.0, residual / np.where(alone, 1.0, 1 - leverage)), alone


def systematic_shifts(problem: Problem, vector: Values, pinned: Mask) -> dict[str, Values]:
    """Shift (n,) of the free values by each cause of systematic uncertainty of the scan (`measured.causes`), by name.

    All points err at once by one cause, so the shift has a sign, and errors of points add up: it is A e with e the
    shift of every residual by one standard uncertainty of the cause. The covariance of the values is that of random
    errors and, for every cause, the product of its shift with itself (JCGM 100, 5.2). pinned (n,): values at a bound,
    which stay there. Infinite for values that the data do not determine.
    One cause of NaN where the scan states no systematic uncertainty, or not at every point.
    """
    found = causes(problem.points)
    known = all(np.isfinite(one).all() for one in found.values())
    if SYSTEMATIC not in problem.points:
        known &= all((one >= 0).all() for one in found.values())
    if not found or not known:
        return {WHOLE: np.full(len(vector), np.nan)}
    errors = {name: problem.error(one) for name, one in found.items()}
    if blocked := in_blocks(problem):
        return {name: bulk.systematic_shift(blocked, vector, error, pinned) for name, error in errors.items()}
    slopes = linearised(problem, vector)
    if isinstance(slopes, Slopes):
        of_cells, held = CellPlane(slopes, ~pinned), np.zeros(len(slopes.penalty))
        return {n: np.where(of_cells.blind, np.inf, of_cells.moved(np.append(e, held))) for n, e in errors.items()}
    plane = Tangent(slopes[:, ~pinned])
    shifts = {name: np.zeros(slopes.shape[1]) for name in errors}
    for name, error in errors.items():
        shifts[name][~pinned] = np.where(plane.blind, np.inf, plane.moved(error))
    return shifts
