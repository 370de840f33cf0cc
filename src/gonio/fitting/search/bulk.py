"""Fits of very many points: starts are searched on a sample of them, the minimum on all.

A search from many starts takes hundreds of evaluations, and with millions of points each is dear. The minimum of a
sample that stands for all points is near one of theirs. Only from there is E of all points (`objective.blocks`)
followed downhill: by Newton steps with the exact curvature, and by a trust region where these do not get there.

With the residual r and its derivative J, a Newton step solves (J'J + C) d = -J'r, with C the curvature, the sum of each
residual times its own second derivative.
"""

import functools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.blocks import BlockedProblem
from gonio.fitting.objective.differences import SMALLEST
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.descent import Descent, LeastSquares, descend, polish
from gonio.fitting.search.refit import smallest
from gonio.fitting.search.solver import Optimum

Values = npt.NDArray[np.float64]

SAMPLE = 10_000  # points on which starts are searched
SEED = 20_260_000  # any number; always the same, so that a fit is repeatable
NEAR = 0.1  # of E on the sample: minima of so much more may be lower on all points, and are followed there too
APART = 1e-3  # of a value: minima that are nearer are one
SETTLED = 1e-10  # offset that is enough: of millions of points it moves a value by 1e-7 of its standard deviation
SOUGHT = 1e-6  # offset from which no further search is made: the derivatives are better than that
MOST_STEPS = 200  # points that a search of all may try: the minimum of the sample is near
INWARDS = (1.0, 0.1, 0.01, 0.001)  # of the step that a slope proposes, tried where it leads inwards from a bound


def search(problem: Problem, points: BlockedProblem, on_sample: Callable[[Problem], Optimum]) -> Optimum:
    """The values of least E of all points, from the minima that a search of a sample of them meets.

    points: the same problem in blocks. on_sample: the search of the sample, as a solver does it for few points.
    The history holds that of the sample, and E of all points at the end.
    """
    few = sample(problem)
    start = on_sample(few)
    evaluations_before = points.evaluations
    ends = [_minimum(problem, points, vector) for vector in (start.vector, *rivals(start, few))]
    best = min(ends, key=lambda end: end.cost)
    cost = best.cost / problem.scale
    evaluations = start.evaluations + points.evaluations - evaluations_before
    history = np.append(start.history, cost)
    return Optimum(best.point, cost, best.exhausted, evaluations, history, searched=len(few.measured))


def sample(problem: Problem) -> Problem:
    """The problem of some of its points, weighted so that sums over them are those over all on average.

    A third of the draws falls on all points alike, a third on all sets alike, and a third by what a point adds to the
    denominator of E. So neither a small set nor a narrow peak is missed. The mean number of draws of point k is

        p_k = SAMPLE/3 (1/points + 1/(sets * points of its set) + g_k m_k^2 / sum g m^2).

    A point that is drawn n times counts n/p_k times. There is one draw in each of SAMPLE stretches of the file that
    have the same sum of p: sums then scatter less than with draws of which none knows of the others.
    """
    size = SAMPLE
    group, share = problem.sets[1], problem.root_weights**2
    if not problem.logarithmic:  # the denominator for logarithms is the sum of the weights alone
        share = share * problem.measured**2
    counts = np.bincount(group)
    chance = size / 3 * (1 / len(group) + 1 / (np.count_nonzero(counts) * counts[group]) + share / share.sum())
    ends = np.cumsum(chance)
    at = (np.arange(size) + np.random.default_rng(SEED).random(size)) / size * ends[-1]
    # clipped, should rounding put the last draw beyond the sum of all chances
    drawn = np.bincount(np.searchsorted(ends, at).clip(max=len(group) - 1), minlength=len(group))
    rows = np.flatnonzero(drawn)
    part = problem.part(rows)
    own_weights = 1.0 if part.point_weights is None else part.point_weights
    return replace(part, point_weights=own_weights * drawn[rows] / chance[rows])


def rivals(start: Optimum, few: Problem) -> list[Values]:
    """Other minima of the sample that may be the lowest of all points; one that was met twice is taken once."""
    distinct = [start.vector]
    for vector in start.rivals:
        near = float(few.cost(few.residual(vector))) <= start.cost * (1 + NEAR)
        if near and not any(np.allclose(vector, other, rtol=APART, atol=APART * SMALLEST) for other in distinct):
            distinct.append(vector)
    return distinct[1:]


def _minimum(problem: Problem, points: BlockedProblem, start: Values) -> Descent:
    """The minimum of all points downhill of one of the sample.

    That one is near: Newton steps get there, and a search only where they do not. Derivatives and curvature are those
    of `points`. They cannot be taken by differences of its residual, whose rows mean something else at each vector.
    """
    low, high = problem.lower, problem.upper
    scale = np.maximum(np.abs(start), smallest(problem))
    squares = LeastSquares(points.residual, low, high, scale=scale, jacobian=points.jacobian)
    newton = functools.partial(polish, replace(squares, curvature=points.curvature), settled=SETTLED)
    value = points.residual(start)
    end = newton(Descent(start, float(value @ value), np.nan, False, 0))
    if end.offset <= SOUGHT and not _held_back(points, end, low, high):
        return end
    return newton(descend(squares, end.point, last_digits=False, max_steps=MOST_STEPS))


def _held_back(points: BlockedProblem, end: Descent, low: Values, high: Values) -> bool:
    """Whether a value at a bound would be better inside, by its slope and by a step inwards that takes it there.

    Newton steps leave a value that starts at its bound there, so that this has to be asked.
    The step is tried because a slope alone may be rounding: that of an extinction of 0, an even function, is none.
    """
    point = end.point
    value, slopes = points.residual(point), points.jacobian(point)
    downhill = -(slopes.T @ value)
    inwards = ((point <= low) & (downhill > 0)) | ((point >= high) & (downhill < 0))
    length = np.linalg.norm(slopes, axis=0)
    candidates = np.flatnonzero(inwards & (low < high) & (np.abs(downhill) > SOUGHT * length * np.linalg.norm(value)))
    for k in candidates:
        for share in INWARDS:  # of the Gauss-Newton step of this value alone, which may be too long
            inside = point.copy()
            inside[k] = np.clip(point[k] + share * downhill[k] / length[k] ** 2, low[k], high[k])
            moved = points.residual(inside)
            if float(moved @ moved) < float(value @ value):
                return True
    return False
