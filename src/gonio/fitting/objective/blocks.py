"""Very many points by their distinct directions, in blocks that a processor's cache holds.

A file of several channels states each direction once a channel: what a model's terms are there is computed once. What a
search needs of the residual r and its Jacobian J at a vector of values is r'r, J'r and J'J alone. Reduced by QR block
after block (demmel2012), both have as many rows as there are sets times values, and exactly the same products.
"""

import functools
import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
import numpy.typing as npt

from gonio.fitting.search.descent import CENTRAL, derivative
from gonio.geometry import Geometry
from gonio.measured.dataset import DIRECTIONS, geometry
from gonio.measured.distinct import distinct_rows, first_of, repeats
from gonio.model import Model, declarations

if TYPE_CHECKING:
    from gonio.fitting.objective.problem import Problem

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
Found = TypeVar("Found")

SIZE = 2**16  # directions of a block
STEP = CENTRAL  # of a parameter's size: central differences are then good to some 1e-10, which moves nothing that shows
SMALLEST = 1e-3  # size of a parameter that is zero


class Sheet(NamedTuple):
    """The points of one set (a channel, say) in one block: which directions of the block, and which points they are."""

    group: int
    at: Places | slice
    rows: Places
    root: Values
    target: Values


@dataclass(eq=False)
class Block:
    """Distinct directions and the points at them; it keeps the terms where they were computed last."""

    directions: Geometry
    sheets: tuple[Sheet, ...]
    kept: "Terms | None" = None


class Terms(NamedTuple):
    """Every term of a block (terms, m) at one shape, and derivatives of terms in the order of `moved` and `bent`."""

    shape: Values
    values: Values
    slopes: Values
    bends: Values


class Linear(NamedTuple):
    """The residual of a sheet (m,) and its derivatives (columns, m) by the values at `places` of the vector.

    modelled: the BRDF there (m,). pull: derivative of half the squared residual by it. weights: of every term.
    """

    terms: Terms
    sheet: Sheet
    places: Places
    slopes: Values
    residual: Values
    modelled: Values
    pull: Values
    weights: Values


