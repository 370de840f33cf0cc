"""Where the search of each lane starts: the best of shapes that are tried for all lanes at once.

All lanes share their directions, so the terms at a shape are computed once. With T the terms at the points, g the
weights of the points and y the measured values of a lane, E at weights x is, but for a constant, x'Gx - 2 b'x with
G = T'gT and b = T'gy. Both are sums over points of something that depends on the shape times something that depends on
the lane: products of matrices, (shapes, points) by (points, lanes).

Weights are nearly exact: a few rounds of coordinate descent within their bounds. That ranks shapes well enough, and the
searches that follow compute exact weights themselves. Nothing here has to be exact, so part of the points and single
precision do.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np

from gonio.fitting.many import logarithms
from gonio.fitting.many.layout import Layout
from gonio.fitting.many.projection import Columns, LaneArrays, basis, selection, shape_values
from gonio.fitting.many.sweep import unit_scaled

Array = jax.Array
ROUNDS = 4  # of coordinate descent: enough to rank shapes
NARROW = jnp.float32  # precision of what only ranks shapes, once every term is scaled
POINTS = 256  # of a scan that take part: more do not rank shapes better


@functools.partial(jax.jit, static_argnames=("layout", "grid", "starts"))
def starts_of(layout: Layout, lanes: LaneArrays, points: Array, grid: tuple[int, ...], starts: int) -> Array:
    """The coordinates (starts, d, lanes) of the most promising of `points` (d, tried), best first.

    grid: the shape in which the points lie. Its local minima come first, because two neighbours mostly lead to one
    minimum. Empty where the points lie in no grid: then the best ones are taken, wherever they lie.
    """
    costs = _costs(layout, _thinned(layout, logarithms.relative(lanes) if layout.logarithmic else lanes), points)
    costs = jnp.where(jnp.isnan(costs), jnp.inf, costs)
    if grid:
        # Costs are E - 1, from -1 to 0 where all weights may be zero. So 2 puts the other points behind every local
        # minimum, in their own order, for lanes that have fewer minima than starts.
        costs = jnp.where(_is_local_minimum(costs.reshape(*grid, -1)).reshape(costs.shape), costs, costs + 2)
    chosen = []
    for _ in range(starts):  # a sort of all would take longer than all else here
        best = jnp.argmin(costs, axis=0)
        chosen.append(points[:, best])
        costs = jnp.where(jnp.arange(len(costs))[:, None] == best, jnp.inf, costs)
    return jnp.stack(chosen)


def _thinned(layout: Layout, lanes: LaneArrays) -> LaneArrays:
    """Every so many points of each cell, about POINTS in all."""
    stride = -(-layout.cells * layout.rows // POINTS)

    def thin(values: Array) -> Array:
        return values[:, ::stride] if values.shape[1] == layout.rows else values

    return lanes._replace(geometry=tuple(map(thin, lanes.geometry)), root=thin(lanes.root), target=thin(lanes.target))


def _costs(layout: Layout, lanes: LaneArrays, points: Array) -> Array:
    """E, but for a constant of each lane, of every shape tried (tried, lanes)."""
    terms = basis(layout, lanes, shape_values(points, lanes.axes))
    tried, count = points.shape[1], lanes.target.shape[-1]
    shape = (layout.cells, lanes.target.shape[1], tried)
    columns = [(index, jnp.broadcast_to(terms[name], shape)) for name, index in layout.weights]
    # The part of held weights is one more column, whose weight has both bounds at the lane's `fixed`.
    held = [n for n in layout.held if n in layout.model.terms]
    if held:
        total = sum((lanes.held[n] * terms[n] for n in held), start=jnp.zeros(shape, dtype=points.dtype))
        columns.append(((layout.n,) * layout.cells, total))
    size = layout.n + bool(held)
    # A term can be many decades away from one, and its square out of the range of single precision. So each term is
    # divided by its highest value at a shape, and the bounds of its weight are multiplied by it.
    heights = [jnp.abs(column).max(axis=(0, 1)) for _, column in columns]
    heights = [jnp.where(height > 0, height, 1.0) for height in heights]
    columns = [(index, (c / height).astype(NARROW)) for (index, c), height in zip(columns, heights, strict=True)]
    column_height = jnp.stack([heights[k] for k in _term_of(columns, size)])[:, :, None]
    bounds = [jnp.broadcast_to(b[:, None], (layout.n, tried, count)) for b in (lanes.lower, lanes.upper)]
    if held:
        fixed = jnp.broadcast_to(lanes.fixed, (1, tried, count))
        bounds = [jnp.concatenate([b, fixed]) for b in bounds]
    lower, upper = ((b * column_height).astype(NARROW) for b in bounds)
    # Columns are not weighted here: the weights of points go with the lane, so that columns serve all lanes. Where
    # they are the same in all lanes, `squared` has one lane, and the Gram matrices are computed once.
    root, target = lanes.root.astype(NARROW), lanes.target.astype(NARROW)
    squared, measured = root**2, root * target
    rhs = _summed(layout, [(index, column, measured) for index, column in columns], size, tried)
    pairs = [(i, j, a * b) for k, (i, a) in enumerate(columns) for j, b in columns[k:]]
    flat = [(tuple(r * size + c for r, c in zip(i, j, strict=True)), product, squared) for i, j, product in pairs]
    half = _summed(layout, flat, size * size, tried).reshape(size, size, tried, -1)
    gram = (half + jnp.swapaxes(half, 0, 1)) * (1 - 0.5 * np.eye(size, dtype=half.dtype))[:, :, None, None]
    return _descended(gram, rhs, lower, upper)


def _term_of(columns: Columns, size: int) -> list[int]:
    """Which term, counted in `columns`, each of `size` columns of a design belongs to."""
    terms = [0] * size
    for k, (index, _) in enumerate(columns):
        for column in index:
            terms[column] = k
    return terms


def _summed(layout: Layout, columns: list[tuple[tuple[int, ...], Array, Array]], size: int, tried: int) -> Array:
    """Sums over the points of every column times what each lane has there (size, tried, lanes)."""
    sums = jnp.stack([jnp.einsum("crs,crl->csl", column, lane, precision="highest") for _, column, lane in columns])
    chosen = selection([index for index, _, _ in columns], layout.cells, size, sums.dtype)
    return jnp.matmul(chosen, sums.reshape(chosen.shape[1], -1), precision="highest").reshape(size, tried, -1)


def _descended(gram: Array, rhs: Array, lower: Array, upper: Array) -> Array:
    """The value of x'Gx - 2 b'x (tried, lanes) after some rounds of coordinate descent within bounds.

    A round sets each value in turn to its optimum for the others, clipped to its bounds. It starts from zero, or from
    the bound nearest to it, and never raises the value.
    """
    n = len(rhs)
    scaled, length = unit_scaled(gram.reshape(n, n, -1))
    scaled, length = scaled.reshape(gram.shape), length.reshape(n, *gram.shape[2:])
    b, low, high = rhs / length, lower * length, upper * length

    def pull(k: int, x: tuple[Array, ...]) -> Array:
        """The right-hand side of one value less the parts of the others: its optimum, as the diagonal is one."""
        out = b[k]
        for j in range(n):
            if j != k:
                out = out - scaled[k, j] * x[j]
        return out

    def descend(_: int, x: tuple[Array, ...]) -> tuple[Array, ...]:
        for k in range(n):
            x = (*x[:k], jnp.clip(pull(k, x), low[k], high[k]), *x[k + 1 :])
        return x

    x = jax.lax.fori_loop(0, ROUNDS, descend, tuple(jnp.clip(jnp.zeros_like(b), low, high)))
    return sum((x[k] * (x[k] - pull(k, x) - b[k]) for k in range(n)), start=jnp.zeros_like(x[0]))


def _is_local_minimum(costs: Array) -> Array:
    """Which points of a grid (.., lanes) are no higher than any neighbour, along axes and diagonals."""
    lowest, dims = jnp.ones(costs.shape, dtype=bool), costs.ndim - 1
    # Infinity around the grid: a point at its border is compared with the neighbours that it has.
    padded = jnp.pad(costs, [(1, 1)] * dims + [(0, 0)], constant_values=jnp.inf)
    for shift in np.ndindex(*(3,) * dims):
        neighbour = padded[tuple(slice(s, s + n) for s, n in zip(shift, costs.shape, strict=False))]
        lowest &= costs <= neighbour
    return lowest
