"""What every lane of a stack shares: which column of the design each weight and shape value is, and where.

Points are sorted into cells, in which every weight and every shape parameter has one value: sums over points are then
sums over cells, and a design with one weight a group needs no columns of zeros.
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
FOLD = 12  # rows that are added up in one stride; cells of many rows are filled up to a multiple


@dataclass(frozen=True)
class Layout:
    """What a compiled search depends on: hashable, so that one compilation serves every scan of the same form.

    weights, shape: names of the free weights and shape parameters with the column that each has in every cell, counted
    within the weights and within the shape. n, d: how many columns of each. held: names of the others.
    cells, rows: the points are an array (cells, rows), in which short cells are filled up by points that do not count.
    """

    model: Model
    weights: tuple[tuple[str, tuple[int, ...]], ...]
    shape: tuple[tuple[str, tuple[int, ...]], ...]
    n: int
    d: int
    held: tuple[str, ...]
    cells: int
    rows: int

    @functools.cached_property
    def depends(self) -> dict[str, tuple[str, ...]]:
        """The terms that each free shape parameter enters, by name."""
        terms = self.model.terms
        return {name: tuple(w for w in terms if name in declarations(terms[w])) for name, _ in self.shape}


@dataclass(frozen=True, eq=False)
class Shared:
    """The numbers that go with a Layout, alike for all lanes.

    order (cells * rows): the point that each place holds; filled marks those that only fill up. geometry: components
    (cells, rows, 1). held (cells, 1, 1) by name.
    """

    layout: Layout
    order: Places
    filled: npt.NDArray[np.bool_]
    geometry: Geometry
    held: dict[str, Values]

    def thinned(self, most: int) -> "Shared":
        """Every so many points of each cell, some `most` in all."""
        every = -(-self.order.size // most)
        form = (self.layout.cells, self.layout.rows)
        order, filled = self.order.reshape(form)[:, ::every], self.filled.reshape(form)[:, ::every]
        layout = replace(self.layout, rows=order.shape[1])
        geometry = Geometry(*(part[:, ::every] for part in self.geometry))
        return Shared(layout, order.ravel(), filled.ravel(), geometry, self.held)

    def placed(self, values: Values) -> Values:
        """Values of points (lanes, points) as a search takes them: (cells, rows, lanes), the last axis contiguous."""
        layout = self.layout
        return np.ascontiguousarray(values[:, self.order].T).reshape(layout.cells, layout.rows, -1)


def laid_out(problem: Problem) -> Shared:
    """The layout of a problem whose points are those of every lane."""
    grouped = [e.group for e in problem.entries if e.size > 1]
    cell = combined(grouped) if grouped else np.zeros(len(problem.measured), dtype=np.intp)
    sizes = np.bincount(cell)
    cells, rows = len(sizes), int(sizes.max())
    rows = -(-rows // FOLD) * FOLD if rows > 4 * FOLD else rows
    order, filled = np.empty((cells, rows), dtype=np.intp), np.zeros((cells, rows), dtype=bool)
    by_cell = np.argsort(cell, kind="stable")
    for c, begin in enumerate(np.cumsum(sizes) - sizes):
        order[c] = by_cell[begin]
        order[c, : sizes[c]] = by_cell[begin : begin + sizes[c]]
        filled[c, sizes[c] :] = True
    first = order[:, 0]
    layout = Layout(
        problem.model,
        _columns(problem.free_weights, first),
        _columns(problem.free_shape, first),
        problem.n_weights,
        len(problem.names) - problem.n_weights,
        tuple(e.name for e in problem.entries if e.held is not None),
        cells,
        rows,
    )
    held = {e.name: np.asarray(e.held)[e.group[first]][:, None, None] for e in problem.entries if e.held is not None}
    parts: list[Any] = [np.asarray(part, dtype=float) for part in np.broadcast_arrays(*problem.geometry)]
    geometry = Geometry(*(part[order][:, :, None] for part in parts))
    return Shared(layout, order.ravel(), filled.ravel(), geometry, held)


def _columns(entries: tuple[Entry, ...], first: Places) -> tuple[tuple[str, tuple[int, ...]], ...]:
    found, at = [], 0
    for entry in entries:
        found.append((entry.name, tuple((at + entry.group[first]).tolist())))
        at += entry.size
    return tuple(found)
