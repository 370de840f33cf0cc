"""The search of problems in cells: where it starts, and the minimum of all values from there.

A search from many starts needs few points. A shape that all cells share is therefore searched on some of the cells,
which tell it as well as all do; where groups have shape values of their own, the optimum of one value for all groups
comes first, and each group then moves to where its own points fit best (`search.groups`). From these shapes, with the
weights that are exact for them, all values are searched together (`descent`).
"""

from collections.abc import Callable
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.cells.structure import Cells
from gonio.fitting.objective.problem import LARGE, Problem
from gonio.fitting.search.bulk import rivals
from gonio.fitting.search.cells.descent import changed, descend
from gonio.fitting.search.cells.weights import InCells
from gonio.fitting.search.descent import SEARCHED
from gonio.fitting.search.groups import carried, common, is_grouped, side_by_side
from gonio.fitting.search.reduced import Reduced
from gonio.fitting.search.solver import Optimum

Values = npt.NDArray[np.float64]

FEWEST = 8  # cells on which a shared shape is searched, at the least
NEAR = 1e-6  # relative change of E that ends a search for a start
SHORT = 10  # the first searches may try so many times fewer points
BETTER = 1e-10  # of E: by how much another minimum must be lower


class Settings(NamedTuple):
    """What a search in cells takes of its solver.

    of_few: the search of a smaller problem. of_shape: shapes (n_shape,) of minima that a search of the shape alone
    meets, the best first. The others are settings of `Projection`.
    """

    of_few: Callable[[Problem], Optimum]
    of_shape: Callable[[Reduced], list[Values]]
    max_steps: int
    line: int
    rounds: int


def search(problem: Problem, cells: Cells, settings: Settings) -> Optimum:
    """The values of least E of a problem that `in_cells` takes; the history holds E after each round."""
    relative = replace(problem, weighting="relative") if problem.logarithmic else problem
    reduced = InCells(relative)  # logarithms are not linear in the weights, and relative errors are near

    def exact(vector: Values) -> Values:
        shape = vector[problem.n_weights :]
        return np.concatenate([reduced.solve(shape)[0], shape])

    whole = changed(problem, cells, exact=None if problem.logarithmic or not problem.free_shape else exact)
    shapes, before, searched = _starts(problem, cells, reduced, settings)
    # the first searches only find out which start leads lowest
    steps = settings.max_steps
    starts = [np.concatenate([reduced.solve(shape)[0], shape]) for shape in shapes]
    ends = [descend(whole, start, NEAR, steps // SHORT) for start in starts]
    ends.sort(key=lambda end: end.cost)
    best = descend(whole, ends[0].point, SEARCHED, steps)
    evaluations = before + best.evaluations + sum(end.evaluations for end in ends)
    history = [best.cost]
    for _ in range(settings.rounds if is_grouped(problem) else 0):
        unit = reduced.unit(best.point[problem.n_weights :])
        moved = reduced.shape(_each_moved(reduced, unit, settings.line))
        end = descend(whole, np.concatenate([reduced.solve(moved)[0], moved]), SEARCHED, steps)
        evaluations += end.evaluations
        if not end.cost < best.cost * (1 - BETTER):
            break
        best = end
        history.append(best.cost)
    end = descend(whole, best.point, SEARCHED, steps, last_digits=True)
    history[-1] = end.cost
    return Optimum(
        end.point,
        end.cost / problem.scale,
        end.exhausted,
        evaluations + end.evaluations + reduced.evaluations,
        np.array(history) / problem.scale,
        searched,
        tuple(end.point for end in ends[1:]),
    )


def few_cells(problem: Problem, cells: Cells) -> Problem | None:
    """The problem of some of its cells, evenly among them, few enough for a search of one matrix.

    None where the fewest that would do are already too many.
    """
    count = sum(len(bucket.rows) for bucket in cells.buckets)
    share = len(problem.measured) * len(problem.names) / count**2  # numbers in the matrix of a single cell
    wanted = max(int((LARGE / 8 / share) ** 0.5), FEWEST)
    if wanted >= count:
        return None
    cell = np.empty(len(problem.measured), dtype=np.intp)
    numbered = 0
    for bucket in cells.buckets:
        of_bucket = np.broadcast_to(np.arange(len(bucket.rows))[:, None] + numbered, bucket.rows.shape)
        cell[bucket.rows[bucket.real]] = of_bucket[bucket.real]
        numbered += len(bucket.rows)
    first = np.unique(cell, return_index=True)[1]
    in_order = np.argsort(np.argsort(first))  # as the file has them: neighbours are alike, and an even sample is fair
    chosen = np.isin(in_order, np.linspace(0, count - 1, wanted).astype(np.intp))
    rows = np.flatnonzero(chosen[cell] & (problem.root_weights > 0))
    few = problem.part(np.flatnonzero(chosen[cell])) if rows.size and problem.measured[rows].any() else None
    return None if few is None or few.is_large else few


def _starts(problem: Problem, cells: Cells, reduced: InCells, settings: Settings) -> tuple[list[Values], int, int]:
    """Shapes (n_shape,) to start from, the evaluations that they took, and on how many points they were searched."""
    n = problem.n_weights
    if not problem.free_shape:
        return [problem.shape_start], 0, 0
    if is_grouped(problem):
        ungrouped = common(problem)
        optimum = settings.of_few(ungrouped)
        start = carried(optimum.vector, ungrouped, problem)[n:]
        moved = reduced.shape(_each_moved(reduced, reduced.unit(start), settings.line))
        return [start, moved], optimum.evaluations, optimum.searched
    few = few_cells(problem, cells)
    if few is None:
        return settings.of_shape(reduced), 0, 0
    optimum = settings.of_few(few)
    vectors = (optimum.vector, *rivals(optimum, few))
    return [vector[few.n_weights :] for vector in vectors], optimum.evaluations, len(few.measured)


def _each_moved(reduced: InCells, unit: Values, line: int) -> Values:
    """Unit coordinates with each group of each shape parameter moved to where its own points fit best."""
    for k, entry in enumerate(reduced.problem.free_shape):
        if entry.size > 1:
            unit = side_by_side(reduced, unit, k, line)
    return unit
