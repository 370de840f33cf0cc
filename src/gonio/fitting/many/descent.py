"""Damped steps of many lanes at once, compiled by JAX: from the shape where each lane starts down to its minimum.

A step minimises a quadratic model of E, damped (levenberg1944, marquardt1963, nielsen1999). Which values it moves
depends on the objective. Where the residual is linear in the weights, these are exact at every shape, and a step moves
the shape alone (`projection`). In logarithms a step moves weights and shape together (`logarithms`).
"""

import functools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from gonio.fitting.many import logarithms, projection
from gonio.fitting.many.layout import Layout
from gonio.fitting.many.projection import Evaluation, LaneArrays
from gonio.fitting.many.sweep import bordered, sweep, unit_scaled

Array = jax.Array


class State(NamedTuple):
    """Where the search of each lane is, and what is known there.

    `cost` to `pull` are those of `unit`, and the fields from `weights` to `pull` are those of an `Evaluation`.
    In logarithms `hessian` (n + d, n + d, lanes) and `pull` (n + d, lanes) are of weights and coordinates together.
    """

    unit: Array  # coordinates (d, lanes)
    weights: Array  # (n, lanes), over the scale of each lane's data
    side: Array  # at which bound each weight is: -1 lower, 0 none, 1 upper
    cost: Array  # E
    hessian: Array  # of half of E, along the coordinates (d, d, lanes)
    pull: Array  # the downhill gradient of half of E (d, lanes)
    damping: Array  # of the next step
    growth: Array  # the factor of damping when the next step is refused
    remaining: Array  # by how much an undamped step could still lower E, relative to E
    done: Array  # lanes that take no more steps
    steps: Array  # steps so far; -1 before the first evaluation, which is none


def _step(
    hessian: Array, pull: Array, unit: Array, damping: Array, lower: Array | float = 0.0, upper: Array | float = 1.0
) -> tuple[Array, Array]:
    """A damped step (d, lanes) from `unit`, and by how much it would lower E without curvature and bounds.

    A coordinate at a bound stays there while the pull points outwards. In units of its column's length the hessian has
    a unit diagonal, so that the damping is relative to it (marquardt1963).
    """
    d = len(pull)
    if not d:
        return pull, jnp.zeros_like(damping)
    free = ~(((unit <= lower) & (pull < 0)) | ((unit >= upper) & (pull > 0)))
    scaled, length = unit_scaled(hessian)
    damped = scaled + damping * jnp.eye(d, dtype=pull.dtype)[:, :, None]
    rhs = jnp.where(free, pull / length, 0.0)
    swept, used = sweep(bordered(damped, rhs), d, free)
    step = jnp.where(used, swept[:d, d], 0.0)
    gain = 2 * jnp.sum(rhs * step, axis=0) - jnp.sum(step[:, None] * scaled * step[None, :], axis=(0, 1))
    return step / length, gain


@functools.partial(jax.jit, static_argnames=("layout",))
def begin(layout: Layout, lanes: LaneArrays, unit: Array) -> State:
    """The state before the first step at coordinates (d, lanes): nothing is known, so that step stays and evaluates."""
    count = unit.shape[1]
    ones = jnp.ones(count, dtype=lanes.target.dtype)
    if layout.logarithmic:
        weights, size = logarithms.first_weights(layout, lanes, unit), layout.n + layout.d
    else:
        weights, size = jnp.zeros((layout.n, count), dtype=ones.dtype), layout.d
    none, hessian = jnp.zeros((size, count), ones.dtype), jnp.zeros((size, size, count), ones.dtype)
    unknown = Evaluation(weights, jnp.zeros(weights.shape, dtype=jnp.int32), jnp.inf * ones, hessian, none)
    return State(unit, *unknown, 1e-3 * ones, 2 * ones, ones, ones == 0, jnp.full(count, -1, dtype=jnp.int32))


def settled(dtype: Any) -> float:
    """What a step may still win, relative to E, where a search ends: its square root is the offset of bates1981."""
    return max(1e-10, 4 * float(np.finfo(dtype).eps))


class _Trial(NamedTuple):
    """Where a damped step leads: the coordinates (d, lanes), what is known there, and by how much E should fall.

    taken, asked (lanes,): the largest part of the step, within the bounds and without them.
    """

    unit: Array
    found: Evaluation
    expected: Array
    taken: Array
    asked: Array


