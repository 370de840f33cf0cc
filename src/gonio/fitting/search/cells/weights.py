"""Exact weights for one shape in cells: bounded linear least squares, cell by cell.

Where no weight is joint, each cell is a problem of its own few weights (`search.linear`). Where some are, all are
solved together by elimination (`objective.cells.plane`); weights that leave their bounds are then held there and the
others solved again, until each is inside or its slope points outwards (portugal1994's block pivoting).
"""

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.cells.plane import CellPlane
from gonio.fitting.objective.cells.slopes import Slopes
from gonio.fitting.objective.cells.structure import Cells, best_split, cells
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.linear import bounded_least_squares
from gonio.fitting.search.reduced import Reduced

Values = npt.NDArray[np.float64]

PIVOTS = 30  # rounds in which weights are held at bounds or let go; a few are usual


class InCells(Reduced):
    """A problem of the shape alone, with exact weights, of a problem that `in_cells` takes."""

    def __init__(self, problem: Problem) -> None:
        super().__init__(problem)
        self._cells = _of_weights(problem)

    def solve(self, shape: Values) -> tuple[Values, Values]:
        """The exact weights (..., n_weights) for shapes (..., n_shape), and the residual whose squared sum is E."""
        if shape.ndim > 1:
            pairs = [self.solve(one) for one in shape]
            return np.stack([weights for weights, _ in pairs]), np.stack([left for _, left in pairs])
        self.evaluations += 1
        problem, terms = self.problem, self.problem.terms(shape)
        columns = problem.root_weights * np.array([terms[entry.name] for entry in problem.free_weights])
        without = problem.brdf(np.concatenate([np.zeros(problem.n_weights), shape]))  # what held weights add
        of_weights, of_shape = np.split(problem.penalty, [problem.n_weights], axis=1)
        target = np.concatenate([problem.target - problem.root_weights * without, -of_shape @ shape])
        slopes = Slopes(self._cells, columns, of_weights)
        weights = self._pivoted(slopes, target) if len(self._cells.joint) else self._each(slopes, target)
        return weights, (slopes @ weights - target) / np.sqrt(problem.scale)

    def _each(self, slopes: Slopes, target: Values) -> Values:
        """The weights of each cell on their own."""
        weights = np.zeros(len(self._lower))
        for bucket in self._cells.buckets:
            k, r = bucket.rows.shape
            matrix = np.zeros((k, r, bucket.own.shape[1]))
            for column, values in zip(bucket.column, slopes.at_points, strict=True):
                matrix[np.arange(k)[:, None], np.arange(r), column] = bucket.gathered(values)
            bounds = self._lower[bucket.own], self._upper[bucket.own]
            weights[bucket.own] = bounded_least_squares(matrix, bucket.gathered(target), *bounds)
        return weights

    def _pivoted(self, slopes: Slopes, target: Values) -> Values:
        """All weights together."""
        inside, weights = np.ones(len(self._lower), dtype=bool), np.zeros(len(self._lower))
        for _ in range(PIVOTS):
            at_bounds = np.where(inside, 0.0, weights)
            weights = at_bounds + CellPlane(slopes, inside).moved(target - slopes @ at_bounds)
            slope = slopes.transposed_times(slopes @ weights - target)
            below, above = inside & (weights < self._lower), inside & (weights > self._upper)
            weights = np.clip(weights, self._lower, self._upper)
            freed = ~inside & np.where(weights <= self._lower, slope < 0, slope > 0)
            if not (below | above | freed).any():
                break
            inside = (inside & ~below & ~above) | freed
        return weights


def _of_weights(problem: Problem) -> Cells:
    """The cells of a problem's free weights alone."""
    split = best_split(problem)
    assert split is not None  # the problem is in cells
    return cells(problem.free_weights, split.cell, split.joint[: problem.n_weights])
