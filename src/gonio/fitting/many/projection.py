"""Variable projection of many lanes at once, compiled by JAX: the mathematics of `fit_many`.

For shape parameters u, let A(u) be the terms at the points, each times the root of the point's weight, and y the
measured values times the same roots, scaled so that y'y = 1. The weights w(u) within bounds that minimise |y - A w|^2
are exact, and only u is searched (golub1973), in the coordinates 0 to 1 of `objective.axes`. With the residual
r = y - A w and S = (dA/du) w, a Gauss-Newton step for E = r'r (guo2023, eq 11) uses

    pull = S'r,    hessian = S'S - S'A (A'A)^-1 A'S,

with the columns in A of the weights that are at no bound. The hessian leaves out how w changes through the residual
(kaufman1975), so it needs no second derivatives. Steps are damped (levenberg1944, marquardt1963, nielsen1999).

Points are (cells, rows, lanes) and small matrices (n, n, lanes): sums run over the other axes, and every operation,
those on small matrices included, runs along the last, contiguous one. Where to start is chosen in `starts`.
"""

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
    """The numbers of a search: the first three are common to all lanes, the others have a last axis of lanes.

    Targets are scaled so that their squared sum is 1: the squared residual is E (eq 11).
    """

    geometry: tuple[Array, ...]  # components (cells, rows, 1)
    held: dict[str, Array]  # held values by name, (cells, 1, 1)
    axes: tuple[Array, ...]  # `Axes.maps` of the shape's coordinates, each (d, 1)
    lower: Array  # bounds of the weights (n, lanes), over the scale of each lane's data
    upper: Array
    root: Array  # roots of the weights of points (cells, rows, 1 or lanes); 0 for padding and gaps
    target: Array  # measured values times root
    fixed: Array  # one over the scale of each lane's data (lanes,), by which held weights are multiplied


def shape_values(unit: Array, axes: tuple[Array, ...]) -> Array:
    """Shape parameters (d, lanes) at coordinates 0 to 1, as `Axes.values` has them."""
    lower, upper, offset, log_ratio, by_ratio = axes
    ratio = (lower + offset) * jnp.exp(unit * log_ratio) - offset
    return jnp.clip(jnp.where(by_ratio, ratio, lower + unit * (upper - lower)), lower, upper)


def slope_of_axes(unit: Array, axes: tuple[Array, ...]) -> Array:
    """Derivative of the shape parameters (d, lanes) by their coordinates."""
    lower, upper, offset, log_ratio, by_ratio = axes
    ratio = (lower + offset) * jnp.exp(unit * log_ratio) * log_ratio
    return jnp.where(by_ratio, ratio, upper - lower + 0 * unit)


def _at_points(layout: Layout, lanes: LaneArrays, shape: Array) -> dict[str, Array]:
    """Every shape parameter (cells, 1, lanes), held ones (cells, 1, 1)."""
    values = {name: lanes.held[name] for name in layout.held if name in layout.model.shape}
    return values | {name: in_cells(shape, index) for name, index in layout.shape}


def in_cells(columns: Array, index: tuple[int, ...]) -> Array:
    """The value of each cell (cells, 1, lanes) of values in columns; (1, 1, lanes) where one value serves all."""
    if len(set(index)) == 1:
        return columns[index[0]][None, None]
    return columns[np.array(index)][:, None]


def basis(layout: Layout, lanes: LaneArrays, shape: Array) -> dict[str, Array]:
    """The terms of the model at the points, by name."""
    return layout.model.basis(Geometry(*lanes.geometry), _at_points(layout, lanes, shape))


def selection(rows: list[tuple[int, ...]], cells: int, n: int, dtype: Any) -> np.ndarray:
    """A matrix (n, entries * cells) of zeros and ones that adds sums over cells up into those over columns."""
    matrix = np.zeros((n, len(rows) * cells), dtype=dtype)
    for k, columns in enumerate(rows):
        matrix[list(columns), k * cells + np.arange(cells)] += 1
    return matrix


