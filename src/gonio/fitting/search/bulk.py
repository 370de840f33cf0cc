"""Fits of very many points: starts are searched on a sample of them, the minimum on all."""

import functools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.blocks import BlockedProblem
from gonio.fitting.objective.differences import SMALLEST
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.descent import Descent, LeastSquares, descend, polish
from gonio.fitting.search.solver import Optimum

Values = npt.NDArray[np.float64]

SAMPLE = 10_000  # points on which starts are searched
SEED = 20_260_000  # any number; always the same, so that a fit is repeatable
NEAR = 0.1  # of E on the sample: minima of so much more may be lower on all points, and are followed there too
APART = 1e-3  # of a value: minima that are nearer are one
SETTLED = 1e-10  # offset that is enough: of millions of points it moves a value by 1e-7 of its standard deviation
SOUGHT = 1e-6  # offset from which no further search is made: the derivatives are better than that
MOST_STEPS = 200  # points that a search of all may try: the minimum of the sample is near
INWARDS = (1.0, 0.1, 0.01, 0.001)  # of the step that a slope proposes, tried where a value presses against its bound


def search(problem: Problem, points: BlockedProblem, on_sample: Callable[[Problem], Optimum]) -> Optimum:
    """The values of least E of all points, from the minima that a search of a sample of them meets.

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
    each of SAMPLE stretches of the file. A point that is drawn with chance p counts 1/p times.
    """
    size = SAMPLE
    group, share = problem.sets[1], problem.root_weights**2
    if not problem.logarithmic:
        share = share * problem.measured**2
    counts = np.bincount(group)
    chance = size / 3 * (1 / len(group) + 1 / (np.count_nonzero(counts) * counts[group]) + share / share.sum())
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


def _minimum(problem: Problem, points: BlockedProblem, start: Values) -> Descent:
    """The minimum of all points downhill of one of the sample.

    That one is near: Newton steps get there, and a search only where they do not.
    """
    low, high = problem.lower, problem.upper
    scale = np.maximum(np.abs(start), SMALLEST)
    squares = LeastSquares(points.residual, low, high, scale=scale, jacobian=points.jacobian)
    newton = functools.partial(polish, replace(squares, curvature=points.curvature), settled=SETTLED)
    value = points.residual(start)
    end = newton(Descent(start, float(value @ value), np.nan, False, 0))
    if end.offset <= SOUGHT and not _held_back(points, end, low, high):
        return end
    return newton(descend(squares, end.point, last_digits=False, max_steps=MOST_STEPS))


def _held_back(points: BlockedProblem, end: Descent, low: Values, high: Values) -> bool:
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
