"""Variable projection: the weights are the exact optimum, so only the shape is searched (golub1973)."""

import itertools
from dataclasses import dataclass, replace

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
    """

    grid: int = 15
    searches: int = 4
    max_steps: int = 200
    name = "projection"

    def search(self, problem: Problem, progress: Progress = silent) -> Optimum:
        """The values of least E; the history holds the best E after each local search."""
        if problem.logarithmic:
            return self._search_logarithmic(problem, progress)
        reduced = _Reduced(problem)
        if not problem.free_shape:
            weights, cost = reduced.weights(problem.shape_start), 0.0
            vector = np.concatenate([weights, problem.shape_start])
            cost = float(problem.cost(problem.residual(vector)))
            return Optimum(vector, cost, False, 1, np.array([cost]))
        best, exhausted, history = None, False, []
        starts = self._starts(reduced)
        for done, start in enumerate(starts, start=1):
            point, cost, stopped = self._descend(reduced, start)
            if best is None or cost < best[1]:
                best, exhausted = (point, cost), stopped
            history.append(best[1])
            progress(done / len(starts))
        assert best is not None
        shape = reduced.shape(best[0])
        vector = np.concatenate([reduced.weights(shape), shape])
        return Optimum(vector, best[1], exhausted, reduced.evaluations, np.array(history))

    def _starts(self, reduced: "_Reduced") -> list[Values]:
        """The most promising points of a grid, in unit coordinates: its local minima, best first."""
        dimensions = reduced.dimensions
        if dimensions > 2:
            from scipy.stats import qmc

            points = qmc.Sobol(dimensions, seed=0).random(2 ** int(np.ceil(np.log2(64 * dimensions))))
            order = np.argsort([reduced.cost(p) for p in points])
            return [points[k] for k in order[: self.searches]]
        axis = np.linspace(0.0, 1.0, self.grid if dimensions == 2 else 3 * self.grid)
        shape = (len(axis),) * dimensions
        points = np.array(list(itertools.product(axis, repeat=dimensions)))
        costs = np.array([reduced.cost(p) for p in points]).reshape(shape)
        padded = np.pad(costs, 1, constant_values=np.inf)
        shifts = [s for s in itertools.product((-1, 0, 1), repeat=dimensions) if any(s)]
        around = [
            padded[tuple(slice(1 + d, 1 + d + n) for d, n in zip(s, shape, strict=True))] for s in shifts
        ]
        minima = np.flatnonzero((costs <= np.min(around, axis=0)).ravel())
        order = minima[np.argsort(costs.ravel()[minima])]
        return [points[k] for k in order[: self.searches]]

    def _descend(self, reduced: "_Reduced", start: Values) -> tuple[Values, float, bool]:
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
        return point, cost, found.status == 0

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


class _Reduced:
    """A problem of the shape alone, in coordinates from 0 to 1; ratios where a parameter spans decades."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.evaluations = 0
        n = problem.n_weights
        self._lower, self._upper = problem.lower[:n], problem.upper[:n]
        low, high = problem.lower[n:], problem.upper[n:]
        if not (np.isfinite(low).all() and np.isfinite(high).all()):
            raise ValueError("shape parameters need finite bounds")
        self._ratio = problem.steps_by_ratio
        self._low, self._high = low, high
        with np.errstate(divide="ignore", invalid="ignore"):
            self._log_low, self._log_high = np.log(low), np.log(high)

    @property
    def dimensions(self) -> int:
        return len(self._low)

    def shape(self, unit: Values) -> Values:
        linear = self._low + unit * (self._high - self._low)
        with np.errstate(invalid="ignore"):
            ratio = np.exp(self._log_low + unit * (self._log_high - self._log_low))
        return np.clip(np.where(self._ratio, ratio, linear), self._low, self._high)

    def weights(self, shape: Values) -> Values:
        matrix, target = self._system(shape)
        return bounded_least_squares(matrix, target, self._lower, self._upper)

    def residual(self, unit: Values) -> Values:
        matrix, target = self._system(self.shape(unit))
        found: Values = matrix @ bounded_least_squares(matrix, target, self._lower, self._upper) - target
        return found / np.sqrt(self.problem.scale)

    def cost(self, unit: Values) -> float:
        residual = self.residual(unit)
        return float(residual @ residual)

    def _system(self, shape: Values) -> tuple[Values, Values]:
        self.evaluations += 1
        matrix, fixed = self.problem.design(shape)
        root = self.problem.root_weights
        return root[:, None] * matrix, self.problem.target - root * fixed
