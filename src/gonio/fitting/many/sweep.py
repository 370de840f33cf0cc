"""Small dense systems of many lanes at once, by the sweep operator (beaton1964, goodnight1979).

Sweeping a symmetric matrix on column k exchanges the roles of x_k and b_k in b = G x. Of a Gram matrix it regresses the
other columns on column k, and what then stands in their block is the Gram matrix of their residuals. So one operation
inverts a matrix, solves a system, leaves out columns that depend on others, and projects columns out of a design.

Arrays are (n, n, lanes): every operation runs along the lanes, where LAPACK would take one system at a time. The price
is precision, because a Gram matrix has the square of the condition of its design. Columns are scaled to unit length
first, so that differing units at least do not add to it.
"""

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

Array = jax.Array
Pivoting = tuple[Array, Array, Array, Array, Array, Array]  # side, x, change, fewest, patience, count: see `bounded`


def unit_scaled(gram: Array) -> tuple[Array, Array]:
    """A Gram matrix with ones on its diagonal, and the lengths (n, lanes) of its columns; 1 for a column of zeros.

    A column of zeros keeps a zero on the diagonal, which no sweep uses as a pivot.
    """
    squared = jnp.diagonal(gram, axis1=0, axis2=1).T
    length = jnp.sqrt(jnp.where(squared > 0, squared, 1.0))
    return gram / length[:, None] / length[None, :], length


def bordered(matrix: Array, rhs: Array) -> Array:
    """The matrix with a right-hand side (n, lanes) as last row and column, which a sweep turns into the solution.

    After a sweep of the columns F the last column holds x_F = G_FF^-1 b_F, and for the others b - G_.F x_F: the inner
    product of each column that was not swept with the residual.
    """
    row = jnp.concatenate([rhs, jnp.zeros_like(rhs[:1])])[None]
    return jnp.concatenate([jnp.concatenate([matrix, rhs[:, None]], axis=1), row])


def least_pivot(dtype: Any) -> float:
    """The smallest pivot that is used, of a matrix with unit diagonal.

    A pivot is the squared sine of the angle between a column and the space of those swept before it. It is computed as
    one less a sum, with an error of some eps: a smaller pivot is mostly rounding, and the column counts as dependent.
    For double precision the angle is 1e-7.
    """
    return 64 * float(np.finfo(dtype).eps)


def sweep(matrix: Array, columns: int, use: Array) -> tuple[Array, Array]:
    """Sweep the first `columns` where `use` (columns, lanes): returns the swept matrix and which were swept.

    Of a symmetric [[G, M'], [M, H]] with unit diagonal: [[-G^-1, G^-1 M'], [M G^-1, H - M G^-1 M']]. The sign of the
    first block keeps the matrix symmetric. A column that depends on those before it is not swept.
    """
    n = matrix.shape[0]
    least, place = least_pivot(matrix.dtype), jnp.arange(n)

    def pivot_on(k: int, state: tuple[Array, Array]) -> tuple[Array, Array]:
        a, done = state
        pivot, column = a[k, k], a[k]
        usable = use[k] & (pivot > least)
        # Lanes that do not use the column compute along and are put back; 1.0 keeps them from dividing by zero.
        inverse = 1 / jnp.where(usable, pivot, 1.0)
        share = column * inverse
        is_k = (place == k)[:, None]
        swept = a - column[:, None] * share[None, :]
        swept = jnp.where(is_k[:, None], share[None, :], jnp.where(is_k[None, :], share[:, None], swept))
        swept = jnp.where(is_k[:, None] & is_k[None, :], -inverse, swept)
        return jnp.where(usable, swept, a), done.at[k].set(usable)

    return jax.lax.fori_loop(0, columns, pivot_on, (matrix, jnp.zeros(use.shape, dtype=bool)))


def bounded(gram: Array, rhs: Array, lower: Array, upper: Array, side: Array) -> tuple[Array, Array]:
    """The x (n, lanes) within bounds that minimises x'Gx - 2 b'x, and at which bound each is: -1, 0 (free) or 1.

    Block principal pivoting (portugal1994). With some values at a bound, the free ones are solved for. A free value
    beyond a bound is put there; a value at a bound is set free where the residual pulls it inwards. All such values
    change at once while there are fewer of them than ever before, and for three more rounds. Then only the last of them
    changes, which cannot cycle, until there are fewer.

    side: where to begin; the bounds of a nearby problem need few rounds. After 4 n + 8 rounds the x at hand is clipped.
    """
    g, length = unit_scaled(gram)
    b, low, high = rhs / length, lower * length, upper * length
    n = gram.shape[0]
    slack = 16 * float(np.finfo(gram.dtype).eps)
    # No value is ever at an infinite bound: a zero in its place keeps infinity out of the sums.
    at_low, at_high = jnp.where(jnp.isfinite(low), low, 0.0), jnp.where(jnp.isfinite(high), high, 0.0)

    def solved(side: Array) -> tuple[Array, Array]:
        """The x for some values at bounds, and how each has to change: -1 or 1 to that bound, 2 to be free, 0 not."""
        edge = jnp.where(side < 0, at_low, jnp.where(side > 0, at_high, 0.0))
        remaining = b - jnp.sum(g * edge[None], axis=1)
        free = side == 0
        swept, used = sweep(bordered(g, remaining), n, free)
        x = jnp.where(used, swept[:n, n], edge)
        # Without slack a value that lies on its bound up to rounding could change in every round.
        size = slack * (jnp.abs(b).max(axis=0) + jnp.abs(x).max(axis=0))
        pull = swept[:n, n]  # of the residual on a value that is not free
        beyond = jnp.where(side == 0, (used & (x > high + size)) * 1 - (used & (x < low - size)) * 1, 0)
        inwards = ((side < 0) & (pull > size)) | ((side > 0) & (pull < -size))
        return x, jnp.where(inwards, 2, beyond)

    def exchanged(state: Pivoting) -> Pivoting:
        side, _, change, fewest, patience, count = state
        changes = jnp.sum(change != 0, axis=0)
        fewer = changes < fewest
        patience = jnp.where(fewer, 3, patience - 1)
        x, change = solved(side := _moved(side, change, patience >= 0))
        return side, x, change, jnp.minimum(changes, fewest), patience, count + 1

    unsolved = jnp.full(rhs.shape, 3)  # moves nothing, but counts as a change, so that the first round takes place
    start = (
        side,
        jnp.zeros_like(rhs),
        unsolved,
        jnp.full(rhs.shape[1:], n + 1),
        jnp.full(rhs.shape[1:], 3),
        jnp.asarray(0),
    )
    going = lambda state: (state[2] != 0).any() & (state[5] < 4 * n + 8)  # noqa: E731
    side, x, *_ = jax.lax.while_loop(going, exchanged, start)
    inside = jnp.clip(x / length, lower, upper)
    # Scaling a bound by the length and back moves it by rounding: the bound itself is returned.
    return jnp.where(side < 0, lower, jnp.where(side > 0, upper, inside)), side


def _moved(side: Array, change: Array, all_at_once: Array) -> Array:
    """The bounds at which values are after a change: of all that change, or of the last of them alone."""
    order = jnp.arange(len(side))[:, None]
    last = jnp.max(jnp.where(change != 0, order, -1), axis=0)
    applied = jnp.where(all_at_once, change, jnp.where(order == last, change, 0))
    return jnp.where(applied == 2, 0, jnp.where(jnp.abs(applied) == 1, applied, side))
