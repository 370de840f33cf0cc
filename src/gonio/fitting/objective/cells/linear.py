"""The residual as a linear function near a vector, as a matrix or in cells, whichever its problem takes.

What needs derivatives, such as uncertainties and the noise of a scan, asks here and need not know which of both it is.
"""

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.cells.plane import CellPlane
from gonio.fitting.objective.cells.slopes import Slopes, slopes
from gonio.fitting.objective.cells.structure import in_cells
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.slopes import jacobian, quick_jacobian
from gonio.fitting.objective.tangent import Tangent

Values = npt.NDArray[np.float64]
Linear = Slopes | Values  # of matrices too, `linear @ change` is the change of the residual
Plane = CellPlane | Tangent


def linearised(problem: Problem, vector: Values, accurate: bool = True) -> Linear:
    """The derivative of the residual with the rows of its penalty, good to some 1e-12, or quickly to 1e-8."""
    if cells := in_cells(problem):
        return slopes(problem, cells, vector, accurate, problem.penalty)
    if not accurate:
        return quick_jacobian(problem, vector)
    return np.concatenate([jacobian(problem, vector), problem.penalty])


def of_points(problem: Problem, vector: Values) -> Linear:
    """The derivative of the residual of the points alone, good to some 1e-12; strengths of smoothing may be open."""
    if cells := in_cells(problem):
        return slopes(problem, cells, vector, True, np.empty((0, len(vector))))
    return jacobian(problem, vector)


def scaled(linear: Linear, factors: Values) -> Linear:
    """The derivative of a residual that is multiplied by a factor at each point (points,)."""
    return linear.scaled(factors) if isinstance(linear, Slopes) else factors[:, None] * linear


def plane_of(linear: Linear) -> Plane:
    """The tangent plane of a derivative."""
    return CellPlane(linear) if isinstance(linear, Slopes) else Tangent(linear)
