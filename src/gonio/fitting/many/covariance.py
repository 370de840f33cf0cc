"""Covariances of the values of each lane: those of `certainty.covariance`, many lanes at once.

With J the derivative of the modelled values by weights and shape, each row times the root of the point's weight, and
A = (J'J)^-1 J', every kind of covariance is A S A':

    robust     S = diag(r_k^2 / (1 - h_k)^2), with the leverage h_k = (J A)_kk (HC3, mackinnon1985)
    scaled     S = s^2 I, with s^2 = r'r / (points - values)
    absolute   S = diag(u_k^2), with u_k the stated uncertainty times the root weight of each point

It is computed as (J'J)^-1 (J'SJ) (J'J)^-1 from Gram matrices and sweeps, in columns of unit length, where a fit of one
scan takes the singular value decomposition of J. This squares the condition: columns that agree to 1e-7 of their length
are not determined here, in double precision, and to 1e-10 there.

Weights at a bound are not held: their columns are in J as the others are.

A cause of systematic uncertainty that shifts the residual by e moves the values by A e (`moved`), with the values at a
bound held, as in `certainty.covariance.systematic_shifts`.
"""

import functools

import jax
import jax.numpy as jnp
import numpy as np

from gonio.fitting.many import logarithms
from gonio.fitting.many.descent import State
from gonio.fitting.many.layout import Layout
from gonio.fitting.many.projection import (
    Columns,
    LaneArrays,
    basis,
    full,
    gram,
    in_cells,
    residual_of,
    shape_values,
    slopes,
    summed,
    times,
    weighted,
)
from gonio.fitting.many.sweep import sweep, unit_scaled
from gonio.fitting.objective.tangent import ALONE

Array = jax.Array


@functools.partial(jax.jit, static_argnames=("layout", "kind"))
def covariance(layout: Layout, lanes: LaneArrays, state: State, error: Array, kind: str) -> Array:
    """Covariance (n + d, n + d, lanes) of weights and shape, infinite where the data do not determine a value.

    Such a value has no covariance with others: zeros. Weights are over the scale of each lane's data, as in the state.
    kind: of COVARIANCES. error (cells, rows, lanes): the standard deviation of each residual, which `absolute` takes
    and the others do not look at.
    """
    size = layout.n + layout.d
    by_weight, by_shape, residual = _linearised(layout, lanes, (state.unit, state.weights))
    moved = [(tuple(layout.n + c for c in index), slope) for index, slope in by_shape]
    columns = [(index, full(lanes, column)) for index, column in (*by_weight, *moved)]
    inverse, length, undetermined = _inverse(gram(layout, columns, size))
    columns = [(index, column / in_cells(length, index)) for index, column in columns]
    leverage = _leverage(columns, inverse)
    if kind == "scaled":
        # Leverages add up to the number of values that the data determine. Points of no weight are none.
        freedom = (lanes.root > 0).sum(axis=(0, 1)) - leverage.sum(axis=(0, 1))
        undetermined = undetermined | (freedom < 1 - 1e-6)  # one is enough, but for the rounding of that sum
        spread = inverse * jnp.sum(residual**2, axis=(0, 1)) / jnp.where(freedom > 0, freedom, 1.0)
    else:
        # In single precision a leverage of 1 is known to some units of the last place alone.
        exact = leverage > min(ALONE, 1 - 64 * float(np.finfo(leverage.dtype).eps))
        if kind == "robust":
            error = jnp.where(exact, 0.0, residual / jnp.where(exact, 1.0, 1 - leverage))
            # Few lanes have such a point, so the products that trace it are computed only for blocks that do.
            undetermined = undetermined | jax.lax.cond(
                exact.any(),
                lambda: _dependent_on(layout, columns, inverse, exact),
                lambda: jnp.zeros_like(undetermined),
            )
        spread = _between(inverse, gram(layout, times(columns, error), size))
    spread = spread / length[:, None] / length[None, :]
    # A variance that rounding made negative is not known; "not at least zero" is true of NaN too.
    undetermined = undetermined | ~(jnp.diagonal(spread, axis1=0, axis2=1).T >= 0)
    masked = undetermined[:, None] | undetermined[None, :]
    infinite = jnp.where(np.eye(size, dtype=bool)[:, :, None], jnp.inf, 0.0)
    return jnp.where(masked, infinite, spread)


