"""How the residual changes with very many values: one number for each point and free parameter.

Each point depends on one value of each parameter, that of its group. So the derivative (points, values) has as many
entries that are not zero as there are points times parameters, whatever the number of groups, and one difference of the
BRDF serves all groups of a parameter. `objective.slopes` has the formulas, and the same derivative as a matrix.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.cells.structure import Cells
from gonio.fitting.objective.differences import FORWARD, SMALLEST, derivative_by_group
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.slopes import residual_slopes

Values = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Slopes:
    """The derivative of a residual (points + m,) with m rows of a penalty.

    at_points (entries, points): of each point by its own value of each free entry. penalty (m, n): the rows of the
    penalty, which are zero for values that are not joint.
    """

    cells: Cells
    at_points: Values
    penalty: Values

    def __matmul__(self, vector: Values) -> Values:
        """The product (points + m,) with a change (n,) of the values."""
        moved = np.einsum("ep,ep->p", self.at_points, vector[self.cells.places])
        return np.concatenate([moved, self.penalty @ vector])

    def transposed_times(self, residual: Values) -> Values:
        """The product (n,) of the transpose with a residual (points + m,)."""
        points = self.cells.points
        return self._summed(self.at_points * residual[:points]) + self.penalty.T @ residual[points:]

    @property
    def squared_lengths(self) -> Values:
        """The squared length (n,) of each column."""
        out: Values = self._summed(self.at_points**2) + np.sum(self.penalty**2, axis=0)
        return out

    def scaled(self, factors: Values | float) -> "Slopes":
        """The derivative of the residual with each point (points,) multiplied by a factor."""
        return replace(self, at_points=self.at_points * factors)

    def _summed(self, numbers: Values) -> Values:
        """Numbers (entries, points) summed over the points of each value (n,)."""
        return np.bincount(self.cells.places.ravel(), numbers.ravel(), minlength=self.cells.size).astype(float)


def slopes(problem: Problem, cells: Cells, vector: Values, accurate: bool, penalty: Values) -> Slopes:
    """The derivative of the residual of a problem, with a penalty (m, n), at a vector (n,) of weights and shape.

    Good to some 1e-8 by forward differences, or, where that is asked for, to some 1e-12 (`differences`).
    """
    terms = problem.terms(vector[problem.n_weights :])
    columns = [terms[entry.name] for entry in problem.free_weights]
    modelled, at = problem.brdf(vector), problem.n_weights
    for entry in problem.free_shape:
        values = vector[at : at + entry.size]

        def brdf(moved: Values, at: int = at) -> Values:
            changed = vector.copy()
            changed[at : at + len(moved)] = moved
            return problem.brdf(changed)

        if accurate:
            columns.append(derivative_by_group(brdf, values, entry.group, entry.lower, entry.upper, SMALLEST))
        else:
            inwards = np.where(entry.upper - values >= values - entry.lower, 1.0, -1.0)
            moved = values + FORWARD * np.maximum(np.abs(values), SMALLEST) * inwards
            columns.append((brdf(moved) - modelled) / (moved - values)[entry.group])
        at += entry.size
    by_entry = residual_slopes(problem, modelled, np.stack(columns, axis=1))
    return Slopes(cells, np.ascontiguousarray(by_entry.T), penalty)
