"""Very many points by their distinct directions, in blocks that a processor's cache holds.

A file of several channels states each direction once a channel: what a model's terms are there is computed once. What a
search needs of the residual r and its Jacobian J at a vector of values is r'r, J'r and J'J alone. Reduced by QR block
after block (demmel2012), both have as many rows as there are sets times values, and exactly the same products: with
[J r] = Q R, the columns of the small triangle R have the lengths and angles of those of J and r.
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

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
Result = TypeVar("Result")

MANY = 200_000  # points in use from which a search takes them in blocks
SIZE = 2**16  # directions of a block


class SetOfBlock(NamedTuple):
    """The points of one set (a channel, say) in one block.

    group: the place of the set. at: which directions of the block the points have. rows: which points of the problem
    they are. root, target (m,): their root weights and targets.
    """

    group: int
    at: Places | slice
    rows: Places
    root: Values
    target: Values


@dataclass(eq=False)
class DirectionBlock:
    """Distinct directions and the points at them; it keeps the terms where they were computed last."""

    directions: Geometry
    sets: tuple[SetOfBlock, ...]
    kept: Terms | None = None


class LinearSet(NamedTuple):
    """The residual (m,) of one set of a block and its derivatives (columns, m) by the values at `places` of the vector.

    modelled (m,): the BRDF there. pull (m,): derivative of half the squared residual by it. weights: of every term.
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

    groups: for each weight by name, the place of its value among its own for every set.
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
        """As long as the whole residual at a vector of weights and shape, in few rows (rows,).

        The rows differ from one vector to another: only lengths, and products with the Jacobian at the same vector,
        mean something.
        """
        return self._reduced(vector)[0][:, -1]

    def jacobian(self, vector: Values) -> Values:
        """The derivatives (rows, values) of `residual`."""
        return self._reduced(vector)[0][:, :-1]

    def curvature(self, vector: Values) -> Values:
        """What the second derivative of half the squared residual has (values, values) beside J'J."""
        return self._reduced(vector)[1]

    def _reduced(self, vector: Values) -> tuple[Values, Values]:
        if self.last is None or not np.array_equal(vector, self.last[0]):
            self.last = vector.copy(), self._computed(vector)
        return self.last[1]

    def _computed(self, vector: Values) -> tuple[Values, Values]:
        """Jacobian and residual as one matrix, the triangles of all sets below each other, and the curvature."""
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
        whole = np.concatenate(rows)
        return (_triangle(whole) if len(whole) > 4 * whole.shape[1] else whole), curvature

    def _products(self, linear: LinearSet) -> tuple[int, Places, Values, Values]:
        """What a set adds: the triangle of its Jacobian and residual, and its part of the curvature."""
        triangle = _triangle(np.concatenate([linear.slopes, linear.residual[None]]).T)
        first, second = (some[:, linear.points.at] @ linear.pull for some in (linear.terms.first, linear.terms.second))
        free = self._columns[0]
        curvature = np.zeros((len(linear.places),) * 2)
        for (term, k, _), slope in zip(self.terms.pairs, first, strict=True):
            if term in free:
                curvature[free.index(term), len(free) + k] += slope
        for (a, b), bend in zip(self.terms.crosses, second, strict=True):
            k, m = len(free) + self.terms.pairs[a].parameter, len(free) + self.terms.pairs[b].parameter
            curvature[k, m] += linear.weights[self.terms.pairs[a].term] * bend / (1 + (a == b))
        curvature += curvature.T
        if self.problem.logarithmic:
            root = linear.points.root
            ratio = np.where(root > 0, linear.residual / np.where(root > 0, root, 1.0), 0.0)
            curvature -= (linear.slopes * ratio) @ linear.slopes.T
        return linear.points.group, linear.places, triangle, curvature

    def each(self, vector: Values, of: Callable[[LinearSet], Result]) -> Iterator[list[Result]]:
        """`of` every set, a block at a time and in their order.

        On one thread: a second made fits slower, since what a block computes is short beside the interpreter's lock.
        """
        self.evaluations += 1
        weights = self._weights(vector)
        shape = vector[self.problem.n_weights :]
        for block in self.blocks:
            yield [of(linear) for linear in self._linear(block, weights, shape)]

    def _weights(self, vector: Values) -> Values:
        """The weight of every term in every set (terms, sets)."""
        out, at = [], 0
        for entry in self.problem.entries:
            if not entry.is_weight:
                continue
            if entry.held is not None:
                out.append(np.asarray(entry.held)[self.groups[entry.name]])
                continue
            out.append(vector[at : at + entry.size][self.groups[entry.name]])
            at += entry.size
        return np.array(out)

    @functools.cached_property
    def _columns(self) -> tuple[list[int], list[Places]]:
        """The terms of free weights, and for every set the place of each value in the vector."""
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
        """The residual of every set of a block, and its derivatives."""
        if block.kept is None or not np.array_equal(shape, block.kept.shape):
            block.kept = self.terms.at(block.directions, shape)
        terms = block.kept
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
                seen = modelled > least  # below, the residual keeps the logarithm of this
                factor = np.where(seen, factor / np.where(seen, modelled, 1.0), 0.0)
                modelled = np.log(np.maximum(modelled, least))
            columns *= factor
            residual = points.root * modelled - points.target
            yield LinearSet(terms, points, places[points.group], columns, residual, brdf, factor * residual, of_set)


