"""Variable projection: the weights are the exact optimum, so only the shape is searched (golub1973).

With A(s) the weighted terms at a shape s, one column for each weight, and b the weighted measured values, the problem

    min |A(s) w - b|^2 over s and w   becomes   min |A(s) w(s) - b|^2 over s,   w(s) the best weights for s,

a search of the shape alone, in which no start of the weights is needed. The weights are held within their bounds
(`linear`). Derivatives by the shape are taken by differences of the reduced residual; the formula of golub1973 for
them is for weights without bounds.

There can be several minima. Grid points or quasi-random points (`starts`) are compared, the best are followed downhill
(`descent`), and from the lowest minimum a fine line along each coordinate looks for a lower one. This does not prove
that there is none; more `searches`, a finer `grid` and a finer `line` look further.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.blocks import in_blocks
from gonio.fitting.objective.cells.structure import in_cells
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.slopes import jacobian
from gonio.fitting.search import bulk
from gonio.fitting.search.cells.search import Settings
from gonio.fitting.search.cells.search import search as search_in_cells
from gonio.fitting.search.descent import Descent, LeastSquares, descend, polish
from gonio.fitting.search.groups import assembled, carried, common, is_grouped, parts, side_by_side, weights_couple
from gonio.fitting.search.reduced import Reduced, RelativeWeights
from gonio.fitting.search.refit import refit
from gonio.fitting.search.solver import Optimum, Progress, silent
from gonio.fitting.search.starts import local_minima, tried

Values = npt.NDArray[np.float64]
Rows = npt.NDArray[np.intp]
BETTER = 1e-10  # of E: by how much another minimum must be lower; the same one met twice differs by rounding
NEAR = 1e-6  # relative change of E or of the values that ends a search for a start
GLANCES, GLANCED = 3, 1e-2  # descents of a glance, and the relative change of E that ends one
SHORT = 10  # the first searches, which only find out where the last one starts, may try so many times fewer points


@dataclass(frozen=True)
class Projection:
    """Exact weights by bounded linear least squares; the shape by local searches from many starts.

    For fits of many scans at once (`fit_many`) the settings mean the same.

    Parameters
    ----------
    grid : int
        Starts along each side for two shape parameters, three times as many for one; three and more take 64
        quasi-random starts a dimension (or up to twice as many, for a power of two), and parameters with one value a
        group start from the optimum of one value for all groups.
    searches : int
        How many of the best starts are followed to their minimum; twice as many in logarithms, where the weights of a
        start are only near. 0 is one for each shape value, and four at least, because the number of minima grows with
        the dimension; for many scans at once it is two for one and two shape values, and four for three and more.
    max_steps : int
        Points that the last search may try; the others, which only find out where it starts, may try a tenth.
    line, rounds : int
        From the best minimum, so many points along each coordinate look for a better one, so many times.

    """

    grid: int = 15
    searches: int = 0
    max_steps: int = 2000
    line: int = 61
    rounds: int = 4
    name = "projection"

    def __post_init__(self) -> None:
        """ValueError for settings with which nothing could be searched."""
        least = {"grid": 1, "searches": 0, "max_steps": 1, "line": 2, "rounds": 0}
        for setting, lowest in least.items():
            if getattr(self, setting) < lowest:
                raise ValueError(f"{setting} must be at least {lowest}, and is {getattr(self, setting)}")

    def followed(self, dimensions: int) -> int:
        """How many starts are followed for so many shape values of one scan."""
        return self.searches or max(4, dimensions)

    def followed_of_many(self, dimensions: int) -> int:
        """The same for each of many scans."""
        return self.searches or (2 if dimensions <= 2 else 4)

    def search(self, problem: Problem, progress: Progress = silent) -> Optimum:
        """The values of least E; the history holds the best E after the first searches and after each later round.

        A problem splits where groups share nothing, very many points are searched on a sample of them first, and very
        many values in cells (`search.cells`).
        `rivals` of the optimum are where the other first searches ended.
        """
        if is_grouped(problem) and (split := parts(problem)):
            return self._search_parts(problem, split, progress)
        if blocked := in_blocks(problem):
            return bulk.search(problem, blocked, lambda few: self._search(few, progress))
        if cells := in_cells(problem):
            return search_in_cells(problem, cells, self._of_cells(progress))
        return self._search(problem, progress)

    def _search(self, problem: Problem, progress: Progress) -> Optimum:
        """All points at once: many starts, some searches, then the last digits of the best minimum."""
        if problem.logarithmic:
            return self._search_logarithmic(problem, progress)
        reduced = Reduced(problem)
        if not problem.free_shape:
            weights, residual = reduced.solve(problem.shape_start)
            cost = float(residual @ residual)
            return Optimum(weights, cost, False, reduced.evaluations, np.array([cost]))
        best, history, others = self._search_shape(reduced, progress)
        # the first searches may try a tenth of the steps: the best one, where that was too few, goes on with all
        if best.exhausted:
            best = _descend(reduced, best.point, self.max_steps)
        best = polish(reduced.squares, best)
        history[-1] = best.cost
        shape = reduced.shape(best.point)
        vector = np.concatenate([reduced.solve(shape)[0], shape])
        rivals = tuple(np.concatenate([reduced.solve(s)[0], s]) for s in map(reduced.shape, others))
        return Optimum(vector, best.cost, best.exhausted, reduced.evaluations, np.array(history), rivals=rivals)

    def glance(self, problem: Problem, hopeless: float = np.inf) -> float:
        """The least E that a few rough descents meet: near to the minimum, in a tenth of the time of a search.

        Where the first, from the best start, ends above `hopeless`, the others are not followed.
        """
        relative = RelativeWeights(problem) if problem.logarithmic else Reduced(problem)
        starts = replace(self, searches=GLANCES)._starts(relative) if problem.free_shape else [np.empty(0)]
        vectors = [np.concatenate([relative.solve(s)[0], s]) for s in map(relative.shape, starts)]
        least = np.inf
        for vector in vectors:
            least = min(least, refit(problem, vector, GLANCED, self.max_steps // SHORT).cost / problem.scale)
            if least > hopeless:
                break
        return least

    def _of_cells(self, progress: Progress) -> Settings:
        """What a search in cells takes of this one."""

        def of_shape(reduced: Reduced) -> list[Values]:
            best, _, others = self._search_shape(reduced, progress)
            return [reduced.shape(unit) for unit in (best.point, *others)]

        return Settings(lambda few: self.search(few, progress), of_shape, self.max_steps, self.line, self.rounds)

    def _search_parts(self, problem: Problem, split: list[tuple[Rows, Problem]], progress: Progress) -> Optimum:
        """Each part of a problem that splits, with its own starts: a search of few values each."""
        optima = []
        for rows, part in split:
            optima.append((rows, part, self.search(part)))
            progress(len(optima) / len(split))
        return assembled(problem, optima)

    def _search_shape(self, reduced: Reduced, progress: Progress) -> tuple[Descent, list[float], list[Values]]:
        """The lowest minimum that is met, its last digits not yet sought, the least E after each round, and others."""
        ends = self._ends(reduced, self._starts(reduced))
        best, others = ends[0], [end.point for end in ends[1:]]
        history = [best.cost]
        for rounds in range(1, self.rounds + 1):
            progress(rounds / self.rounds)
            better = self._crossings(reduced, best)
            end = self._ends(reduced, better)[0] if better else best
            if not end.cost < best.cost * (1 - BETTER):
                break
            best = end
            history.append(best.cost)
        return best, history, others

    def _ends(self, reduced: Reduced, starts: list[Values]) -> list[Descent]:
        """The minima downhill of several starts, the lowest first."""
        ends = [_descend(reduced, start, self.max_steps // SHORT) for start in starts]
        return sorted(ends, key=lambda end: end.cost)

    def _starts(self, reduced: Reduced) -> list[Values]:
        """The most promising starts in unit coordinates, best first: of a grid, its local minima.

        The best points of a grid are often neighbours, from which searches would meet one minimum. Quasi-random points
        have no neighbours to compare with: the best are taken as they are.
        """
        if is_grouped(reduced.problem):
            return self._starts_in_common(reduced)
        points, grid_shape = tried(reduced.dimensions, self.grid)
        costs = reduced.cost(points)
        candidates = local_minima(costs.reshape(grid_shape)) if grid_shape else np.arange(len(costs))
        order = candidates[np.argsort(costs[candidates])]
        return [points[k] for k in order[: self.followed(reduced.dimensions)]]

    def _starts_in_common(self, reduced: Reduced) -> list[Values]:
        """All groups at the optimum of one value for all, and from there each where its own points fit best."""
        problem = reduced.problem
        ungrouped = common(problem)
        vector = carried(self.search(ungrouped).vector, ungrouped, problem)
        start = reduced.unit(vector[problem.n_weights :])
        moved = start
        for k in range(len(problem.free_shape)):
            moved = side_by_side(reduced, moved, k, self.line)
        return [start, moved]

    def _crossings(self, reduced: Reduced, end: Descent) -> list[Values]:
        """Better points straight along each coordinate from a minimum.

        Where a weight is zero its shape has no slope, and the grid, coarse in the other coordinates, can miss the lobe
        that would help: a fine line through the minimum sees it.

        The groups of a parameter are moved together first, with one line for all of them. Where groups determine a
        weight together, none may be better off when all move: then each is also moved alone.
        """
        if is_grouped(reduced.problem):
            shapes = range(len(reduced.problem.free_shape))
            points = [side_by_side(reduced, end.point, k, self.line) for k in shapes]
            better = [point for point in points if reduced.cost(point) < end.cost * (1 - BETTER)]
            if better or not weights_couple(reduced.problem):
                return better
        better = []
        for k in range(reduced.dimensions):
            line = np.tile(end.point, (self.line, 1))
            line[:, k] = np.linspace(0.0, 1.0, self.line)
            costs = reduced.cost(line)
            at = int(np.argmin(costs))
            if costs[at] < end.cost * (1 - BETTER):
                better.append(line[at])
        return better

    def _search_logarithmic(self, problem: Problem, progress: Progress) -> Optimum:
        """Logarithms are not linear in the weights: from the best of the same starts, a search of all values.

        The starts are ranked by their E of logarithms, with the weights of least relative error (`reduced`).
        """
        relative = RelativeWeights(problem)
        more = replace(self, searches=2 * self.followed(relative.dimensions))
        starts = more._starts(relative) if problem.free_shape else [np.empty(0)]
        ends = []
        for start in starts:
            ends.append(refit(problem, relative.vector(start), NEAR, self.max_steps // SHORT))
            progress(len(ends) / len(starts))
        best = min(ends, key=lambda end: end.cost)
        end = refit(problem, best.point, max_steps=self.max_steps)
        exact = LeastSquares(
            problem.residual,
            problem.lower,
            problem.upper,
            jacobian=lambda vector: np.concatenate([jacobian(problem, vector), problem.penalty]),
            vectorised=True,
        )
        end = polish(exact, end)
        evaluations = relative.evaluations + end.evaluations + sum(end.evaluations for end in ends)
        history = np.array([best.cost, end.cost]) / problem.scale
        rivals = tuple(end.point for end in ends if end is not best)
        return Optimum(end.point, float(history[-1]), end.exhausted, evaluations, history, rivals=rivals)


# fewer trials a scan, where there are many
FOR_MANY = Projection(grid=13, searches=0, max_steps=500, line=11, rounds=2)


def _descend(reduced: Reduced, start: Values, max_steps: int) -> Descent:
    """The minimum downhill of a start in unit coordinates; only that of the best start is then polished."""
    return descend(reduced.squares, start, max_steps=max_steps, last_digits=False)
