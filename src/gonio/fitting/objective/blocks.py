"""Very many points by their distinct directions, in blocks that a processor's cache holds.

A file of several channels states each direction once a channel: what a model's terms are there is computed once. What a
search needs of the residual r and its Jacobian J at a vector of values is r'r, J'r and J'J alone. Reduced by QR block
after block (demmel2012), both have as many rows as there are sets times values, and exactly the same products: with
[J r] = Q R, the columns of the small triangle R have the lengths and angles of those of J and r. Sums of J'J and J'r
would be as small, but they have the square of the condition number of J, and so lose twice as many digits.

Second derivatives are exact but for the differences of the terms (`term_derivatives`). With the BRDF f = sum_k w_k
t_k(s) at each point, and g the root of its weight, half the squared residual has beside J'J the curvature

    sum over points of  r g d2f,   d2f/dw_k ds_i = dt_k/ds_i,   d2f/ds_i ds_j = sum_k w_k d2t_k/ds_i ds_j

and for logarithms, where r = g (ln f - ln m) and d2 ln f = d2f/f - df df'/f^2, the sum of r g (d2f/f - df df'/f^2).

This changes how sums are formed, not what is minimised: the results are those of all points at once, to rounding and
the errors of differences. Searches on a sample of the points are in `search.bulk`.
"""

import functools
import weakref
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.term_derivatives import TermDerivatives, Terms
from gonio.geometry import Geometry
from gonio.measured.dataset import DIRECTIONS, geometry
from gonio.measured.distinct import distinct_rows, first_of, repeats
from gonio.measured.polarimetry.ratio import whole

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
Result = TypeVar("Result")

MANY = 200_000  # points in use from which a search takes them in blocks
MOST_VALUES = 500  # free values up to which it does: the reduced rows have as many columns
SIZE = 2**16  # directions of a block


class SetOfBlock(NamedTuple):
    """The m points of one set (a channel, say) in one block.

    group: the place of the set among all. at: the direction of the block that each point has; a slice where they are
    all directions in order, because NumPy then copies nothing. rows (m,): which points of the problem they are.
    root, target (m,): their root weights and targets, as Problem has them.
    """

    group: int
    at: Places | slice
    rows: Places
    root: Values
    target: Values


@dataclass(eq=False)
class DirectionBlock:
    """Distinct directions and the points at them.

    latest: the terms at the shape where they were computed last. Covariance and outliers pass over all blocks again at
    the shape where the search ended.
    """

    directions: Geometry
    sets: tuple[SetOfBlock, ...]
    latest: Terms | None = None


class LinearSet(NamedTuple):
    """The residual (m,) of one set of a block and its derivatives `slopes` (columns, m).

    places (columns,): which values of the vector the derivatives are by. The weights of other sets are not among them.
    modelled (m,): the BRDF. pull (m,): derivative of half the squared residual by the BRDF. weights (terms,): of every
    term in this set, held ones too.
    """

    terms: Terms
    points: SetOfBlock
    places: Places
    slopes: Values
    residual: Values
    modelled: Values
    pull: Values
    weights: Values