_BLOCKED: "weakref.WeakKeyDictionary[Problem, BlockedProblem | None]" = weakref.WeakKeyDictionary()


def in_blocks(problem: Problem) -> BlockedProblem | None:
    """The points of a problem in blocks, where they are more than MANY and the problem can be split so; else None.

    It can where a shape parameter has one value for all points and a weight one for each set or for all, nothing is
    smooth, no instrument is folded in and the loss is squared. The blocks of a problem are made once, and kept as long
    as it is.
    """
    if len(problem.measured) <= MANY:
        return None
    if problem not in _BLOCKED:
        _BLOCKED[problem] = _blocked(problem)
    return _BLOCKED[problem]


def _blocked(problem: Problem) -> BlockedProblem | None:
    if problem.instrument or problem.loss != "squared" or len(problem.smoothed):
        return None
    by, group = problem.sets
    for entry in problem.entries:
        if entry.size > 1 and not (entry.is_weight and set(entry.by) <= set(by)):
            return None
    first = first_of(group)
    groups = {e.name: e.group[first] for e in problem.entries if e.is_weight}
    return BlockedProblem(weakref.proxy(problem), tuple(_blocks(problem, group, len(first))), groups)


def _blocks(problem: Problem, group: Places, sets: int) -> Iterator[DirectionBlock]:
    points = problem.points
    columns = [points[a].values for a in DIRECTIONS if a in points.coords]
    if size := repeats(columns, group):
        first, place = np.arange(size), np.tile(np.arange(size), sets)
    else:
        first, place = distinct_rows(columns)
    order = np.argsort((place // SIZE * sets + group) * SIZE + place % SIZE, kind="stable")
    in_order = (place // SIZE * sets + group)[order]
    begins = np.flatnonzero(np.concatenate([[True], in_order[1:] != in_order[:-1]]))
    ends = np.append(begins[1:], len(order))
    several: dict[int, list[SetOfBlock]] = {}
    for begin, end in zip(begins, ends, strict=True):
        block, rows = int(in_order[begin]) // sets, order[begin:end]
        at: Any = place[rows] - block * SIZE
        size = min(SIZE, len(first) - block * SIZE)
        at = slice(None) if np.array_equal(at, np.arange(size)) else at
        several.setdefault(block, []).append(
            SetOfBlock(int(in_order[begin]) % sets, at, rows, problem.root_weights[rows], problem.target[rows])
        )
    for block in sorted(several):
        some = first[block * SIZE : (block + 1) * SIZE]
        yield DirectionBlock(geometry(points.isel(direction=some)), tuple(several[block]))


def _triangle(matrix: Values) -> Values:
    """The triangle R of a matrix = Q R."""
    return np.asarray(np.linalg.qr(matrix, mode="r"))