@dataclass(eq=False)
class Bulk:
    """What a search and its covariance take of a problem of very many points, without a matrix of all of them.

    groups: of each weight, its value's place among its own for every set.
    """

    problem: "Problem"
    blocks: tuple[Block, ...]
    groups: dict[str, Places]
    evaluations: int = 0
    last: tuple[Values, tuple[Values, Values]] | None = None

    @functools.cached_property
    def moved(self) -> tuple[tuple[int, int, Model], ...]:
        """Which term (by place) changes with which free shape parameter, and the model of that term alone."""
        model, names = self.problem.model, [entry.name for entry in self.problem.free_shape]
        return tuple(
            (k, names.index(name), replace(model, terms={weight: term}))
            for k, (weight, term) in enumerate(model.terms.items())
            for name in declarations(term)
            if name in names
        )

    @functools.cached_property
    def bent(self) -> tuple[tuple[int, int], ...]:
        """Pairs of places in `moved`, of two parameters of one term or of one with itself."""
        pairs = itertools.combinations_with_replacement(range(len(self.moved)), 2)
        return tuple((a, b) for a, b in pairs if self.moved[a][0] == self.moved[b][0])

    def residual(self, vector: Values) -> Values:
        """As long as the whole residual of a vector of weights and shape, in few rows that differ from one to another.

        Only lengths and products with the Jacobian at the same vector mean something.
        """
        return self._reduced(vector)[0][:, -1]

    def jacobian(self, vector: Values) -> Values:
        """The derivatives of `residual` (rows, values)."""
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
        for found in self.each(vector, self._products):
            for group, place, triangle, bend in found:
                above = triangles.get(group)
                triangles[group] = triangle if above is None else _r(np.concatenate([above, triangle]))
                places[group] = place
                curvature[np.ix_(place, place)] += bend
        rows = []
        for group, triangle in triangles.items():
            wide = np.zeros((len(triangle), len(vector) + 1))
            wide[:, [*places[group], len(vector)]] = triangle
            rows.append(wide)
        whole = np.concatenate(rows)
        return (_r(whole) if len(whole) > 4 * whole.shape[1] else whole), curvature

    def _products(self, linear: Linear) -> tuple[int, Places, Values, Values]:
        """What a sheet adds: the triangle of its Jacobian and residual, and its curvature."""
        triangle = _r(np.concatenate([linear.slopes, linear.residual[None]]).T)
        terms = linear.terms
        slopes, bends = (some[:, linear.sheet.at] @ linear.pull for some in (terms.slopes, terms.bends))
        free = self._columns[0]
        bend = np.zeros((len(linear.places),) * 2)
        for (term, k, _), slope in zip(self.moved, slopes, strict=True):
            if term in free:
                bend[free.index(term), len(free) + k] += slope
        for (a, b), second in zip(self.bent, bends, strict=True):
            k, m = len(free) + self.moved[a][1], len(free) + self.moved[b][1]
            bend[k, m] += linear.weights[self.moved[a][0]] * second / (1 + (a == b))
        bend += bend.T
        if self.problem.logarithmic:
            root = linear.sheet.root
            ratio = np.where(root > 0, linear.residual / np.where(root > 0, root, 1.0), 0.0)
            bend -= (linear.slopes * ratio) @ linear.slopes.T
        return linear.sheet.group, linear.places, triangle, bend

    def each(self, vector: Values, of: Callable[[Linear], Found]) -> Iterator[list[Found]]:
        """`of` every sheet, a block at a time and in their order.

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

    def _linear(self, block: Block, weights: Values, shape: Values) -> Iterator[Linear]:
        if block.kept is None or not np.array_equal(shape, block.kept.shape):
            block.kept = self._terms(block.directions, shape)
        terms = block.kept
        free, places = self._columns
        problem = self.problem
        for sheet in block.sheets:
            own = weights[:, sheet.group]
            here, moved = terms.values[:, sheet.at], terms.slopes[:, sheet.at]
            columns = np.zeros((len(free) + len(problem.free_shape), here.shape[1]))
            columns[: len(free)] = here[free]
            for (term, k, _), slope in zip(self.moved, moved, strict=True):
                columns[len(free) + k] += own[term] * slope
            brdf, factor = own @ here, sheet.root
            modelled = brdf
            if problem.logarithmic:
                least = np.finfo(float).tiny
                seen = modelled > least  # below, the residual keeps the logarithm of this
                factor = np.where(seen, factor / np.where(seen, modelled, 1.0), 0.0)
                modelled = np.log(np.maximum(modelled, least))
            columns *= factor
            residual = sheet.root * modelled - sheet.target
            yield Linear(terms, sheet, places[sheet.group], columns, residual, brdf, factor * residual, own)

    def _terms(self, directions: Geometry, shape: Values) -> Terms:
        """The terms at some directions, and how they change with the shape parameters that move them.

        First ones by central differences, at a bound by `derivative`; second ones are only to speed the search.
        """
        terms, n = _values(self.problem.model, directions, self._named(shape)), self.problem.n_weights
        lower, upper, steps = self.problem.lower[n:], self.problem.upper[n:], STEP * np.maximum(np.abs(shape), SMALLEST)

        def at(model: Model, *ks: int, times: float = 1.0) -> Values:
            moved = shape.copy()
            moved[list(ks)] += times * steps[list(ks)]
            return _values(model, directions, self._named(moved))[0]

        slopes, bends = (np.zeros((len(some), terms.shape[1])) for some in (self.moved, self.bent))
        ahead: dict[int, Values] = {}
        for a, (term, k, model) in enumerate(self.moved):
            if shape[k] - steps[k] < lower[k] or shape[k] + steps[k] > upper[k]:
                near = shape[k : k + 1], lower[k], upper[k]
                along = functools.partial(self._along, model, directions, shape, k)
                slopes[a] = derivative(along, *near, scale=SMALLEST)[:, 0]
                continue
            ahead[a], behind = at(model, k), at(model, k, times=-1)
            slopes[a] = (ahead[a] - behind) / (2 * steps[k])
            bends[self.bent.index((a, a))] = (ahead[a] - 2 * terms[term] + behind) / steps[k] ** 2
        for place, (a, b) in enumerate(self.bent):
            if a != b and a in ahead and b in ahead:
                term, k, model = self.moved[a]
                both = at(model, k, self.moved[b][1])
                area = steps[k] * steps[self.moved[b][1]]
                bends[place] = (both - ahead[a] - ahead[b] + terms[term]) / area
        return Terms(shape.copy(), terms, slopes, bends)

    def _along(self, model: Model, directions: Geometry, shape: Values, k: int, value: Values) -> Values:
        moved = shape.copy()
        moved[k] = value[0]
        return _values(model, directions, self._named(moved))[0]

    def _named(self, shape: Values) -> dict[str, float]:
        """All shape parameters by name."""
        out, at = {}, 0
        for entry in self.problem.entries:
            if entry.is_weight:
                continue
            if entry.held is not None:
                out[entry.name] = entry.held[0]
                continue
            out[entry.name] = float(shape[at])
            at += 1
        return out


def bulk(problem: "Problem") -> Bulk | None:
    """The points of a problem in blocks; None where a value is told by more than whole sets tell, or errors couple.

    That is: a shape parameter has one value for all points, a weight one for each set or for all, nothing is smooth, no
    instrument is folded in and the loss is squared.
    """
    if problem.instrument or problem.loss != "squared" or len(problem.smoothed):
        return None
    by, group = problem.sets
    for entry in problem.entries:
        if entry.size > 1 and not (entry.is_weight and set(entry.by) <= set(by)):
            return None
    first = first_of(group)
    groups = {e.name: e.group[first] for e in problem.entries if e.is_weight}
    return Bulk(problem, tuple(_blocks(problem, group, len(first))), groups)


def _blocks(problem: "Problem", group: Places, sets: int) -> Iterator[Block]:
    points = problem.points
    columns = [points[a].values for a in DIRECTIONS if a in points.coords]
    if size := repeats(columns, group):
        first, place = np.arange(size), np.tile(np.arange(size), sets)
    else:
        first, place = distinct_rows(columns)
    order = np.argsort((place // SIZE * sets + group) * SIZE + place % SIZE, kind="stable")
    sheet = (place // SIZE * sets + group)[order]
    begins = np.flatnonzero(np.concatenate([[True], sheet[1:] != sheet[:-1]]))
    ends = np.append(begins[1:], len(order))
    several: dict[int, list[Sheet]] = {}
    for begin, end in zip(begins, ends, strict=True):
        block, rows = int(sheet[begin]) // sets, order[begin:end]
        at: Any = place[rows] - block * SIZE
        size = min(SIZE, len(first) - block * SIZE)
        at = slice(None) if np.array_equal(at, np.arange(size)) else at
        several.setdefault(block, []).append(
            Sheet(int(sheet[begin]) % sets, at, rows, problem.root_weights[rows], problem.target[rows])
        )
    for block in sorted(several):
        some = first[block * SIZE : (block + 1) * SIZE]
        yield Block(geometry(points.isel(direction=some)), tuple(several[block]))


def _values(model: Model, directions: Geometry, shape: dict[str, float]) -> Values:
    found = model.basis(directions, {name: shape[name] for name in model.shape})
    return np.array([np.broadcast_to(value, directions.z_i.shape) for value in found.values()], dtype=float)


def _r(matrix: Values) -> Values:
    return np.asarray(np.linalg.qr(matrix, mode="r"))
