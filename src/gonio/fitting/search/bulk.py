"""Fits of very many points: starts are searched on a sample of them, the minimum and its covariance on all."""

import functools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from gonio.fitting.certainty.covariance import ALONE, DEFAULT, infinite
from gonio.fitting.objective.blocks import Bulk, Linear
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.weighting import stated
from gonio.fitting.search.descent import Descent, Tangent, descend, polish
from gonio.fitting.solution import Optimum

Values = npt.NDArray[np.float64]

SAMPLE = 10_000  # points on which starts are searched
SEED = 20_260_000  # any number; always the same, so that a fit is repeatable
NEAR = 0.1  # of E on the sample: minima of so much more may be lower on all points, and are followed there too
APART = 1e-3  # of a value: minima that are nearer are one
SETTLED = 1e-10  # offset that is enough: of millions of points it moves a value by 1e-7 of its standard deviation
SOUGHT = 1e-6  # offset from which no further search is made: the derivatives are better than that
INWARDS = (1.0, 0.1, 0.01, 0.001)  # of the step that a slope proposes, tried where a value presses against its bound
SMALLEST = 1e-3  # scale of a value that is zero, as the covariance takes it


def search(problem: Problem, points: Bulk, on_sample: Callable[[Problem], Optimum]) -> Optimum:
    """The values of least E of all points, from the minima that a search of a sample of them finds.

    The history holds that of the sample, and E of all points at the end.
    """
    few = sample(problem)
    start = on_sample(few)
    begun = points.evaluations
    ends = [_minimum(problem, points, vector) for vector in (start.vector, *_rivals(start, few))]
    best = min(ends, key=lambda end: end.cost)
    cost = best.cost / problem.scale
    evaluations = start.evaluations + points.evaluations - begun
    history = np.append(start.history, cost)
    return Optimum(best.point, cost, best.exhausted, evaluations, history, searched=len(few.measured))


def sample(problem: Problem) -> Problem:
    """The problem of some of its points, weighted so that sums over them are those over all on average.

    A point is drawn as often as a third of the draws alike over all points, a third over sets, and a third by what it
    adds to the denominator of E have it, so that neither a small set nor a narrow peak is missed. There is one draw in
    each of SAMPLE stretches of the file.
    """
    size = SAMPLE
    group, told = problem.sets[1], problem.root_weights**2
    if not problem.logarithmic:
        told = told * problem.measured**2
    counts = np.bincount(group)
    chance = size / 3 * (1 / len(group) + 1 / (np.count_nonzero(counts) * counts[group]) + told / told.sum())
    ends = np.cumsum(chance)
    at = (np.arange(size) + np.random.default_rng(SEED).random(size)) / size * ends[-1]
    drawn = np.bincount(np.searchsorted(ends, at).clip(max=len(group) - 1), minlength=len(group))
    rows = np.flatnonzero(drawn)
    part = problem.part(rows)
    given = 1.0 if part.point_weights is None else part.point_weights
    return replace(part, point_weights=given * drawn[rows] / chance[rows])


def _rivals(start: Optimum, few: Problem) -> list[Values]:
    """Other minima of the sample that may be the lowest of all points, the lowest first."""
    kept = [start.vector]
    for vector in start.rivals:
        near = float(few.cost(few.residual(vector))) <= start.cost * (1 + NEAR)
        if near and not any(np.allclose(vector, other, rtol=APART, atol=APART * SMALLEST) for other in kept):
            kept.append(vector)
    return kept[1:]


def _minimum(problem: Problem, points: Bulk, start: Values) -> Descent:
    """The minimum of all points downhill of one of the sample.

    That one is near: Newton steps get there, and a search only where they do not.
    """
    low, high = problem.lower, problem.upper
    scale = np.maximum(np.abs(start), SMALLEST)
    newton = functools.partial(
        polish,
        points.residual,
        lower=low,
        upper=high,
        scale=scale,
        jacobian=points.jacobian,
        curvature=points.curvature,
        settled=SETTLED,
    )
    value = points.residual(start)
    end = newton(end=Descent(start, float(value @ value), np.nan, False, 0))
    if end.offset <= SOUGHT and not _held_back(points, end, low, high):
        return end
    found = descend(
        points.residual, end.point, low, high, scale=scale, jacobian=points.jacobian, last_digits=False, max_steps=200
    )
    return newton(end=found)


