"""Covariance and systematic shift of fits of very many points, summed over blocks of them.

The formulas are those of `covariance`. With J the derivative (points, values), D the directions (values, rank) of the
tangent plane and U = J D its orthonormal basis (points, rank), they need of all points only the sum over k of
s_k^2 u_k u_k', with u_k the k-th row of U and s_k the error of point k:

    A S A' = D (sum s_k^2 u_k u_k') D'.

D follows from the few rows to which `objective.blocks` reduces J. The rows u_k = j_k D, with j_k the k-th row of J, are
computed block by block and never held together.
"""

import functools

import numpy as np
import numpy.typing as npt

from gonio.fitting.covariance_kinds import DEFAULT, infinite
from gonio.fitting.objective.blocks import BlockedProblem, LinearSet
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.tangent import ALONE, Tangent
from gonio.fitting.objective.weighting import stated

Values = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


def covariance(problem: Problem, points: BlockedProblem, vector: Values, kind: str = DEFAULT) -> Values:
    """Covariance of the free values (n, n), of a kind of COVARIANCES, as `certainty.covariance` has it.

    Infinite on the diagonal for values that the data do not determine. Raises ValueError where `absolute` is asked for
    and the scan does not state every uncertainty. A robust loss does not come here: it is not taken in blocks.
    """
    plane = Tangent(points.jacobian(vector))
    if kind == "scaled":
        residual = points.residual(vector)
        freedom = np.count_nonzero(problem.root_weights) - plane.basis.shape[1]
        spread = plane.directions * np.sqrt(residual @ residual / freedom) if freedom > 0 else 0 * plane.directions
        return infinite(spread @ spread.T, plane.blind | (freedom < 1))
    error = None  # HC3 takes the residual of each point
    if kind != DEFAULT:
        error = problem.error(stated(problem.points, "absolute covariance", "choose robust or scaled"))
    middle, alone = np.zeros((plane.directions.shape[1],) * 2), False
    for sums in points.each(vector, functools.partial(_middle, plane=plane, error=error)):
        for products, any_alone in sums:
            middle += products
            alone = alone or any_alone
    unknown = plane.blind
    if alone:  # rare, and which values it concerns takes a second pass over all points
        unknown = unknown | _alone(points, vector, plane)
    return infinite(plane.directions @ middle @ plane.directions.T, unknown)


def _basis(linear: LinearSet, plane: Tangent) -> Values:
    """Rows (m, rank) of the orthonormal basis of the tangent plane, those of the points of one set."""
    return linear.slopes.T @ plane.directions[linear.places]


def _middle(linear: LinearSet, plane: Tangent, error: Values | None) -> tuple[Values, bool]:
    """What the squared errors of a set add to the middle of a sandwich, and whether a value fits a point alone.

    error (points,): the stated one of every point of the problem; without it that of HC3, r_k/(1 - h_k).
    """
    basis = _basis(linear, plane)
    if error is not None:
        spread = basis * error[linear.points.rows][:, None]
        return spread.T @ spread, False
    leverage = np.sum(basis**2, axis=1)
    alone = leverage > ALONE
    left_out = np.where(alone, 0.0, linear.residual / np.where(alone, 1.0, 1 - leverage))
    spread = basis * left_out[:, None]
    return spread.T @ spread, bool(alone.any())


def _alone(points: BlockedProblem, vector: Values, plane: Tangent) -> Mask:
    """Which values rest on points that one value fits exactly, and which so say nothing about their error.

    A value rests on such a point if that moves it by more than rounding of what any point does (`covariance.robust`).
    """

    def largest(linear: LinearSet) -> tuple[Values, Values]:
        basis = _basis(linear, plane)
        moved = np.abs(plane.directions @ basis.T)  # each value by a unit error of each point
        alone = np.sum(basis**2, axis=1) > ALONE
        return moved[:, alone].max(axis=1, initial=0.0), moved.max(axis=1, initial=0.0)

    pairs = [pair for sums in points.each(vector, largest) for pair in sums]
    at_alone, anywhere = (np.max(largest_moves, axis=0) for largest_moves in zip(*pairs, strict=True))
    unknown: Mask = at_alone > 1e-9 * anywhere
    return unknown


def systematic_shift(points: BlockedProblem, vector: Values, error: Values, pinned: Mask) -> Values:
    """Change of the values (n,) where every residual changes by its `error` e (points,) at once: D D' J'e.

    pinned (n,): values at a bound, which stay there. Infinite for values that the data do not determine.
    """
    total = np.zeros(len(vector))  # J'e
    for sums in points.each(vector, lambda linear: (linear.places, linear.slopes @ error[linear.points.rows])):
        for places, products in sums:
            total[places] += products
    shift = np.zeros(len(vector))
    plane = Tangent(points.jacobian(vector)[:, ~pinned])
    along = plane.directions @ (plane.directions.T @ total[~pinned])
    shift[~pinned] = np.where(plane.blind, np.inf, along)
    return shift
