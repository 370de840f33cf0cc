"""Variable projection: the weights are the exact optimum, so only the shape is searched (golub1973)."""

import itertools
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import least_squares

from gonio.fit.linear import bounded_least_squares
from gonio.fit.problem import Problem
from gonio.fit.solution import Optimum
from gonio.fit.solver import Progress, silent

Values = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Projection:
    """Exact weights by bounded linear least squares; the shape by local searches from many starts.

    grid: starts a dimension, for one and two shape parameters; three and more take 64 quasi-random starts a dimension.
    searches: how many of the best starts are followed to their minimum. max_steps: evaluations in one such search.
    line, rounds: from the best minimum, so many points along each coordinate look for a better one, so many times.
    """

    grid: int = 15
    searches: int = 4
    max_steps: int = 200
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
        found = [self._descend(reduced, start) for start in self._starts(reduced)]
        found.sort(key=lambda end: end.cost)
        history, rounds = [found[0].cost], 0
        while rounds < self.rounds:
            rounds += 1
            progress(rounds / self.rounds)
            better = [self._descend(reduced, point) for point in self._crossings(reduced, found[0])]
            better.sort(key=lambda end: end.cost)
            if not better or not better[0].cost < found[0].cost * (1 - 1e-12):
                break
            found.insert(0, better[0])
            history.append(found[0].cost)
        shape = reduced.shape(found[0].point)
        vector = np.concatenate([reduced.solve(shape)[0], shape])
        return Optimum(vector, found[0].cost, found[0].exhausted, reduced.evaluations, np.array(history))

    def _starts(self, reduced: "_Reduced") -> list[Values]:
        """The most promising points of a grid, in unit coordinates: its local minima, best first."""
        dimensions = reduced.dimensions
        if dimensions > 2:
            from scipy.stats import qmc

            points = qmc.Sobol(dimensions, scramble=False).random(2 ** int(np.ceil(np.log2(64 * dimensions))))
            order = np.argsort([reduced.cost(p) for p in points])
            return [points[k] for k in order[: self.searches]]
        axis = np.linspace(0.0, 1.0, self.grid if dimensions == 2 else 3 * self.grid)
        shape = (len(axis),) * dimensions
        points = np.array(list(itertools.product(axis, repeat=dimensions)))
        costs = np.array([reduced.cost(p) for p in points]).reshape(shape)
        padded = np.pad(costs, 1, constant_values=np.inf)
        shifts = [s for s in itertools.product((-1, 0, 1), repeat=dimensions) if any(s)]
        around = [padded[tuple(slice(1 + d, 1 + d + n) for d, n in zip(s, shape, strict=True))] for s in shifts]
        minima = np.flatnonzero((costs <= np.min(around, axis=0)).ravel())
        order = minima[np.argsort(costs.ravel()[minima])]
        return [points[k] for k in order[: self.searches]]

    def _crossings(self, reduced: "_Reduced", end: "_End") -> list[Values]:
        """Better points straight along each coordinate from a minimum.

        Where a weight is zero its shape has no slope, and the grid, coarse in the other coordinates, can miss the lobe
        that would help: a fine line through the minimum sees it.
        """
        better = []
        for k in range(reduced.dimensions):
            line = np.tile(end.point, (self.line, 1))
            line[:, k] = np.linspace(0.0, 1.0, self.line)
            costs = np.array([reduced.cost(point) for point in line])
            at = int(np.argmin(costs))
            if costs[at] < end.cost * (1 - 1e-12):
                better.append(line[at])
        return better

    def _descend(self, reduced: "_Reduced", start: Values) -> "_End":
        found = least_squares(
            reduced.residual,
            np.clip(start, 1e-9, 1 - 1e-9),
            bounds=(0.0, 1.0),
            jac="3-point",
            xtol=1e-15,
            ftol=1e-15,
            gtol=1e-15,
            max_nfev=self.max_steps,
        )
        point, cost = found.x, reduced.cost(found.x)
        for k in range(reduced.dimensions):  # the search stays strictly inside: a bound itself may be better
            for edge in (0.0, 1.0):
                if abs(point[k] - edge) < 0.02:
                    at_edge = point.copy()
                    at_edge[k] = edge
                    if (edge_cost := reduced.cost(at_edge)) <= cost:
                        point, cost = at_edge, edge_cost
        return _End(point, cost, found.status == 0)

    def _search_logarithmic(self, problem: Problem, progress: Progress) -> Optimum:
        """Logarithms are not linear in the weights: start where relative errors are least, then search everything."""
        near = self.search(replace(problem, weighting="relative"), progress)
        span = np.where(np.isfinite(problem.upper), problem.upper, np.inf)
        inside = np.clip(near.vector, problem.lower + 1e-12 * np.maximum(np.abs(near.vector), 1), span)
        found = least_squares(
            problem.residual,
            inside,
            bounds=(problem.lower, problem.upper),
            x_scale=np.maximum(np.abs(inside), 1e-6),
            jac="3-point",
            xtol=1e-14,
            ftol=1e-14,
            gtol=1e-14,
            max_nfev=self.max_steps,
        )
        cost = float(problem.cost(problem.residual(found.x)))
        start_cost = float(problem.cost(problem.residual(near.vector)))
        vector = found.x if cost <= start_cost else near.vector
        history = np.minimum.accumulate([start_cost, cost])
        return Optimum(vector, float(history[-1]), found.status == 0, near.evaluations + found.nfev, history)


class _End(NamedTuple):
    """Where a local search ended, in unit coordinates."""

    point: Values
    cost: float
    exhausted: bool


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
        """The exact weights for one shape, and the residual whose squared sum is E."""
        self.evaluations += 1
        matrix, fixed = self.problem.design(shape)
        root = self.problem.root_weights
        matrix *= root[:, None]
        target = self.problem.target - root * fixed
        weights = bounded_least_squares(matrix, target, self._lower, self._upper)
        return weights, (matrix @ weights - target) / np.sqrt(self.problem.scale)

    def residual(self, unit: Values) -> Values:
        return self.solve(self.shape(unit))[1]

    def cost(self, unit: Values) -> float:
        residual = self.residual(unit)
        return float(residual @ residual)