def _held_back(points: Bulk, end: Descent, low: Values, high: Values) -> bool:
    """Whether a value at a bound would be better inside, by its slope and by a step inwards that takes it there.

    The step is tried because a slope alone may be rounding: that of an extinction of 0, an even function, is none.
    """
    point = end.point
    value, slopes = points.residual(point), points.jacobian(point)
    downhill = -(slopes.T @ value)
    inwards = ((point <= low) & (downhill > 0)) | ((point >= high) & (downhill < 0))
    size = np.linalg.norm(slopes, axis=0)
    pressed = np.flatnonzero(inwards & (low < high) & (np.abs(downhill) > SOUGHT * size * np.linalg.norm(value)))
    for k in pressed:
        for share in INWARDS:
            inside = point.copy()
            inside[k] = np.clip(point[k] + share * downhill[k] / size[k] ** 2, low[k], high[k])
            moved = points.residual(inside)
            if float(moved @ moved) < float(value @ value):
                return True
    return False


def covariance(problem: Problem, points: Bulk, vector: Values, kind: str = DEFAULT) -> Values:
    """Covariance of the free values (n, n), as `fit.covariance` has it, summed over blocks."""
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
    for found in points.each(vector, functools.partial(_middle, plane=plane, error=error)):
        for part, any_alone in found:
            middle += part
            alone = alone or any_alone
    unknown = plane.blind
    if alone:
        unknown = unknown | _alone(points, vector, plane)
    return infinite(plane.directions @ middle @ plane.directions.T, unknown)


def _basis(linear: Linear, plane: Tangent) -> Values:
    """Rows (m, rank) of the orthonormal basis of the tangent plane."""
    return linear.slopes.T @ plane.directions[linear.places]


def _middle(linear: Linear, plane: Tangent, error: Values | None) -> tuple[Values, bool]:
    """What the squared errors of a sheet add to the middle of a sandwich, and whether a value fits a point alone."""
    basis = _basis(linear, plane)
    if error is not None:
        spread = basis * error[linear.sheet.rows][:, None]
        return spread.T @ spread, False
    leverage = np.sum(basis**2, axis=1)
    alone = leverage > ALONE
    left = np.where(alone, 0.0, linear.residual / np.where(alone, 1.0, 1 - leverage))
    spread = basis * left[:, None]
    return spread.T @ spread, bool(alone.any())


def _alone(points: Bulk, vector: Values, plane: Tangent) -> npt.NDArray[np.bool_]:
    """Which values rest on points that one value fits exactly, and which so say nothing about their error."""

    def largest(linear: Linear) -> tuple[Values, Values]:
        basis = _basis(linear, plane)
        moved = np.abs(plane.directions @ basis.T)
        alone = np.sum(basis**2, axis=1) > ALONE
        return moved[:, alone].max(axis=1, initial=0.0), moved.max(axis=1, initial=0.0)

    pairs = [pair for found in points.each(vector, largest) for pair in found]
    at_alone, anywhere = (np.max(part, axis=0) for part in zip(*pairs, strict=True))
    unknown: npt.NDArray[np.bool_] = at_alone > 1e-9 * anywhere
    return unknown


def systematic_shift(points: Bulk, vector: Values, error: Values, pinned: npt.NDArray[np.bool_]) -> Values:
    """Change of the values (n,) where every residual changes by its `error` at once, as `fit.covariance` has it."""
    total = np.zeros(len(vector))
    for found in points.each(vector, lambda linear: (linear.places, linear.slopes @ error[linear.sheet.rows])):
        for places, part in found:
            total[places] += part
    shift = np.zeros(len(vector))
    plane = Tangent(points.jacobian(vector)[:, ~pinned])
    along = plane.directions @ (plane.directions.T @ total[~pinned])
    shift[~pinned] = np.where(plane.blind, np.inf, along)
    return shift