@functools.partial(jax.jit, static_argnames="layout")
def moved(layout: Layout, lanes: LaneArrays, point: tuple[Array, Array], error: Array, pinned: Array) -> Array:
    """By how much the values (n + d, lanes) follow an error of the targets; infinite for those that no data determine.

    point: coordinates of the shape (d, lanes), and weights over the scale of each lane's data (n, lanes). error (cells,
    rows, lanes): of the weighted values. pinned (n + d, lanes): values at a bound, which stay there.
    """
    size = layout.n + layout.d
    by_weight, by_shape, _ = _linearised(layout, lanes, point)
    at = [(tuple(layout.n + c for c in index), slope) for index, slope in by_shape]
    free = jnp.where(pinned, 0.0, 1.0).astype(error.dtype)
    columns = [(index, full(lanes, column) * in_cells(free, index)) for index, column in (*by_weight, *at)]
    inverse, length, undetermined = _inverse(gram(layout, columns, size))
    pull = summed(layout, times(columns, error), size) / length
    shift = jnp.einsum("ijl,jl->il", inverse, pull, precision="highest") / length
    return jnp.where(pinned, 0.0, jnp.where(undetermined, jnp.inf, shift))


def _linearised(layout: Layout, lanes: LaneArrays, point: tuple[Array, Array]) -> tuple[Columns, Columns, Array]:
    """Derivatives of what is compared, by the weights and by the shape, and the residual (cells, rows, lanes)."""
    unit, weights = point
    if layout.logarithmic:
        return logarithms.linearised(layout, lanes, unit, weights)
    shape = shape_values(unit, lanes.axes)
    at_shape = weighted(layout, lanes, basis(layout, lanes, shape))
    return at_shape.columns, slopes(layout, lanes, shape, weights), residual_of(at_shape, weights)


def _inverse(matrix: Array) -> tuple[Array, Array, Array]:
    """The inverse of a Gram matrix in units of its columns' lengths, these, and which values it does not determine.

    A column that depends on others is not swept, and its row then holds the factors by which they make it up. A value
    whose column takes part in that (by more than rounding, 1e-6) can be traded for it: it is not determined either.
    """
    size = len(matrix)
    scaled, length = unit_scaled(matrix)
    swept, used = sweep(scaled, size, jnp.ones(length.shape, dtype=bool))
    inverse = jnp.where(used[:, None] & used[None, :], -swept, 0.0)
    tied = jnp.abs(jnp.where(~used[:, None] & used[None, :], swept, 0.0)).max(axis=0) > 1e-6
    return inverse, length, ~used | tied


def _leverage(columns: Columns, inverse: Array) -> Array:
    """The leverage of each point (cells, rows, lanes): the share of its own value in what is fitted there, 0 to 1.

    Rounding can carry it out of that range, where 1 - leverage would change its sign: it is clipped.
    """
    total = jnp.zeros((), dtype=inverse.dtype)
    for k, (i, a) in enumerate(columns):
        across = a * inverse[np.array(i), np.array(i)][:, None]
        for j, b in columns[k + 1 :]:
            across = across + 2 * b * inverse[np.array(i), np.array(j)][:, None]  # twice: the inverse is symmetric
        total = total + a * across
    return jnp.clip(total, 0.0, 1.0)


def _dependent_on(layout: Layout, columns: Columns, inverse: Array, points: Array) -> Array:
    """Which values (n, lanes) depend on some points, by more than 1e-9 of their variance for equal errors."""
    of_points = _between(inverse, gram(layout, times(columns, points), len(inverse)))
    from_points, from_all = (jnp.diagonal(m, axis1=0, axis2=1).T for m in (of_points, inverse))
    return from_points > 1e-9 * from_all


def _between(inverse: Array, middle: Array) -> Array:
    """The product inverse middle inverse of every lane, in full precision on a GPU too."""
    return jnp.einsum("ijl,jkl,kml->iml", inverse, middle, inverse, precision="highest")
