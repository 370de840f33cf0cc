"""Variable projection of many lanes at once, compiled by JAX: the mathematics of `fit_many`.

Points are (cells, rows, lanes) and small matrices (n, n, lanes), so that the last, contiguous axis is the one along
which nothing has to be added up. Shape parameters are searched in the coordinates 0 to 1 of `fit.axes`; for each shape
the weights are exact (golub1973), and the derivative leaves out how they turn (kaufman1975).
"""

import functools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from gonio.fitting.many.layout import FOLD, Layout
from gonio.fitting.many.sweep import bordered, bounded, sweep, unit_scaled
from gonio.geometry import Geometry

Array = jax.Array
Columns = list[tuple[tuple[int, ...], Array]]  # the column in every cell, and the values at the points


class LaneArrays(NamedTuple):
    """What a search sees: common numbers, then each lane's.

    geometry: components (cells, rows, 1). held: by name (cells, 1, 1). axes: the maps of the shape's coordinates.
    lower, upper: of the weights (n, lanes), in units of each lane's own. root: roots of weights of the points (cells,
    rows, 1 or lanes), 0 for what does not count. target: values times root. fixed: in what the values of held weights
    are multiplied (lanes). Targets are scaled so that their squared sum is 1: the squared residual is E (eq 11).
    """

    geometry: tuple[Array, ...]
    held: dict[str, Array]
    axes: tuple[Array, ...]
    lower: Array
    upper: Array
    root: Array
    target: Array
    fixed: Array


class State(NamedTuple):
    """Where each lane is: coordinates `unit` (d, lanes), weights (n, lanes) and what is known there.

    side: which weights are at a bound. cost: E. hessian (d, d, lanes), pull (d, lanes): of half of E, along the
    coordinates. damping, growth: of the next step. left: what a step can still win, relative to E. done: no more steps.
    """

    unit: Array
    weights: Array
    side: Array
    cost: Array
    hessian: Array
    pull: Array
    damping: Array
    growth: Array
    left: Array
    done: Array
    steps: Array


def shape_values(unit: Array, axes: tuple[Array, ...]) -> Array:
    """Shape parameters (d, lanes) at coordinates 0 to 1, as `Axes.values` has them."""
    lower, upper, offset, log_ratio, by_ratio = axes
    ratio = (lower + offset) * jnp.exp(unit * log_ratio) - offset
    return jnp.clip(jnp.where(by_ratio, ratio, lower + unit * (upper - lower)), lower, upper)


def _slope_of_axes(unit: Array, axes: tuple[Array, ...]) -> Array:
    """Derivative of the shape parameters (d, lanes) by their coordinates."""
    lower, upper, offset, log_ratio, by_ratio = axes
    ratio = (lower + offset) * jnp.exp(unit * log_ratio) * log_ratio
    return jnp.where(by_ratio, ratio, upper - lower + 0 * unit)


def _at_points(layout: Layout, lanes: LaneArrays, shape: Array) -> dict[str, Array]:
    """Every shape parameter (cells, 1, lanes), held ones (cells, 1, 1)."""
    values = {name: lanes.held[name] for name in layout.held if name in layout.model.shape}
    return values | {name: in_cells(shape, columns) for name, columns in layout.shape}


def in_cells(columns: Array, of: tuple[int, ...]) -> Array:
    """The value of each cell (cells, 1, lanes) of values in columns; one cell stands for all that are the same."""
    if len(set(of)) == 1:
        return columns[of[0]][None, None]
    return columns[np.array(of)][:, None]


def basis(layout: Layout, lanes: LaneArrays, shape: Array) -> dict[str, Array]:
    return layout.model.basis(Geometry(*lanes.geometry), _at_points(layout, lanes, shape))


def selection(rows: list[tuple[int, ...]], cells: int, n: int, dtype: Any) -> np.ndarray:
    """A matrix (n, entries * cells) of zeros and ones that adds sums over cells up into those over columns."""
    matrix = np.zeros((n, len(rows) * cells), dtype=dtype)
    for k, columns in enumerate(rows):
        matrix[list(columns), k * cells + np.arange(cells)] += 1
    return matrix


def _assembled(
    layout: Layout, pairs: list[tuple[tuple[int, ...], tuple[int, ...], Array]], shape: tuple[int, int]
) -> Array:
    """A matrix (rows, columns, lanes) from products of points, each summed where its row and column meet."""
    sums = jnp.stack([_folded(layout, product) for _, _, product in pairs]).sum(axis=2)
    flat = [tuple(r * shape[1] + c for r, c in zip(i, j, strict=True)) for i, j, _ in pairs]
    chosen = selection(flat, layout.cells, shape[0] * shape[1], sums.dtype)
    whole = jnp.matmul(chosen, sums.reshape(-1, sums.shape[-1]), precision="highest")
    return whole.reshape(*shape, -1)