def _tried(layout: Layout, lanes: LaneArrays, now: State) -> _Trial:
    """A damped step of every lane."""
    if layout.logarithmic:
        step, expected = logarithms.step(lanes, now.unit, now, now.damping)
        weights = logarithms.moved(now.weights, step[: layout.n], lanes.lower, lanes.upper)
        unit = logarithms.moved(now.unit, step[layout.n :], 0.0, 1.0)
        sizes = jnp.where(now.weights > 0, now.weights, 1.0)
        size = jnp.abs(jnp.concatenate([step[: layout.n] / sizes, step[layout.n :]])).max(axis=0, initial=0.0)
        return _Trial(unit, logarithms.evaluate(layout, lanes, unit, weights), expected, size, size)
    step, expected = _step(now.hessian, now.pull, now.unit, now.damping)
    unit = jnp.clip(now.unit + step, 0.0, 1.0)
    taken, asked = (jnp.abs(change).max(axis=0, initial=0.0) for change in (unit - now.unit, step))
    return _Trial(unit, projection.evaluate(layout, lanes, unit, now.side), expected, taken, asked)


def _remaining(layout: Layout, lanes: LaneArrays, unit: Array, at: Evaluation) -> Array:
    """By how much an undamped step would lower E."""
    if layout.logarithmic:
        lower, upper = jnp.concatenate([lanes.lower, 0 * unit]), jnp.concatenate([lanes.upper, 0 * unit + 1])
        values = jnp.concatenate([at.weights, unit])
        return _step(at.hessian, at.pull, values, jnp.zeros_like(at.cost), lower, upper)[1]
    return _step(at.hessian, at.pull, unit, jnp.zeros_like(at.cost))[1]


@functools.partial(jax.jit, static_argnames=("layout",))
def advance(layout: Layout, lanes: LaneArrays, state: State, steps: Array) -> State:
    """Up to so many steps more of every lane that is not done (levenberg1944, marquardt1963, nielsen1999)."""
    eps = float(np.finfo(lanes.target.dtype).eps)
    enough, exact = settled(lanes.target.dtype), (64 * eps) ** 2  # E of a fit that leaves rounding alone

    def one(carry: tuple[State, Array]) -> tuple[State, Array]:
        now, count = carry
        there, trial, expected, taken, asked = _tried(layout, lanes, now)
        better = (trial.cost < now.cost) & ~now.done
        # Nielsen's rule: a gain as expected divides the damping by up to 9, refusals multiply it by 2, 4, 8, ..
        ratio = (now.cost - trial.cost) / jnp.where(expected > 0, expected, 1.0)
        eased = now.damping * jnp.maximum(1 / 9, 1 - (2 * ratio - 1) ** 3)
        damping = jnp.where(better, jnp.maximum(eased, 1e-12), now.damping * now.growth)
        growth = jnp.where(better, 2.0, 2 * now.growth)
        best = Evaluation(*(jnp.where(better, new, old) for new, old in zip(trial, now[1:6], strict=True)))
        unit = jnp.where(better, there, now.unit)
        remaining = _remaining(layout, lanes, unit, best)
        remaining = remaining / jnp.where(best.cost > 0, best.cost, 1.0)
        small = (jnp.where(better, taken, asked) < 16 * eps) & jnp.isfinite(
            now.cost
        )  # the first pass, from infinite E, is not to move
        rounded = ~better & (expected < 4 * eps * now.cost)  # a better point could not be told from this one
        done = now.done | (remaining <= enough) | (best.cost <= exact) | small | rounded
        steps = now.steps + 1
        reached = State(unit, *best, damping, growth, remaining, done, steps)
        # A lane that is done does not change any more, however long the others of its block take.
        return State(*(jnp.where(now.done, old, new) for new, old in zip(reached, now, strict=True))), count + 1

    def going(carry: tuple[State, Array]) -> Array:
        return ~carry[0].done.all() & (carry[1] < steps)

    return jax.lax.while_loop(going, one, (state, jnp.zeros((), dtype=steps.dtype)))[0]


@jax.jit
def better(first: State, second: State) -> State:
    """Of two searches of the same lanes, the one that is lower in each."""
    lower = second.cost < first.cost
    return State(*(jnp.where(lower, new, old) for new, old in zip(second, first, strict=True)))
