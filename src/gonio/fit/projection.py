"""Variable projection: the weights are the exact optimum, so only the shape is searched (golub1973)."""

import itertools
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gonio.fit.covariance import jacobian
from gonio.fit.descent import SEARCHED, Descent, descend, polish
from gonio.fit.linear import bounded_least_squares
from gonio.fit.problem import Problem
from gonio.fit.refit import refit
from gonio.fit.solution import Optimum
from gonio.fit.solver import Progress, silent

Values = npt.NDArray[np.float64]
BETTER = 1e-10  # of E: by how much another minimum must be lower; the same one found twice differs by rounding
NEAR = 1e-6  # relative change of E that ends a search for a start
TOGETHER = 2**14  # values of candidates that are computed at once: a processor's cache holds them


@dataclass(frozen=True)
class Projection:
    """Exact weights by bounded linear least squares; the shape by local searches from many starts.

    grid: starts a dimension, for one and two shape parameters; three and more take 64 quasi-random starts a dimension.
    searches: how many of the best starts are followed to their minimum. max_steps: points that the last
        search may try; the others, which only find out where it starts, may try a tenth.
    line, rounds: from the best minimum, so many points along each coordinate look for a better one, so many times.
    """

    grid: int = 15
    searches: int = 4
    max_steps: int = 2000
    line: int = 61
    rounds: int = 4
    name = "projection"

    def search(self, problem: Problem, progress: Progress = silent) -> Optimum:
        """The values of least E; the history holds the best E after the first searches and after each later round."""
        if problem.logarithmic:
            return self._search_logarithmic(problem, progress)
        reduced = _Reduced(problem)
        if not problem.free_shape:
            weights, residual = reduced.solve(problem.shape_start)
            cost = float(residual @ residual)
            return Optimum(weights, cost, False, reduced.evaluations, np.array([cost]))
        best, history = self._search_shape(reduced, progress)
        if best.exhausted:
            best = _descend(reduced, best.point, SEARCHED, self.max_steps)
        best = polish(reduced.residual, best, 0.0, 1.0, scale=1.0, vectorised=True)
        history[-1] = best.cost
        shape = reduced.shape(best.point)
        vector = np.concatenate([reduced.solve(shape)[0], shape])
        return Optimum(vector, best.cost, best.exhausted, reduced.evaluations, np.array(history))

    def _search_shape(
        self, reduced: "_Reduced", progress: Progress, tolerance: float = SEARCHED
    ) -> tuple[Descent, list[float]]:
        """The lowest minimum that is found, its last digits left, and the least E after each round."""
        best = self._best(reduced, self._starts(reduced), tolerance)
        history = [best.cost]
        for rounds in range(1, self.rounds + 1):
            progress(rounds / self.rounds)
            better = self._crossings(reduced, best)
            found = self._best(reduced, better, tolerance) if better else best
            if not found.cost < best.cost * (1 - BETTER):
                break
            best = found
            history.append(best.cost)
        return best, history

    def _best(self, reduced: "_Reduced", starts: list[Values], tolerance: float) -> Descent:
        """The lowest minimum downhill of several starts."""
        ends = [_descend(reduced, start, tolerance, self.max_steps // 10) for start in starts]
        return min(ends, key=lambda end: end.cost)

    def _starts(self, reduced: "_Reduced") -> list[Values]:
        """The most promising points of a grid, in unit coordinates: its local minima, best first."""
        dimensions = reduced.dimensions
        if dimensions > 2:
            from scipy.stats import qmc

            points = qmc.Sobol(dimensions, scramble=False).random(2 ** int(np.ceil(np.log2(64 * dimensions))))
            order = np.argsort(reduced.cost(points))
            return [points[k] for k in order[: self.searches]]
        axis = np.linspace(0.0, 1.0, self.grid if dimensions == 2 else 3 * self.grid)
        shape = (len(axis),) * dimensions
        points = np.array(list(itertools.product(axis, repeat=dimensions)))
        costs = reduced.cost(points).reshape(shape)
        padded = np.pad(costs, 1, constant_values=np.inf)
        shifts = [s for s in itertools.product((-1, 0, 1), repeat=dimensions) if any(s)]
        around = [padded[tuple(slice(1 + d, 1 + d + n) for d, n in zip(s, shape, strict=True))] for s in shifts]
        minima = np.flatnonzero((costs <= np.min(around, axis=0)).ravel())
        order = minima[np.argsort(costs.ravel()[minima])]
        return [points[k] for k in order[: self.searches]]

    def _crossings(self, reduced: "_Reduced", end: Descent) -> list[Values]:
        """Better points straight along each coordinate from a minimum.

        Where a weight is zero its shape has no slope, and the grid, coarse in the other coordinates, can miss the lobe
        that would help: a fine line through the minimum sees it.
        """
        better = []
        for k in range(reduced.dimensions):
            line = np.tile(end.point, (self.line, 1))
            line[:, k] = np.linspace(0.0, 1.0, self.line)
            costs = reduced.cost(line)
            at = int(np.argmin(costs))
            if costs[at] < end.cost * (1 - BETTER):
                better.append(line[at])
        return better

    def _search_logarithmic(self, problem: Problem, progress: Progress) -> Optimum:
        """Logarithms are not linear in the weights: start where relative errors are least, then search everything."""
        reduced = _Reduced(replace(problem, weighting="relative"))
        shape = problem.shape_start
        if problem.free_shape:
            shape = reduced.shape(self._search_shape(reduced, progress, NEAR)[0].point)
        near = np.concatenate([reduced.solve(shape)[0], shape])
        inside = np.clip(near, problem.lower + 1e-12 * np.maximum(np.abs(near), 1), problem.upper)
        found = refit(problem, inside, max_steps=self.max_steps)
        found = polish(
            problem.residual,
            found,
            problem.lower,
            problem.upper,
            jacobian=lambda vector: jacobian(problem, vector),
            vectorised=True,
        )
        cost = float(problem.cost(problem.residual(found.point)))
        start_cost = float(problem.cost(problem.residual(near)))
        vector = found.point if cost <= start_cost else near
        history = np.minimum.accumulate([start_cost, cost])
        return Optimum(vector, float(history[-1]), found.exhausted, reduced.evaluations + found.evaluations, history)


def _descend(reduced: "_Reduced", start: Values, tolerance: float, max_steps: int) -> Descent:
    return descend(
        reduced.residual,
        start,
        0.0,
        1.0,
        scale=1.0,
        tolerance=tolerance,
        max_steps=max_steps,
        last_digits=False,
        vectorised=True,
    )


class _Reduced:
    """A problem of the shape alone, in unit coordinates."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.evaluations = 0
        self._axes = problem.axes()
        self._lower, self._upper = problem.lower[: problem.n_weights], problem.upper[: problem.n_weights]

    @property
    def dimensions(self) -> int:
        return len(self._axes)

    def shape(self, unit: Values) -> Values:
        return self._axes.values(unit)

    def solve(self, shape: Values) -> tuple[Values, Values]:
        """The exact weights for one shape or several, and the residual whose squared sum is E."""
        self.evaluations += shape.size // max(self.dimensions, 1) or 1
        matrix, fixed = self.problem.design(shape)
        root = self.problem.root_weights
        matrix *= root[:, None]
        target = self.problem.target - root * fixed
        weights = bounded_least_squares(matrix, target, self._lower, self._upper)
        return weights, ((matrix @ weights[..., None])[..., 0] - target) / np.sqrt(self.problem.scale)

    def residual(self, unit: Values) -> Values:
        """What the exact weights leave at one point or several (n, dimensions), which together cost less."""
        if unit.ndim == 1:
            return self.solve(self.shape(unit))[1]
        some = max(TOGETHER // len(self.problem.measured), 1)
        parts = [self.shape(unit[at : at + some]) for at in range(0, len(unit), some)]
        return np.concatenate([self.solve(part)[1] for part in parts])

    def cost(self, unit: Values) -> Values:
        squared: Values = np.sum(self.residual(unit) ** 2, axis=-1)
        return squared
