"""A problem of the shape alone: at every shape the weights are their exact optimum, and only what they leave remains.

For one shape, E is a convex quadratic function of the weights, so their optimum within bounds is exact (`linear`). What
remains is a function of the few shape parameters, each a coordinate from 0 to 1 (golub1973): by ratios where a
parameter spans decades, else evenly (`objective.axes`).
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.descent import LeastSquares
from gonio.fitting.search.linear import bounded_least_squares

Values = npt.NDArray[np.float64]
TOGETHER = 2**14  # values of candidates that are computed at once: a processor's cache holds them


class Reduced:
    """A problem of the shape alone, in unit coordinates.

    Functions take one point (dimensions,) or several (n, dimensions), which together cost less than one by one.
    `evaluations` counts the shapes whose weights were solved.
    """

    def __init__(self, problem: Problem) -> None:
        self.problem = problem
        self.evaluations = 0
        self._axes = problem.axes()
        self._lower, self._upper = problem.lower[: problem.n_weights], problem.upper[: problem.n_weights]

    @property
    def dimensions(self) -> int:
        """How many shape values are free."""
        return len(self._axes)

    @property
    def squares(self) -> LeastSquares:
        """The residual as a local search takes it."""
        return LeastSquares(self.residual, 0.0, 1.0, scale=1.0, vectorised=True)

    def shape(self, unit: Values) -> Values:
        """The shape values at unit coordinates."""
        return self._axes.values(unit)

    def unit(self, shape: Values) -> Values:
        """The unit coordinates of shape values."""
        return self._axes.unit(shape)

    def solve(self, shape: Values) -> tuple[Values, Values]:
        """The exact weights (..., n_weights) for shapes (..., n_shape), and the residual whose squared sum is E.

        With smooth parameters the residual has the rows of their penalty too, and its squared sum is E plus that.
        """
        self.evaluations += shape.size // max(self.dimensions, 1) or 1  # an empty shape is one evaluation
        matrix, fixed = self.problem.design(shape)
        root = self.problem.root_weights
        matrix *= root[:, None]
        matrix, target = self.problem.penalised(matrix, self.problem.target - root * fixed, shape)
        weights = bounded_least_squares(matrix, target, self._lower, self._upper)
        return weights, ((matrix @ weights[..., None])[..., 0] - target) / np.sqrt(self.problem.scale)

    def residual(self, unit: Values) -> Values:
        """What the exact weights leave (..., points)."""
        if unit.ndim == 1:
            return self.solve(self.shape(unit))[1]
        return self.in_parts(lambda part: self.solve(self.shape(part))[1], unit)

    def in_parts(self, function: Callable[[Values], Values], unit: Values) -> Values:
        """`function` of many points (n, dimensions), so many at a time as are quick."""
        count = max(TOGETHER // len(self.problem.measured), 1)
        return np.concatenate([function(unit[at : at + count]) for at in range(0, len(unit), count)])

    def cost(self, unit: Values) -> Values:
        """E, and the penalty, at points (..., dimensions)."""
        squared: Values = np.sum(self.residual(unit) ** 2, axis=-1)
        return squared


class RelativeWeights(Reduced):
    """The shape of a logarithmic problem, with the weights whose relative errors are least: the exact ones are near.

    Logarithms are not linear in the weights. For small errors ln f - ln m is (f - m)/m, which is. So weights are those
    of the same problem with relative weighting, and only `cost` is that of logarithms.
    """

    def __init__(self, problem: Problem) -> None:
        super().__init__(replace(problem, weighting="relative"))
        self._logarithmic = problem

    def vector(self, unit: Values) -> Values:
        """Weights and shape (..., n) at one point or several."""
        shape = self.shape(unit) if unit.size else unit
        return np.concatenate([self.solve(shape)[0], shape], axis=-1)

    def cost(self, unit: Values) -> Values:
        """E of the logarithms at several points."""
        problem = self._logarithmic
        return self.in_parts(lambda part: problem.cost(problem.residual(self.vector(part))), unit)
