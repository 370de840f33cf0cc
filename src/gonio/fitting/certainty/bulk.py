"""Covariance and systematic shift of fits of very many points, summed over blocks of them."""

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
    """Covariance of the free values (n, n), of a kind of COVARIANCES, as `certainty.covariance` has it."""
    plane = Tangent(points.jacobian(vector))
    if kind == "scaled":
        residual = points.residual(vector)
        freedom = len(problem.measured) - plane.basis.shape[1]
        spread = plane.directions * np.sqrt(residual @ residual / freedom) if freedom > 0 else 0 * plane.directions
        return infinite(spread @ spread.T, plane.blind | (freedom < 1))
    error = None
    if kind != DEFAULT:
        error = problem.error(stated(problem.points, "absolute covariance", "choose robust or scaled"))
    middle, alone = np.zeros((plane.directions.shape[1],) * 2), False
    for sums in points.each(vector, functools.partial(_middle, plane=plane, error=error)):
        for part, any_alone in sums:
            middle += part
            alone = alone or any_alone
    unknown = plane.blind
    if alone:
        unknown = unknown | _alone(points, vector, plane)
    return infinite(plane.directions @ middle @ plane.directions.T, unknown)


def _basis(linear: LinearSet, plane: Tangent) -> Values:
    """Rows (m, rank) of the orthonormal basis of the tangent plane."""
    return linear.slopes.T @ plane.directions[linear.places]


def _middle(linear: LinearSet, plane: Tangent, error: Values | None) -> tuple[Values, bool]:
    """What the squared errors of a set add to the middle of a sandwich, and whether a value fits a point alone."""
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
    """Which values rest on points that one value fits exactly, and which so say nothing about their error."""

    def largest(linear: LinearSet) -> tuple[Values, Values]:
        basis = _basis(linear, plane)
        moved = np.abs(plane.directions @ basis.T)
        alone = np.sum(basis**2, axis=1) > ALONE
        return moved[:, alone].max(axis=1, initial=0.0), moved.max(axis=1, initial=0.0)

    pairs = [pair for sums in points.each(vector, largest) for pair in sums]
    at_alone, anywhere = (np.max(part, axis=0) for part in zip(*pairs, strict=True))
    unknown: Mask = at_alone > 1e-9 * anywhere
    return unknown


def systematic_shift(points: BlockedProblem, vector: Values, error: Values, pinned: Mask) -> Values:
    """Change of the values (n,) where every residual changes by its `error` (points,) at once.

    pinned (n,): values at a bound, which stay there.
    """
    total = np.zeros(len(vector))
    for sums in points.each(vector, lambda linear: (linear.places, linear.slopes @ error[linear.points.rows])):
        for places, part in sums:
            total[places] += part
    shift = np.zeros(len(vector))
    plane = Tangent(points.jacobian(vector)[:, ~pinned])
    along = plane.directions @ (plane.directions.T @ total[~pinned])
    shift[~pinned] = np.where(plane.blind, np.inf, along)
    return shift