def _folded(layout: Layout, product: Array) -> Array:
    """Rows of each cell added up as far as vector instructions do it: (cells, rows / FOLD, lanes)."""
    if layout.rows % FOLD:
        return product
    parts = product.reshape(layout.cells, FOLD, layout.rows // FOLD, -1)
    return sum((parts[:, k] for k in range(1, FOLD)), start=parts[:, 0])


def gram(layout: Layout, columns: Columns, size: int) -> Array:
    """The Gram matrix (size, size, lanes) of columns that are given by term and cell."""
    pairs = [(i, j, a * b) for at, (i, a) in enumerate(columns) for j, b in columns[at:]]
    upper = _assembled(layout, pairs, (size, size))
    share = 1 - 0.5 * np.eye(size)  # columns of different terms meet in one half only, a column with itself in both
    return (upper + jnp.swapaxes(upper, 0, 1)) * share[:, :, None].astype(upper.dtype)


def summed(layout: Layout, columns: Columns, size: int) -> Array:
    """Sums (size, lanes) over the points of every column."""
    zero = (0,) * layout.cells
    return _assembled(layout, [(of, zero, column) for of, column in columns], (size, 1))[:, 0]


def times(columns: Columns, factor: Array) -> Columns:
    """Every column times a factor of the points."""
    return [(of, column * factor) for of, column in columns]


def full(lanes: LaneArrays, array: Array) -> Array:
    return jnp.broadcast_to(array, lanes.target.shape)


class _Point(NamedTuple):
    """The weighted terms and what the free weights have to explain, at one shape."""

    columns: Columns
    target: Array


def weighted(layout: Layout, lanes: LaneArrays, basis: dict[str, Array]) -> _Point:
    columns = [(of, lanes.root * basis[name]) for name, of in layout.weights]
    target = lanes.target
    for name in layout.held:
        if name in layout.model.terms:
            target = target - lanes.root * lanes.held[name] * basis[name] * lanes.fixed
    return _Point(columns, target)


def slopes(layout: Layout, lanes: LaneArrays, shape: Array, weights: Array) -> Columns:
    """Derivative of the weighted BRDF by each shape parameter (cells, rows, lanes), weights standing still."""
    free = dict(layout.weights)
    values = _at_points(layout, lanes, shape)
    out = []
    for name, of in layout.shape:
        terms = layout.depends[name]

        def brdf(value: Array, name: str = name, terms: tuple[str, ...] = terms) -> Array:
            basis = layout.model.basis(Geometry(*lanes.geometry), values | {name: value})
            total = jnp.zeros((), dtype=lanes.target.dtype)
            for term in terms:
                weight = in_cells(weights, free[term]) if term in free else lanes.held[term] * lanes.fixed
                total = total + weight * basis[term]
            return total

        _, slope = jax.jvp(brdf, (values[name],), (jnp.ones_like(values[name]),))
        out.append((of, lanes.root * slope))
    return out


class _Found(NamedTuple):
    weights: Array
    side: Array
    cost: Array
    hessian: Array
    pull: Array


def _evaluate(layout: Layout, lanes: LaneArrays, unit: Array, side: Array) -> _Found:
    """Exact weights at a shape, E, and what a Gauss-Newton step needs."""
    shape = shape_values(unit, lanes.axes)
    point = weighted(layout, lanes, basis(layout, lanes, shape))
    own_gram, weights, side, residual = _projected(layout, lanes, point, side)
    cost = jnp.sum(residual**2, axis=(0, 1))
    if not layout.d:
        empty = jnp.zeros((0, *cost.shape), dtype=cost.dtype)
        return _Found(weights, side, cost, empty[None][:0], empty)
    along = _slope_of_axes(unit, lanes.axes)
    moved = [(of, column * in_cells(along, of)) for of, column in slopes(layout, lanes, shape, weights)]
    own = gram(layout, moved, layout.d)
    pull = summed(layout, times(moved, residual), layout.d)
    if not layout.n:
        return _Found(weights, side, cost, own, pull)
    cross = _assembled(layout, [(i, j, a * b) for i, a in point.columns for j, b in moved], (layout.n, layout.d))
    whole = jnp.concatenate(
        [jnp.concatenate([own_gram, cross], 1), jnp.concatenate([jnp.swapaxes(cross, 0, 1), own], 1)]
    )
    scaled, length = unit_scaled(whole)
    swept, _ = sweep(scaled, layout.n, side == 0)
    back = length[layout.n :]
    hessian = swept[layout.n :, layout.n :] * back[:, None] * back[None, :]
    return _Found(weights, side, cost, hessian, pull)


def _projected(layout: Layout, lanes: LaneArrays, point: _Point, side: Array) -> tuple[Array, Array, Array, Array]:
    """The Gram matrix of the terms, the exact weights, their sides, and what they leave."""
    if not layout.n:
        lanes_in = lanes.target.shape[-1]
        empty = jnp.zeros((0, lanes_in), dtype=lanes.target.dtype)
        return empty[None][:0], empty, side, point.target
    matrix = gram(layout, [(of, full(lanes, c)) for of, c in point.columns], layout.n)
    rhs = summed(layout, times(point.columns, point.target), layout.n)
    weights, side = bounded(matrix, rhs, lanes.lower, lanes.upper, side)
    residual = left(point, weights)
    if residual.dtype == jnp.float64:
        return matrix, weights, side, residual
    # Once more for what rounding left: normal equations square the condition of the design.
    free = side == 0
    more = summed(layout, times(point.columns, residual), layout.n)
    scaled, length = unit_scaled(matrix)
    swept, used = sweep(bordered(scaled, more / length), layout.n, free)
    weights = jnp.clip(weights + jnp.where(used, swept[: layout.n, layout.n], 0.0) / length, lanes.lower, lanes.upper)
    return matrix, weights, side, left(point, weights)


def left(point: _Point, weights: Array) -> Array:
    residual = point.target
    for of, column in point.columns:
        residual = residual - in_cells(weights, of) * column
    return residual


def _step(hessian: Array, pull: Array, unit: Array, damping: Array) -> tuple[Array, Array]:
    """A damped step (d, lanes) from `unit`, and what it would win if the model were straight and had no bounds."""
    d = len(pull)
    if not d:
        return pull, jnp.zeros_like(damping)
    free = ~(((unit <= 0) & (pull < 0)) | ((unit >= 1) & (pull > 0)))
    scaled, length = unit_scaled(hessian)
    damped = scaled + damping * jnp.eye(d, dtype=pull.dtype)[:, :, None]
    rhs = jnp.where(free, pull / length, 0.0)
    swept, used = sweep(bordered(damped, rhs), d, free)
    step = jnp.where(used, swept[:d, d], 0.0)
    won = 2 * jnp.sum(rhs * step, axis=0) - jnp.sum(step[:, None] * scaled * step[None, :], axis=(0, 1))
    return step / length, won


@functools.partial(jax.jit, static_argnames=("layout",))
def begin(layout: Layout, lanes: LaneArrays, unit: Array) -> State:
    """The state before the first step, which stays at the given coordinates (d, lanes) and finds out what is there."""
    d, count = unit.shape
    ones = jnp.ones(count, dtype=lanes.target.dtype)
    zeros = jnp.zeros((layout.n, count), dtype=ones.dtype)
    unknown = _Found(zeros, zeros.astype(jnp.int32), jnp.inf * ones, jnp.zeros((d, d, count), ones.dtype), 0 * unit)
    return State(unit, *unknown, 1e-3 * ones, 2 * ones, ones, ones == 0, jnp.full(count, -1, dtype=jnp.int32))


def settled(dtype: Any) -> float:
    """What a step may still win, relative to E, where a search ends: its square root is the offset of bates1981."""
    return max(1e-10, 4 * float(np.finfo(dtype).eps))


@functools.partial(jax.jit, static_argnames=("layout",))
def advance(layout: Layout, lanes: LaneArrays, state: State, steps: Array) -> State:
    """Up to so many steps more of every lane that is not done (levenberg1944, marquardt1963, nielsen1999)."""
    eps = float(np.finfo(lanes.target.dtype).eps)
    enough, exact = settled(lanes.target.dtype), (64 * eps) ** 2

    def one(carry: tuple[State, Array]) -> tuple[State, Array]:
        now, count = carry
        step, won = _step(now.hessian, now.pull, now.unit, now.damping)
        unit = jnp.clip(now.unit + step, 0.0, 1.0)
        tried = _evaluate(layout, lanes, unit, now.side)
        better = (tried.cost < now.cost) & ~now.done
        gain = (now.cost - tried.cost) / jnp.where(won > 0, won, 1.0)
        easier = now.damping * jnp.maximum(1 / 9, 1 - (2 * gain - 1) ** 3)
        damping = jnp.where(better, jnp.maximum(easier, 1e-12), now.damping * now.growth)
        growth = jnp.where(better, 2.0, 2 * now.growth)
        kept = _Found(*(jnp.where(better, new, old) for new, old in zip(tried, now[1:6], strict=True)))
        unit = jnp.where(better, unit, now.unit)
        _, left = _step(kept.hessian, kept.pull, unit, jnp.zeros_like(damping))
        left = left / jnp.where(kept.cost > 0, kept.cost, 1.0)
        moved = jnp.abs(jnp.where(better, unit - now.unit, step)).max(axis=0, initial=0.0)
        small = (moved < 16 * eps) & jnp.isfinite(now.cost)
        rounded = ~better & (won < 4 * eps * now.cost)  # a better point could not be told from this one
        done = now.done | (left <= enough) | (kept.cost <= exact) | small | rounded
        steps = now.steps + 1
        reached = State(unit, *kept, damping, growth, left, done, steps)
        return State(*(jnp.where(now.done, old, new) for new, old in zip(reached, now, strict=True))), count + 1

    def going(carry: tuple[State, Array]) -> Array:
        return ~carry[0].done.all() & (carry[1] < steps)

    return jax.lax.while_loop(going, one, (state, jnp.zeros((), dtype=steps.dtype)))[0]


@jax.jit
def better(one: State, other: State) -> State:
    """Of two searches of the same lanes, the lower minimum of each."""
    lower = other.cost < one.cost
    return State(*(jnp.where(lower, new, old) for new, old in zip(other, one, strict=True)))
