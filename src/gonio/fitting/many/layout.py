"""The layout of a stack's points and parameters, which every lane shares.

Points are sorted into cells. A cell is a set of points in which every weight and every shape parameter has one value:
with ks grouped by theta_i and sigma by channel, each pair of an incidence angle and a channel is a cell. A sum over the
points that belong to a weight is then a sum over whole cells. A design matrix with one weight a group would be mostly
zeros; here each term has one dense column of points, and a tuple says which weight it belongs to in every cell.

Only the layout of the problem is here; the measured values of the lanes are read and laid out in `reading`.
"""

import functools
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.entries import Entry
from gonio.fitting.objective.problem import Problem
from gonio.geometry import Geometry
from gonio.measured.distinct import combined
from gonio.model import Model, declarations

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
FOLD = 12  # rows that are added up in one stride; cells of many rows are padded to a multiple of it


@dataclass(frozen=True)
class Layout:
    """What a compiled search depends on, apart from numbers.

    It is hashable, because it is a static argument of the functions that JAX compiles: one compilation serves every
    stack whose problem has the same layout.
    """

    model: Model
    weights: tuple[tuple[str, tuple[int, ...]], ...]  # name of a free weight, and its column in every cell: 0 to n - 1
    shape: tuple[tuple[str, tuple[int, ...]], ...]  # the same of the free shape parameters: 0 to d - 1
    n: int  # free weights, counting one for each group
    d: int  # free shape values, counting one for each group
    held: tuple[str, ...]  # names of the weights and shape parameters that are not free
    cells: int  # points are an array (cells, rows)
    rows: int  # points of the largest cell, padding included; shorter cells are padded to it
    logarithmic: bool = False  # whether logarithms are compared

    @functools.cached_property
    def depends(self) -> dict[str, tuple[str, ...]]:
        """The terms that each free shape parameter enters, by name: the others have no derivative by it."""
        terms = self.model.terms
        return {name: tuple(w for w in terms if name in declarations(terms[w])) for name, _ in self.shape}


@dataclass(frozen=True, eq=False)
class Shared:
    """A Layout with the numbers that are the same for all lanes."""

    layout: Layout
    order: Places  # (cells * rows,): the index of the point at each place
    filled: npt.NDArray[np.bool_]  # (cells * rows,): which places are padding
    geometry: Geometry  # directions of the points, each component (cells, rows, 1)
    held: dict[str, Values]  # held values by name, (cells, 1, 1)

    def thinned(self, most: int) -> "Shared":
        """About `most` places in all, evenly spaced within each cell.

        The first place of a cell is always taken, and it is never padding: no cell loses all of its points.
        """
        stride = -(-self.order.size // most)
        form = (self.layout.cells, self.layout.rows)
        order, filled = self.order.reshape(form)[:, ::stride], self.filled.reshape(form)[:, ::stride]
        layout = replace(self.layout, rows=order.shape[1])
        geometry = Geometry(*(component[:, ::stride] for component in self.geometry))
        return Shared(layout, order.ravel(), filled.ravel(), geometry, self.held)

    def placed(self, values: Values) -> Values:
        """Values of points (lanes, points) as a search takes them: (cells, rows, lanes), the last axis contiguous.

        Padding repeats a point, so its values are not zero: the caller has to give it no weight.
        """
        layout = self.layout
        return np.ascontiguousarray(values[:, self.order].T).reshape(layout.cells, layout.rows, -1)


def laid_out(problem: Problem) -> Shared:
    """The layout of a problem whose points are those of every lane."""
    grouped = [e.group for e in problem.entries if e.size > 1]
    cell = combined(grouped) if grouped else np.zeros(len(problem.measured), dtype=np.intp)
    sizes = np.bincount(cell)
    cells, rows = len(sizes), int(sizes.max())
    # Above 4 * FOLD rows the padding adds less than a quarter; a cell of one row would become eleven parts padding.
    rows = -(-rows // FOLD) * FOLD if rows > 4 * FOLD else rows
    order, filled = np.empty((cells, rows), dtype=np.intp), np.zeros((cells, rows), dtype=bool)
    # A stable sort keeps the points of a cell in the order of the scan, through which `thinned` takes even steps.
    by_cell = np.argsort(cell, kind="stable")
    for c, begin in enumerate(np.cumsum(sizes) - sizes):
        # Padding repeats a direction of the cell, where the terms are those of a real point. Made-up directions could
        # give NaN, and a weight of zero does not remove a NaN from a sum.
        order[c] = by_cell[begin]
        order[c, : sizes[c]] = by_cell[begin : begin + sizes[c]]
        filled[c, sizes[c] :] = True
    first = order[:, 0]  # one point of each cell stands for all: they are in the same group of every parameter
    layout = Layout(
        problem.model,
        _columns(problem.free_weights, first),
        _columns(problem.free_shape, first),
        problem.n_weights,
        len(problem.names) - problem.n_weights,
        tuple(e.name for e in problem.entries if e.held is not None),
        cells,
        rows,
        problem.logarithmic,
    )
    held = {e.name: np.asarray(e.held)[e.group[first]][:, None, None] for e in problem.entries if e.held is not None}
    components: list[Any] = [np.asarray(part, dtype=float) for part in np.broadcast_arrays(*problem.geometry)]
    geometry = Geometry(*(component[order][:, :, None] for component in components))
    return Shared(layout, order.ravel(), filled.ravel(), geometry, held)


def _columns(entries: tuple[Entry, ...], first: Places) -> tuple[tuple[str, tuple[int, ...]], ...]:
    """Each entry's name with its column in every cell; entries follow each other, with one column for each group.

    first (cells,): a point of each cell. Tuples of int, not arrays, because a Layout has to be hashable.
    """
    columns, begin = [], 0
    for entry in entries:
        columns.append((entry.name, tuple((begin + entry.group[first]).tolist())))
        begin += entry.size
    return tuple(columns)