def assembled(
    layout: Layout, pairs: list[tuple[tuple[int, ...], tuple[int, ...], Array]], shape: tuple[int, int]
) -> Array:
    """A matrix (rows, columns, lanes) from products of points, each summed where its row and column meet."""
    sums = jnp.stack([_folded(layout, product) for _, _, product in pairs]).sum(axis=2)
    flat = [tuple(r * shape[1] + c for r, c in zip(i, j, strict=True)) for i, j, _ in pairs]
    chosen = selection(flat, layout.cells, shape[0] * shape[1], sums.dtype)
    # By default JAX lets a GPU round the factors of such a product to TF32, about three digits.
    product = jnp.matmul(chosen, sums.reshape(-1, sums.shape[-1]), precision="highest")
    return product.reshape(*shape, -1)


def _folded(layout: Layout, product: Array) -> Array:
    """Rows of each cell added up as far as vector instructions do it: (cells, rows / FOLD, lanes)."""
    if layout.rows % FOLD:
        return product
    parts = product.reshape(layout.cells, FOLD, layout.rows // FOLD, -1)
    return sum((parts[:, k] for k in range(1, FOLD)), start=parts[:, 0])


def gram(layout: Layout, columns: Columns, size: int) -> Array:
    """The Gram matrix (size, size, lanes) of columns that are given by term and cell."""
    pairs = [(i, j, a * b) for k, (i, a) in enumerate(columns) for j, b in columns[k:]]
    upper = assembled(layout, pairs, (size, size))
    # Each pair of terms is summed on one side of the diagonal. The transpose fills the other, and doubles the diagonal.
    share = 1 - 0.5 * np.eye(size)
    return (upper + jnp.swapaxes(upper, 0, 1)) * share[:, :, None].astype(upper.dtype)


def summed(layout: Layout, columns: Columns, size: int) -> Array:
    """Sums (size, lanes) over the points of every column."""
    zero = (0,) * layout.cells
    return assembled(layout, [(index, zero, column) for index, column in columns], (size, 1))[:, 0]


def times(columns: Columns, factor: Array) -> Columns:
    """Every column times a factor of the points."""
    return [(index, column * factor) for index, column in columns]


def full(lanes: LaneArrays, array: Array) -> Array:
    """Values of points for every lane, where all lanes have the same: columns have to be of one shape to be stacked."""
    return jnp.broadcast_to(array, lanes.target.shape)


class _Point(NamedTuple):
    """The weighted terms and what the free weights have to explain, at one shape."""

    columns: Columns
    target: Array


def weighted(layout: Layout, lanes: LaneArrays, basis: dict[str, Array]) -> _Point:
    """The linear least-squares problem of the free weights; the part of held weights goes off the target."""
    columns = [(index, lanes.root * basis[name]) for name, index in layout.weights]
    target = lanes.target
    for name in layout.held:
        if name in layout.model.terms:
            target = target - lanes.root * lanes.held[name] * basis[name] * lanes.fixed
    return _Point(columns, target)


def slopes(layout: Layout, lanes: LaneArrays, shape: Array, weights: Array) -> Columns:
    """Derivative of the weighted BRDF by each shape parameter (cells, rows, lanes), at constant weights.

    A point depends on the value of its own cell alone, so that one directional derivative along (1, 1, ..) holds the
    derivatives by the values of all cells.
    """
    free = dict(layout.weights)
    values = _at_points(layout, lanes, shape)
    out = []
    for name, index in layout.shape:
        terms = layout.depends[name]

        def brdf(value: Array, name: str = name, terms: tuple[str, ...] = terms) -> Array:
            basis = layout.model.basis(Geometry(*lanes.geometry), values | {name: value})
            total = jnp.zeros((), dtype=lanes.target.dtype)
            for term in terms:
                weight = in_cells(weights, free[term]) if term in free else lanes.held[term] * lanes.fixed
                total = total + weight * basis[term]
            return total

        _, slope = jax.jvp(brdf, (values[name],), (jnp.ones_like(values[name]),))
        out.append((index, lanes.root * slope))
    return out


class Evaluation(NamedTuple):
    """What is known at a shape: fields of a `descent.State`, in its order."""

    weights: Array
    side: Array
    cost: Array
    hessian: Array
    pull: Array


def evaluate(layout: Layout, lanes: LaneArrays, unit: Array, side: Array) -> Evaluation:
    """Exact weights at a shape, E, and what a Gauss-Newton step needs."""
    shape = shape_values(unit, lanes.axes)
    point = weighted(layout, lanes, basis(layout, lanes, shape))
    terms_gram, weights, side, residual = projected(layout, lanes, point, side)
    cost = jnp.sum(residual**2, axis=(0, 1))
    if not layout.d:
        empty = jnp.zeros((0, *cost.shape), dtype=cost.dtype)
        return Evaluation(weights, side, cost, empty[None][:0], empty)
    along = slope_of_axes(unit, lanes.axes)
    moved = [(index, column * in_cells(along, index)) for index, column in slopes(layout, lanes, shape, weights)]
    slopes_gram = gram(layout, moved, layout.d)
    pull = summed(layout, times(moved, residual), layout.d)
    if not layout.n:
        return Evaluation(weights, side, cost, slopes_gram, pull)
    cross = assembled(layout, [(i, j, a * b) for i, a in point.columns for j, b in moved], (layout.n, layout.d))
    joint = jnp.concatenate(
        [jnp.concatenate([terms_gram, cross], 1), jnp.concatenate([jnp.swapaxes(cross, 0, 1), slopes_gram], 1)]
    )
    # Sweeping the free weights leaves S'S - S'A (A'A)^-1 A'S in the block of the slopes. The pull needs no such step:
    # at exact weights the residual is orthogonal to the columns of the free ones.
    scaled, length = unit_scaled(joint)
    swept, _ = sweep(scaled, layout.n, side == 0)
    slope_length = length[layout.n :]
    hessian = swept[layout.n :, layout.n :] * slope_length[:, None] * slope_length[None, :]
    return Evaluation(weights, side, cost, hessian, pull)


def projected(layout: Layout, lanes: LaneArrays, point: _Point, side: Array) -> tuple[Array, Array, Array, Array]:
    """The Gram matrix of the terms, the exact weights, their sides, and the residual."""
    if not layout.n:
        count = lanes.target.shape[-1]
        empty = jnp.zeros((0, count), dtype=lanes.target.dtype)
        return empty[None][:0], empty, side, point.target
    matrix = gram(layout, [(index, full(lanes, c)) for index, c in point.columns], layout.n)
    rhs = summed(layout, times(point.columns, point.target), layout.n)
    weights, side = bounded(matrix, rhs, lanes.lower, lanes.upper, side)
    residual = residual_of(point, weights)
    if residual.dtype == jnp.float64:
        return matrix, weights, side, residual
    # Normal equations square the condition of the design, which single precision does not bear: the residual is fitted
    # once more, and the correction added (iterative refinement).
    free = side == 0
    remaining = summed(layout, times(point.columns, residual), layout.n)
    scaled, length = unit_scaled(matrix)
    swept, used = sweep(bordered(scaled, remaining / length), layout.n, free)
    weights = jnp.clip(weights + jnp.where(used, swept[: layout.n, layout.n], 0.0) / length, lanes.lower, lanes.upper)
    return matrix, weights, side, residual_of(point, weights)


def residual_of(point: _Point, weights: Array) -> Array:
    """The residual (cells, rows, lanes), measured less modelled."""
    residual = point.target
    for index, column in point.columns:
        residual = residual - in_cells(weights, index) * column
    return residual
