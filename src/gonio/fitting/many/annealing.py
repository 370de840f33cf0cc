"""Appendix A's annealing of many lanes and chains side by side: what `Anneal` does for one scan (guo2023)."""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp

from gonio.fitting.many.layout import Layout
from gonio.fitting.many.projection import (
    LaneArrays,
    State,
    basis,
    begin,
    full,
    left,
    shape_values,
    summed,
    times,
    weighted,
)

Array = jax.Array


class Schedule(NamedTuple):
    """The numbers of an `Anneal`: temperatures in units of E, the rate of cooling, and the width of a perturbation.

    tolerance: a lane ends when the best E of every chain has changed by less over `patience` iterations, which is
    looked at once in so many.
    """

    initial: Array
    final: Array
    rate: Array
    step: Array
    tolerance: Array
    patience: Array


class _Walk(NamedTuple):
    """Chains (lanes * chains): coordinates (n + d, ..), E, the best of each, and E when it was last looked at."""

    unit: Array
    cost: Array
    best: Array
    best_cost: Array
    looked: Array
    done: Array
    temperature: Array
    iteration: Array


@functools.partial(jax.jit, static_argnames=("layout", "chains"))
def annealed(
    layout: Layout, lanes: LaneArrays, keys: Array, schedule: Schedule, iterations: Array, chains: int
) -> State:
    """The best that any chain of each lane met, as the end of a search; `keys` are one a lane."""
    chained = LaneArrays(*lanes[:3], *(_chained(lanes, a, chains) for a in lanes[3:]))
    size, count = layout.n + layout.d, keys.shape[0] * chains

    def normal(key: Array, k: Array) -> Array:
        return jax.random.normal(jax.random.fold_in(key, k), (size * chains,))

    def uniform(key: Array, k: Array) -> Array:
        return jax.random.uniform(jax.random.fold_in(key, k), ((size + 1) * chains,))

    draw, chance = (jax.vmap(one, (0, None)) for one in (normal, uniform))

    def one(walk: _Walk) -> _Walk:
        width = schedule.step * jnp.sqrt(walk.temperature / schedule.initial)
        steps = _by_chain(draw(keys, 2 * walk.iteration), size, chains).astype(walk.unit.dtype)
        luck = jnp.log(_by_chain(chance(keys, 2 * walk.iteration + 1), size + 1, chains)[0]).astype(walk.unit.dtype)
        trial = jnp.clip(walk.unit + width * steps, 0.0, 1.0)
        cost = _objective(layout, chained, trial)[0]
        accepted = (walk.cost - cost > walk.temperature * luck) & ~walk.done
        unit, cost = jnp.where(accepted, trial, walk.unit), jnp.where(accepted, cost, walk.cost)
        better = cost < walk.best_cost
        best, best_cost = jnp.where(better, unit, walk.best), jnp.where(better, cost, walk.best_cost)
        look = (walk.iteration % schedule.patience) == 0
        small = (walk.looked - best_cost < schedule.tolerance).reshape(-1, chains).all(axis=1)
        done = walk.done | (look & jnp.repeat(small, chains))
        looked = jnp.where(look, best_cost, walk.looked)
        return _Walk(unit, cost, best, best_cost, looked, done, walk.temperature * schedule.rate, walk.iteration + 1)

    def going(walk: _Walk) -> Array:
        return (walk.iteration < iterations) & (walk.temperature >= schedule.final) & ~walk.done.all()

    unit = _by_chain(chance(keys, jnp.asarray(1)), size + 1, chains)[:size].astype(lanes.target.dtype)
    cost = _objective(layout, chained, unit)[0]
    nothing = jnp.zeros(count, dtype=bool)
    start = _Walk(unit, cost, unit, cost, cost + jnp.inf, nothing, schedule.initial, jnp.asarray(1))
    end = jax.lax.while_loop(going, one, start)
    return _best_of(layout, lanes, end, schedule, chains)


def _best_of(layout: Layout, lanes: LaneArrays, end: _Walk, schedule: Schedule, chains: int) -> State:
    """The best chain of each lane as the end of a search: a weight at its bound is said to be there."""
    count = lanes.target.shape[-1]
    best = jnp.argmin(end.best_cost.reshape(-1, chains), axis=1) + chains * jnp.arange(count)
    at = end.best[:, best]
    cost, weights = _objective(layout, lanes, at)
    low, high = at[: layout.n] <= 0, (at[: layout.n] >= 1) & jnp.isfinite(lanes.upper)
    cooled = (end.temperature < schedule.final) | end.done[best]
    return begin(layout, lanes, at[layout.n :])._replace(
        weights=weights,
        side=high.astype(jnp.int32) - low.astype(jnp.int32),
        cost=cost,
        done=cooled,
        steps=jnp.full(cost.shape, chains, dtype=jnp.int32) * end.iteration.astype(jnp.int32),
    )


def _chained(lanes: LaneArrays, values: Array, chains: int) -> Array:
    """What is each lane's own, once for every chain."""
    own = values.shape[-1] == lanes.target.shape[-1]
    return jnp.repeat(values, chains, axis=-1) if own else values


def _by_chain(drawn: Array, size: int, chains: int) -> Array:
    """Random numbers of lanes (lanes, size * chains) as (size, lanes * chains)."""
    return jnp.moveaxis(drawn.reshape(-1, size, chains), 1, 0).reshape(size, -1)


def _objective(layout: Layout, lanes: LaneArrays, unit: Array) -> tuple[Array, Array]:
    """E and the weights at coordinates (n + d, lanes), as `Anneal` has them.

    A weight without an upper bound reaches to where its term alone fits best: no optimum of such terms lies above.
    """
    point = weighted(layout, lanes, basis(layout, lanes, shape_values(unit[layout.n :], lanes.axes)))
    squared = summed(layout, [(of, full(lanes, column**2)) for of, column in point.columns], layout.n)
    alone = summed(layout, times(point.columns, point.target), layout.n) / jnp.where(squared > 0, squared, 1.0)
    reach = jnp.where(jnp.isfinite(lanes.upper), lanes.upper, jnp.maximum(alone, lanes.lower))
    weights = lanes.lower + unit[: layout.n] * (reach - lanes.lower)
    return jnp.sum(left(point, weights) ** 2, axis=(0, 1)), weights
