"""The shapes from which searches start: a grid of one or two dimensions, quasi-random points of three and more.

A grid of d dimensions needs the d-th power of its points along one. Sobol's sequence (sobol1967) fills a cube evenly
with any number of points; a grid in turn shows its local minima.
"""

import itertools

import numpy as np
import numpy.typing as npt

from gonio.fitting.search.sobol import sobol

Values = npt.NDArray[np.float64]

QUASI_RANDOM = 64  # points a dimension, where there are three shape values and more
ON_A_LINE = 3  # times as many points on a line as along one side of a plane


def tried(dimensions: int, grid: int) -> tuple[Values, tuple[int, ...]]:
    """Coordinates (n, dimensions) from 0 to 1 to try, and the shape of their grid, () for points that lie in none.

    grid: points along each side of a plane; a line has ON_A_LINE times as many. Three dimensions and more take points
    of Sobol's sequence, at least QUASI_RANDOM a dimension. The same points come at every call.
    """
    if dimensions > 2:
        # the sequence fills the cube evenly at powers of two; not scrambled, it needs no random numbers
        return sobol(dimensions, int(np.ceil(np.log2(QUASI_RANDOM * dimensions)))), ()
    axis = np.linspace(0.0, 1.0, grid if dimensions == 2 else ON_A_LINE * grid)
    form = (len(axis),) * dimensions
    points = np.array(list(itertools.product(axis, repeat=dimensions)))
    return points.reshape(len(axis) ** dimensions, dimensions), form


def local_minima(costs: Values) -> npt.NDArray[np.intp]:
    """The flat places of a grid's points that are no higher than any neighbour, diagonal ones included.

    Beyond the edges of the grid everything is higher. Each point of a plateau is a minimum.
    """
    padded = np.pad(costs, 1, constant_values=np.inf)
    shifts = [s for s in itertools.product((-1, 0, 1), repeat=costs.ndim) if any(s)]
    around = [padded[tuple(slice(1 + d, 1 + d + n) for d, n in zip(s, costs.shape, strict=True))] for s in shifts]
    return np.flatnonzero((costs <= np.min(around, axis=0)).ravel())
