"""Simulated annealing of many lanes and chains side by side: what `Anneal` does for one scan (guo2023, appendix A).

Each chain is a point in coordinates 0 to 1 of weights and shape. In every iteration a normal perturbation of it is
tried. A change of E from E0 to E1 is accepted with probability min(1, exp(-(E1 - E0)/T)), Metropolis' rule, and the
temperature T falls by a constant factor (kirkpatrick1983). The width of a perturbation falls with the root of T. The
best point that any chain of a lane has met is the result; no local search follows.

Random numbers are functions of the seed, the lane's place in the stack and the iteration, not a stream that lanes take
turns in. So they do not depend on the block that a lane is in. They are not those of `Anneal`, whose chains NumPy
draws: the same seed gives other chains there.

Chains are the last axis of every array, those of a lane next to each other: chain c of lane k is at k * chains + c.
"""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp

from gonio.fitting.many import logarithms
from gonio.fitting.many.descent import State, begin
from gonio.fitting.many.layout import Layout
from gonio.fitting.many.projection import (
    LaneArrays,
    basis,
    full,
    residual_of,
    shape_values,
    summed,
    times,
    weighted,
)

Array = jax.Array


class Schedule(NamedTuple):
    """The numbers of an `Anneal`, as arrays without axes.

    They are arguments of the compiled search, so that another schedule needs no other compilation.
    """

    initial: Array  # temperatures, in units of E
    final: Array
    rate: Array  # by which the temperature is multiplied after each iteration
    step: Array  # standard deviation of a perturbation at the initial temperature, in coordinates 0 to 1
    tolerance: Array  # a lane ends when the best E of every chain has fallen by less since the last look
    patience: Array  # iterations from one look to the next; `Anneal` looks back as far in every iteration


class _Walk(NamedTuple):
    """Chains (lanes * chains), all at one temperature."""

    unit: Array  # coordinates (n + d, lanes * chains)
    cost: Array  # E there
    best: Array  # the best coordinates so far
    best_cost: Array
    looked: Array  # best_cost when it was last looked at; infinite before
    done: Array  # of chains; those of a lane end together
    temperature: Array
    iteration: Array  # of the next perturbation, from 1


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

    def perturbed(walk: _Walk) -> _Walk:
        width = schedule.step * jnp.sqrt(walk.temperature / schedule.initial)
        # Even numbers are for perturbations and odd ones for acceptance; 1 is that of the start below.
        steps = _by_chain(draw(keys, 2 * walk.iteration), size, chains).astype(walk.unit.dtype)
        luck = jnp.log(_by_chain(chance(keys, 2 * walk.iteration + 1), size + 1, chains)[0]).astype(walk.unit.dtype)
        trial = jnp.clip(walk.unit + width * steps, 0.0, 1.0)
        cost = _objective(layout, chained, trial)[0]
        accepted = (walk.cost - cost > walk.temperature * luck) & ~walk.done
        unit, cost = jnp.where(accepted, trial, walk.unit), jnp.where(accepted, cost, walk.cost)
        better = cost < walk.best_cost
        best, best_cost = jnp.where(better, unit, walk.best), jnp.where(better, cost, walk.best_cost)
        due = (walk.iteration % schedule.patience) == 0
        small = (walk.looked - best_cost < schedule.tolerance).reshape(-1, chains).all(axis=1)
        done = walk.done | (due & jnp.repeat(small, chains))
        looked = jnp.where(due, best_cost, walk.looked)
        return _Walk(unit, cost, best, best_cost, looked, done, walk.temperature * schedule.rate, walk.iteration + 1)

    def going(walk: _Walk) -> Array:
        return (walk.iteration < iterations) & (walk.temperature >= schedule.final) & ~walk.done.all()

    unit = _by_chain(chance(keys, jnp.asarray(1)), size + 1, chains)[:size].astype(lanes.target.dtype)
    cost = _objective(layout, chained, unit)[0]
    none_done = jnp.zeros(count, dtype=bool)
    start = _Walk(unit, cost, unit, cost, cost + jnp.inf, none_done, schedule.initial, jnp.asarray(1))
    end = jax.lax.while_loop(going, perturbed, start)
    return _best_of(layout, lanes, end, schedule, chains)


def _best_of(layout: Layout, lanes: LaneArrays, end: _Walk, schedule: Schedule, chains: int) -> State:
    """The best chain of each lane as the end of a search.

    It is done where it cooled to the final temperature or changed no more, not where its iterations ran out. A weight
    at the reach of its term is at no bound: without an upper bound nothing holds it there. The hessian is not computed,
    because no step follows.
    """
    count = lanes.target.shape[-1]
    best = jnp.argmin(end.best_cost.reshape(-1, chains), axis=1) + chains * jnp.arange(count)
    unit = end.best[:, best]
    cost, weights = _objective(layout, lanes, unit)
    low, high = unit[: layout.n] <= 0, (unit[: layout.n] >= 1) & jnp.isfinite(lanes.upper)
    cooled = (end.temperature < schedule.final) | end.done[best]
    return begin(layout, lanes, unit[layout.n :])._replace(
        weights=weights,
        side=high.astype(jnp.int32) - low.astype(jnp.int32),
        cost=cost,
        done=cooled,
        steps=jnp.full(cost.shape, chains, dtype=jnp.int32) * end.iteration.astype(jnp.int32),
    )


def _chained(lanes: LaneArrays, values: Array, chains: int) -> Array:
    """Values of each lane once for every chain; values that all lanes have in common as they are."""
    per_lane = values.shape[-1] == lanes.target.shape[-1]
    return jnp.repeat(values, chains, axis=-1) if per_lane else values


def _by_chain(drawn: Array, size: int, chains: int) -> Array:
    """Random numbers of lanes (lanes, size * chains) as (size, lanes * chains)."""
    return jnp.moveaxis(drawn.reshape(-1, size, chains), 1, 0).reshape(size, -1)


def _objective(layout: Layout, lanes: LaneArrays, unit: Array) -> tuple[Array, Array]:
    """E and the weights at coordinates (n + d, lanes), as `Anneal` has them.

    A coordinate of a weight runs from its lower bound to its upper one. Without an upper bound it runs to the weight at
    which its term t alone fits best, t'y/t't, where that is higher: neither terms nor weights are negative, so no
    optimum of squared errors has a larger one. In logarithms too the values themselves are y, as `Anneal` has it.
    """
    terms = basis(layout, lanes, shape_values(unit[layout.n :], lanes.axes))
    point = weighted(layout, logarithms.uniform(lanes) if layout.logarithmic else lanes, terms)
    squared = summed(layout, [(index, full(lanes, column**2)) for index, column in point.columns], layout.n)
    alone = summed(layout, times(point.columns, point.target), layout.n) / jnp.where(squared > 0, squared, 1.0)
    reach = jnp.where(jnp.isfinite(lanes.upper), lanes.upper, jnp.maximum(alone, lanes.lower))
    weights = lanes.lower + unit[: layout.n] * (reach - lanes.lower)
    if layout.logarithmic:
        return logarithms.modelled(layout, lanes, terms, weights).cost, weights
    return jnp.sum(residual_of(point, weights) ** 2, axis=(0, 1)), weights
