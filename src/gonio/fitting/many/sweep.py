"""Small dense systems of many lanes at once, by the sweep operator (beaton1964, goodnight1979).

Arrays are (n, n, lanes): every operation runs along the lanes, where LAPACK would take one system at a time. Sweeping a
column of a Gram matrix regresses the others on it: what is left is what the swept columns do not explain.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

Array = jax.Array
Pivoting = tuple[Array, Array, Array, Array, Array, Array]


def unit_scaled(gram: Array) -> tuple[Array, Array]:
    """A Gram matrix with ones on its diagonal, and the lengths (n, lanes) of its columns; 1 for a column of zeros."""
    squared = jnp.diagonal(gram, axis1=0, axis2=1).T
    length = jnp.sqrt(jnp.where(squared > 0, squared, 1.0))
    return gram / length[:, None] / length[None, :], length


def bordered(matrix: Array, rhs: Array) -> Array:
    """The matrix with a right-hand side (n, lanes) as last row and column, which a sweep turns into the solution."""
    row = jnp.concatenate([rhs, jnp.zeros_like(rhs[:1])])[None]
    return jnp.concatenate([jnp.concatenate([matrix, rhs[:, None]], axis=1), row])


def alike(dtype: Any) -> float:
    """Squared sine of an angle between columns below which they are one: rounding has eaten what tells them apart."""
    return 64 * float(np.finfo(dtype).eps)


def sweep(matrix: Array, columns: int, use: Array) -> tuple[Array, Array]:
    """Sweep the first `columns` where `use` (columns, lanes): returns the swept matrix and which were swept.

    Of a symmetric [[G, M'], [M, H]] with unit diagonal: [[-G^-1, G^-1 M'], [M G^-1, H - M G^-1 M']]. A column that is
    explained by those before it is left out.
    """
    n = matrix.shape[0]
    least, place = alike(matrix.dtype), jnp.arange(n)

    def one(k: int, state: tuple[Array, Array]) -> tuple[Array, Array]:
        a, done = state
        pivot, column = a[k, k], a[k]
        usable = use[k] & (pivot > least)
        inverse = 1 / jnp.where(usable, pivot, 1.0)
        share = column * inverse
        here = (place == k)[:, None]
        swept = a - column[:, None] * share[None, :]
        swept = jnp.where(here[:, None], share[None, :], jnp.where(here[None, :], share[:, None], swept))
        swept = jnp.where(here[:, None] & here[None, :], -inverse, swept)
        return jnp.where(usable, swept, a), done.at[k].set(usable)

    return jax.lax.fori_loop(0, columns, one, (matrix, jnp.zeros(use.shape, dtype=bool)))


def bounded(gram: Array, rhs: Array, lower: Array, upper: Array, side: Array) -> tuple[Array, Array]:
    """The x (n, lanes) within bounds of least x'Gx - 2 b'x, and at which bound each is: -1, 0 (free) or 1.

    Block principal pivoting (portugal1994): values that leave their bounds are put there, those that a bound holds back
    are set free, all at once while that brings fewer of them, then one at a time. `side`: where to begin.
    """
    g, length = unit_scaled(gram)
    b, low, high = rhs / length, lower * length, upper * length
    n = gram.shape[0]
    slack = 16 * float(np.finfo(gram.dtype).eps)
    at_low, at_high = jnp.where(jnp.isfinite(low), low, 0.0), jnp.where(jnp.isfinite(high), high, 0.0)

    def solved(side: Array) -> tuple[Array, Array]:
        edge = jnp.where(side < 0, at_low, jnp.where(side > 0, at_high, 0.0))
        left = b - jnp.sum(g * edge[None], axis=1)
        free = side == 0
        swept, used = sweep(bordered(g, left), n, free)
        x = jnp.where(used, swept[:n, n], edge)
        size = slack * (jnp.abs(b).max(axis=0) + jnp.abs(x).max(axis=0))
        pull = swept[:n, n]  # of the residual on a value that is not free
        wrong = jnp.where(side == 0, (used & (x > high + size)) * 1 - (used & (x < low - size)) * 1, 0)
        back = ((side < 0) & (pull > size)) | ((side > 0) & (pull < -size))
        return x, jnp.where(back, 2, wrong)  # 2: set free

    def one(state: Pivoting) -> Pivoting:
        side, _, change, fewest, patience, count = state
        changes = jnp.sum(change != 0, axis=0)
        fewer = changes < fewest
        patience = jnp.where(fewer, 3, patience - 1)
        x, change = solved(side := _moved(side, change, patience >= 0))
        return side, x, change, jnp.minimum(changes, fewest), patience, count + 1

    none = jnp.full(rhs.shape, 3)  # changes nothing, and has to be looked at
    start = (
        side,
        jnp.zeros_like(rhs),
        none,
        jnp.full(rhs.shape[1:], n + 1),
        jnp.full(rhs.shape[1:], 3),
        jnp.asarray(0),
    )
    going = lambda state: (state[2] != 0).any() & (state[5] < 4 * n + 8)  # noqa: E731
    side, x, *_ = jax.lax.while_loop(going, one, start)
    inside = jnp.clip(x / length, lower, upper)
    return jnp.where(side < 0, lower, jnp.where(side > 0, upper, inside)), side  # a bound is met to the last bit


def _moved(side: Array, change: Array, all_at_once: Array) -> Array:
    """The bounds at which values are after a change: of all that change, or of the last of them alone."""
    order = jnp.arange(len(side))[:, None]
    last = jnp.max(jnp.where(change != 0, order, -1), axis=0)
    taken = jnp.where(all_at_once, change, jnp.where(order == last, change, 0))
    return jnp.where(taken == 2, 0, jnp.where(jnp.abs(taken) == 1, taken, side))