@dataclass(eq=False)
class BlockedProblem:
    """What a search and its covariance take of a problem of very many points, without a matrix of all of them.

    groups: for each weight by name, which of its values (sets,) each set has. evaluations: passes over all blocks.
    last: the latest vector, with residual, Jacobian and curvature there. A search asks for them one after the other,
    and one pass computes all.
    """

    problem: Problem
    blocks: tuple[DirectionBlock, ...]
    groups: dict[str, Places]
    evaluations: int = 0
    last: tuple[Values, tuple[Values, Values]] | None = None

    @functools.cached_property
    def terms(self) -> TermDerivatives:
        return TermDerivatives(self.problem)

    def residual(self, vector: Values) -> Values:
        """A vector (rows,) as long as the residual at a vector (values,) of weights and shape, in far fewer rows.

        A row belongs to no point, and rows at two vectors cannot be compared: only the length, and products with the
        Jacobian at the same vector, have a meaning.
        """
        return self._reduced(vector)[0][:, -1]

    def jacobian(self, vector: Values) -> Values:
        """The derivatives (rows, values) of `residual`."""
        return self._reduced(vector)[0][:, :-1]

    def curvature(self, vector: Values) -> Values:
        """What the second derivative of half the squared residual has (values, values) beside J'J."""
        return self._reduced(vector)[1]

    def _reduced(self, vector: Values) -> tuple[Values, Values]:
        """Jacobian and residual as one matrix (rows, values + 1), and the curvature."""
        if self.last is None or not np.array_equal(vector, self.last[0]):
            self.last = vector.copy(), self._computed(vector)
        return self.last[1]

    def _computed(self, vector: Values) -> tuple[Values, Values]:
        """What `_reduced` gives, by a pass over all blocks: the triangles of all sets stand below each other.

        Each set has a triangle of its own, with columns only for the values that the set depends on. One triangle for
        all sets would carry the columns of every set's weights through every reduction.
        """
        triangles: dict[int, Values] = {}
        places: dict[int, Places] = {}
        curvature = np.zeros((len(vector),) * 2)
        for products in self.each(vector, self._products):
            for group, place, triangle, second in products:
                above = triangles.get(group)
                triangles[group] = triangle if above is None else _triangle(np.concatenate([above, triangle]))
                places[group] = place
                curvature[np.ix_(place, place)] += second
        rows = []
        for group, triangle in triangles.items():
            wide = np.zeros((len(triangle), len(vector) + 1))
            wide[:, [*places[group], len(vector)]] = triangle
            rows.append(wide)
        stacked = np.concatenate(rows)
        # many sets that share most of their values make it tall; else one more reduction would save few rows
        return (_triangle(stacked) if len(stacked) > 4 * stacked.shape[1] else stacked), curvature

    def _products(self, linear: LinearSet) -> tuple[int, Places, Values, Values]:
        """What a set adds: its place, the places of its values, its triangle of [J r], and its part of the curvature.

        Each derivative of a term counts with the derivative of half the squared residual by the BRDF, `pull`, summed
        over the points.
        """
        triangle = _triangle(np.concatenate([linear.slopes, linear.residual[None]]).T)
        at, terms = linear.points.at, linear.terms
        first, second = (derivatives[:, at] @ linear.pull for derivatives in (terms.first, terms.second))
        free = self._columns[0]
        curvature = np.zeros((len(linear.places),) * 2)
        for (term, k, _), slope in zip(self.terms.pairs, first, strict=True):
            if term in free:
                curvature[free.index(term), len(free) + k] += slope
        for (a, b), bend in zip(self.terms.crosses, second, strict=True):
            k, m = len(free) + self.terms.pairs[a].parameter, len(free) + self.terms.pairs[b].parameter
            # halved on the diagonal, which adding the transpose doubles
            curvature[k, m] += linear.weights[self.terms.pairs[a].term] * bend / (1 + (a == b))
        curvature += curvature.T
        if self.problem.logarithmic:  # less r g df df'/f^2; slopes are g df/f, so that is slopes slopes' times r/g
            root = linear.points.root
            ratio = np.where(root > 0, linear.residual / np.where(root > 0, root, 1.0), 0.0)
            curvature -= (linear.slopes * ratio) @ linear.slopes.T
        return linear.points.group, linear.places, triangle, curvature

    def each(self, vector: Values, of: Callable[[LinearSet], Result]) -> Iterator[list[Result]]:
        """What the function `of` gives for every set, a list for each block.

        The order is fixed, so that sums over blocks round in the same way every time. On one thread: a second thread
        made fits slower, since what a block computes is short compared with the waits for the interpreter's lock.
        """
        self.evaluations += 1
        weights = self._weights(vector)
        shape = vector[self.problem.n_weights :]
        for block in self.blocks:
            yield [of(linear) for linear in self._linear(block, weights, shape)]

    def _weights(self, vector: Values) -> Values:
        """The weight of every term in every set (terms, sets), held ones too."""
        by_term, at = [], 0
        for entry in self.problem.entries:
            if not entry.is_weight:
                continue
            if entry.held is not None:
                by_term.append(np.asarray(entry.held)[self.groups[entry.name]])
                continue
            by_term.append(vector[at : at + entry.size][self.groups[entry.name]])
            at += entry.size
        return np.array(by_term)

    @functools.cached_property
    def _columns(self) -> tuple[list[int], list[Places]]:
        """The terms of free weights, and for every set the place of each of its values in the vector.

        The values of a set are one for each free weight, then the shape, which all sets share.
        """
        free, starts, at = [], [], 0
        for k, entry in enumerate(e for e in self.problem.entries if e.is_weight):
            if entry.held is None:
                free.append(k)
                starts.append(at + self.groups[entry.name])
                at += entry.size
        sets = len(next(iter(self.groups.values())))
        shape = at + np.arange(len(self.problem.free_shape))
        return free, [np.array([*(s[group] for s in starts), *shape], dtype=np.intp) for group in range(sets)]

    def _linear(self, block: DirectionBlock, weights: Values, shape: Values) -> Iterator[LinearSet]:
        """The residual of every set of a block, and its derivatives by the chain rule from those of the terms."""
        if block.latest is None or not np.array_equal(shape, block.latest.shape):
            block.latest = self.terms.at(block.directions, shape)
        terms = block.latest
        free, places = self._columns
        for points in block.sets:
            of_set = weights[:, points.group]
            here, first = terms.values[:, points.at], terms.first[:, points.at]
            columns = np.zeros((len(free) + len(self.problem.free_shape), here.shape[1]))
            columns[: len(free)] = here[free]
            for (term, k, _), slope in zip(self.terms.pairs, first, strict=True):
                columns[len(free) + k] += of_set[term] * slope
            brdf, factor = of_set @ here, points.root
            modelled = brdf
            if self.problem.logarithmic:
                least = np.finfo(float).tiny
                positive = modelled > least  # elsewhere the residual has the logarithm of `least`, which is constant
                factor = np.where(positive, factor / np.where(positive, modelled, 1.0), 0.0)
                modelled = np.log(np.maximum(modelled, least))
            columns *= factor
            residual = points.root * modelled - points.target
            yield LinearSet(terms, points, places[points.group], columns, residual, brdf, factor * residual, of_set)


