"""Variable projection: the weights are the exact optimum, so only the shape is searched (golub1973)."""

import itertools
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gonio.fitting.certainty.covariance import jacobian
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search import bulk
from gonio.fitting.search.descent import Descent, descend, polish
from gonio.fitting.search.groups import assembled, carried, common, is_grouped, parts, side_by_side, weights_couple
from gonio.fitting.search.linear import bounded_least_squares
from gonio.fitting.search.refit import refit
from gonio.fitting.search.solver import Progress, silent
from gonio.fitting.solution import Optimum

Values = npt.NDArray[np.float64]
Rows = npt.NDArray[np.intp]
BETTER = 1e-10  # of E: by how much another minimum must be lower; the same one found twice differs by rounding
NEAR = 1e-6  # relative change of E that ends a search for a start
TOGETHER = 2**14  # values of candidates that are computed at once: a processor's cache holds them


@dataclass(frozen=True)
class Projection:
    """Exact weights by bounded linear least squares; the shape by local searches from many starts.

    grid: starts a dimension, for one and two shape parameters; three and more take 64 quasi-random starts a dimension,
        and parameters with one value a group start from the optimum of one value for all groups.
    searches: how many of the best starts are followed to their minimum; twice as many in logarithms, where the weights
        of a start are only near. max_steps: points that the last search may try; the others, which only find out where
        it starts, may try a tenth.
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
        if is_grouped(problem) and (split := parts(problem)):
            return self._search_parts(problem, split, progress)
        if problem.bulk:
            return bulk.search(problem, problem.bulk, lambda few: self._search(few, progress))
        return self._search(problem, progress)

    def _search(self, problem: Problem, progress: Progress) -> Optimum:
        """All points at once."""
        if problem.logarithmic:
            return self._search_logarithmic(problem, progress)
        reduced = _Reduced(problem)
        if not problem.free_shape:
            weights, residual = reduced.solve(problem.shape_start)
            cost = float(residual @ residual)
            return Optimum(weights, cost, False, reduced.evaluations, np.array([cost]))
        best, history, others = self._search_shape(reduced, progress)
        if best.exhausted:
            best = _descend(reduced, best.point, self.max_steps)
        best = polish(reduced.residual, best, 0.0, 1.0, scale=1.0, vectorised=True)
        history[-1] = best.cost
        shape = reduced.shape(best.point)
        vector = np.concatenate([reduced.solve(shape)[0], shape])
        rivals = tuple(np.concatenate([reduced.solve(s)[0], s]) for s in map(reduced.shape, others))
        return Optimum(vector, best.cost, best.exhausted, reduced.evaluations, np.array(history), rivals=rivals)

    def _search_parts(self, problem: Problem, split: list[tuple[Rows, Problem]], progress: Progress) -> Optimum:
        found = []
        for rows, part in split:
            found.append((rows, part, self.search(part)))
            progress(len(found) / len(split))
        return assembled(problem, found)

    def _search_shape(self, reduced: "_Reduced", progress: Progress) -> tuple[Descent, list[float], list[Values]]:
        """The lowest minimum that is found, its last digits left, the least E after each round, and other minima."""
        ends = self._ends(reduced, self._starts(reduced))
        best, others = ends[0], [end.point for end in ends[1:]]
        history = [best.cost]
        for rounds in range(1, self.rounds + 1):
            progress(rounds / self.rounds)
            better = self._crossings(reduced, best)
            found = self._ends(reduced, better)[0] if better else best
            if not found.cost < best.cost * (1 - BETTER):
                break
            best = found
            history.append(best.cost)
        return best, history, others

    def _ends(self, reduced: "_Reduced", starts: list[Values]) -> list[Descent]:
        """The minima downhill of several starts, the lowest first."""
        ends = [_descend(reduced, start, self.max_steps // 10) for start in starts]
        return sorted(ends, key=lambda end: end.cost)

    def _starts(self, reduced: "_Reduced") -> list[Values]:
        """The most promising points of a grid, in unit coordinates: its local minima, best first."""
        dimensions = reduced.dimensions
        if is_grouped(reduced.problem):
            return self._starts_in_common(reduced)
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

    def _starts_in_common(self, reduced: "_Reduced") -> list[Values]:
        """All groups at the optimum of one value for all, and from there each where its own points fit best."""
        problem = reduced.problem
        alike = common(problem)
        found = carried(self.search(alike).vector, alike, problem)
        start = reduced.unit(found[problem.n_weights :])
        moved = start
        for k in range(len(problem.free_shape)):
            moved = side_by_side(reduced, moved, k, self.line)
        return [start, moved]

    def _crossings(self, reduced: "_Reduced", end: Descent) -> list[Values]:
        """Better points straight along each coordinate from a minimum.

        Where a weight is zero its shape has no slope, and the grid, coarse in the other coordinates, can miss the lobe
        that would help: a fine line through the minimum sees it.
        """
        if is_grouped(reduced.problem):
            shapes = range(len(reduced.problem.free_shape))
            tried = [side_by_side(reduced, end.point, k, self.line) for k in shapes]
            better = [point for point in tried if reduced.cost(point) < end.cost * (1 - BETTER)]
            if better or not weights_couple(reduced.problem):
                return better
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
        """Logarithms are not linear in the weights: from the best of the same starts, a search of all values."""
        relative = _Relative(problem)
        starts = replace(self, searches=2 * self.searches)._starts(relative) if problem.free_shape else [np.empty(0)]
        ends = []
        for start in starts:
            ends.append(refit(problem, relative.vector(start), NEAR, self.max_steps // 10))
            progress(len(ends) / len(starts))
        best = min(ends, key=lambda end: end.cost)
        found = refit(problem, best.point, max_steps=self.max_steps)
        found = polish(
            problem.residual,
            found,
            problem.lower,
            problem.upper,
            jacobian=lambda vector: np.concatenate([jacobian(problem, vector), problem.penalty]),
            vectorised=True,
        )
        evaluations = relative.evaluations + found.evaluations + sum(end.evaluations for end in ends)
        history = np.array([best.cost, found.cost]) / problem.scale
        rivals = tuple(end.point for end in ends if end is not best)
        return Optimum(found.point, float(history[-1]), found.exhausted, evaluations, history, rivals=rivals)


def _descend(reduced: "_Reduced", start: Values, max_steps: int) -> Descent:
    return descend(
        reduced.residual, start, 0.0, 1.0, scale=1.0, max_steps=max_steps, last_digits=False, vectorised=True
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

    def unit(self, shape: Values) -> Values:
        return self._axes.unit(shape)

    def solve(self, shape: Values) -> tuple[Values, Values]:
        """The exact weights for one shape or several, and the residual whose squared sum is E."""
        self.evaluations += shape.size // max(self.dimensions, 1) or 1
        matrix, fixed = self.problem.design(shape)
        root = self.problem.root_weights
        matrix *= root[:, None]
        matrix, target = self.problem.penalised(matrix, self.problem.target - root * fixed, shape)
        weights = bounded_least_squares(matrix, target, self._lower, self._upper)
        return weights, ((matrix @ weights[..., None])[..., 0] - target) / np.sqrt(self.problem.scale)

    def residual(self, unit: Values) -> Values:
        """What the exact weights leave at one point or several (n, dimensions), which together cost less."""
        if unit.ndim == 1:
            return self.solve(self.shape(unit))[1]
        return self.in_parts(lambda some: self.solve(self.shape(some))[1], unit)

    def in_parts(self, function: Callable[[Values], Values], unit: Values) -> Values:
        """`function` of many points, so many at a time as are quick."""
        some = max(TOGETHER // len(self.problem.measured), 1)
        return np.concatenate([function(unit[at : at + some]) for at in range(0, len(unit), some)])

    def cost(self, unit: Values) -> Values:
        squared: Values = np.sum(self.residual(unit) ** 2, axis=-1)
        return squared


class _Relative(_Reduced):
    """The shape of a logarithmic problem, with the weights whose relative errors are least: the exact ones are near."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(replace(problem, weighting="relative"))
        self._logarithmic = problem

    def vector(self, unit: Values) -> Values:
        """Weights and shape at one point or several."""
        shape = self.shape(unit) if unit.size else unit
        return np.concatenate([self.solve(shape)[0], shape], axis=-1)

    def cost(self, unit: Values) -> Values:
        """E of the logarithms at several points."""
        whole = self._logarithmic
        return self.in_parts(lambda some: whole.cost(whole.residual(self.vector(some))), unit)
