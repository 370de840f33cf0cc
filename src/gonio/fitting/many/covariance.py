"""How sure the values of each lane are: the covariances of `fit.covariance`, many lanes at once."""

import functools

import jax
import jax.numpy as jnp
import numpy as np

from gonio.fitting.many.layout import Layout
from gonio.fitting.many.projection import (
    Columns,
    LaneArrays,
    State,
    basis,
    full,
    gram,
    in_cells,
    left,
    shape_values,
    slopes,
    times,
    weighted,
)
from gonio.fitting.many.sweep import sweep, unit_scaled

Array = jax.Array
ALONE = 1e-9  # 1 - leverage of a point that one value fits exactly, which says nothing about its error


@functools.partial(jax.jit, static_argnames=("layout", "kind"))
def covariance(layout: Layout, lanes: LaneArrays, state: State, error: Array, kind: str) -> Array:
    """Covariance (n + d, n + d, lanes) of weights and shape, infinite where the data do not determine a value.

    kind: of `fit.covariance`. error (cells, rows, lanes): the standard deviation of each residual, for `absolute`.
    """
    shape, size = shape_values(state.unit, lanes.axes), layout.n + layout.d
    point = weighted(layout, lanes, basis(layout, lanes, shape))
    moved = [(tuple(layout.n + c for c in of), column) for of, column in slopes(layout, lanes, shape, state.weights)]
    columns = [(of, full(lanes, column)) for of, column in (*point.columns, *moved)]
    inverse, length, blind = _inverse(gram(layout, columns, size))
    columns = [(of, column / in_cells(length, of)) for of, column in columns]
    residual = left(point, state.weights)
    leverage = _leverage(columns, inverse)
    if kind == "scaled":
        freedom = (lanes.root > 0).sum(axis=(0, 1)) - leverage.sum(axis=(0, 1))
        blind = blind | (freedom < 1 - 1e-6)
        found = inverse * jnp.sum(residual**2, axis=(0, 1)) / jnp.where(freedom > 0, freedom, 1.0)
    else:
        alone = leverage > 1 - ALONE
        if kind == "robust":
            error = jnp.where(alone, 0.0, residual / jnp.where(alone, 1.0, 1 - leverage))
            blind = blind | jax.lax.cond(
                alone.any(), lambda: _fitted_alone(layout, columns, inverse, alone), lambda: jnp.zeros_like(blind)
            )
        found = _between(inverse, gram(layout, times(columns, error), size))
    found = found / length[:, None] / length[None, :]
    blind = blind | ~(jnp.diagonal(found, axis1=0, axis2=1).T >= 0)  # rounding has eaten it
    unknown = blind[:, None] | blind[None, :]
    infinite = jnp.where(np.eye(size, dtype=bool)[:, :, None], jnp.inf, 0.0)
    return jnp.where(unknown, infinite, found)


def _inverse(matrix: Array) -> tuple[Array, Array, Array]:
    """The inverse of a Gram matrix in units of its columns' lengths, these, and which values it does not determine."""
    size = len(matrix)
    scaled, length = unit_scaled(matrix)
    swept, used = sweep(scaled, size, jnp.ones(length.shape, dtype=bool))
    inverse = jnp.where(used[:, None] & used[None, :], -swept, 0.0)
    tied = jnp.abs(jnp.where(~used[:, None] & used[None, :], swept, 0.0)).max(axis=0) > 1e-6
    return inverse, length, ~used | tied


def _leverage(columns: Columns, inverse: Array) -> Array:
    """The share of each point's own value in what is fitted there (cells, rows, lanes)."""
    total = jnp.zeros((), dtype=inverse.dtype)
    for at, (i, a) in enumerate(columns):
        across = a * inverse[np.array(i), np.array(i)][:, None]
        for j, b in columns[at + 1 :]:
            across = across + 2 * b * inverse[np.array(i), np.array(j)][:, None]
        total = total + a * across
    return jnp.clip(total, 0.0, 1.0)


def _fitted_alone(layout: Layout, columns: Columns, inverse: Array, alone: Array) -> Array:
    """Which values a point tells that is fitted exactly (n, lanes)."""
    fitted = _between(inverse, gram(layout, times(columns, alone), len(inverse)))
    own, whole = (jnp.diagonal(m, axis1=0, axis2=1).T for m in (fitted, inverse))
    return own > 1e-9 * whole


def _between(inverse: Array, middle: Array) -> Array:
    return jnp.einsum("ijl,jkl,kml->iml", inverse, middle, inverse, precision="highest")