# Problems are told apart by identity. A cached one can still be freed, because its blocks refer to it weakly too.
_BLOCKED: "weakref.WeakKeyDictionary[Problem, BlockedProblem | None]" = weakref.WeakKeyDictionary()


def in_blocks(problem: Problem) -> BlockedProblem | None:
    """The points of a problem in blocks, where they are more than MANY and the problem can be split so; else None.

    None also for more than MOST_VALUES values, which `objective.cells` serves.
    It can be split where nothing is smooth, no instrument or polariser is folded in, the loss is squared, each shape
    parameter has one value for all points, and each weight has one for all points or one for each set. The terms at a
    direction are then the same for all of its points, and a set has one weight for each term. The blocks of a problem
    are made once, and kept as long as the problem itself.
    """
    if len(problem.measured) <= MANY or len(problem.names) > MOST_VALUES:
        return None
    if problem not in _BLOCKED:
        _BLOCKED[problem] = _blocked(problem)
    return _BLOCKED[problem]


def _blocked(problem: Problem) -> BlockedProblem | None:
    """The blocks of a problem of any number of points; None where it cannot be split."""
    polarised = whole(problem.model).polarised and problem.acceptance.through_polarisers
    if problem.instrument or polarised or problem.loss != "squared" or len(problem.smoothed):
        return None
    by, group = problem.sets
    for entry in problem.entries:
        if entry.size > 1 and not (entry.is_weight and set(entry.by) <= set(by)):
            return None
    first = first_of(group)
    groups = {e.name: e.group[first] for e in problem.entries if e.is_weight}
    return BlockedProblem(weakref.proxy(problem), tuple(_blocks(problem, group, len(first))), groups)


def _blocks(problem: Problem, group: Places, sets: int) -> Iterator[DirectionBlock]:
    """The blocks of a problem whose points are in the sets `group` (points,).

    Where every set repeats one list of directions, as the channels of a file do, that list is taken as it is, and
    nothing needs sorting. Else equal directions are found by their angles.
    """
    points = problem.points
    columns = [points[a].values for a in DIRECTIONS if a in points.coords]
    if size := repeats(columns, group):
        first, place = np.arange(size), np.tile(np.arange(size), sets)
    else:
        first, place = distinct_rows(columns)
    # one sort by block, then set, then direction, after which each set of a block is a run
    order = np.argsort((place // SIZE * sets + group) * SIZE + place % SIZE, kind="stable")
    in_order = (place // SIZE * sets + group)[order]
    begins = np.flatnonzero(np.concatenate([[True], in_order[1:] != in_order[:-1]]))
    ends = np.append(begins[1:], len(order))
    by_block: dict[int, list[SetOfBlock]] = {}
    for begin, end in zip(begins, ends, strict=True):
        block, rows = int(in_order[begin]) // sets, order[begin:end]
        at: Any = place[rows] - block * SIZE
        size = min(SIZE, len(first) - block * SIZE)
        at = slice(None) if np.array_equal(at, np.arange(size)) else at
        by_block.setdefault(block, []).append(
            SetOfBlock(int(in_order[begin]) % sets, at, rows, problem.root_weights[rows], problem.target[rows])
        )
    for block in sorted(by_block):
        rows = first[block * SIZE : (block + 1) * SIZE]
        yield DirectionBlock(geometry(points.isel(direction=rows)), tuple(by_block[block]))


def _triangle(matrix: Values) -> Values:
    """The triangle R of a matrix = Q R; Q is never formed."""
    return np.asarray(np.linalg.qr(matrix, mode="r"))
