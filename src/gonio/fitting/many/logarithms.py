"""Log weighting of many lanes at once: the squared difference of ln f and ln m, as a fit of one scan minimises it.

With the roots s of the points' weights, scaled so that their squared sum is 1, the measured values m and the model
f = sum_k w_k t_k, the residual is r = s (ln m - ln f), and E = r'r. It is not linear in the weights w: so a step moves
weights and shape together. With J the derivatives of s ln f, which for a weight are s t_k / f, a step of Gauss and
Newton solves (J'J + a D) x = J'r within the bounds of all values, with D the diagonal of J'J and a damping a
(marquardt1963). A search starts from the weights of least relative error, which for small errors are those of least
logarithmic error: ln f - ln m is then (f - m)/m.

A model of zero has no logarithm. As in a fit of one scan (`Problem.difference`) it counts as the least number.
"""

from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from gonio.fitting.many.layout import Layout
from gonio.fitting.many.projection import (
    Columns,
    Evaluation,
    LaneArrays,
    basis,
    full,
    gram,
    in_cells,
    projected,
    shape_values,
    slope_of_axes,
    slopes,
    summed,
    times,
    weighted,
)
from gonio.fitting.many.sweep import bounded

if TYPE_CHECKING:
    from gonio.fitting.many.descent import State

Array = jax.Array
LOWEST = float(np.log(np.finfo(float).tiny))  # the logarithm that stands for that of zero


def relative(lanes: LaneArrays) -> LaneArrays:
    """The same lanes with relative weighting, in which E = sum s^2 (f/m - 1)^2 is near to that of logarithms."""
    root = jnp.where(lanes.root > 0, lanes.root / _measured(lanes), 0.0)
    return lanes._replace(root=root, target=full(lanes, lanes.root))


def uniform(lanes: LaneArrays) -> LaneArrays:
    """The same lanes with uniform weighting, of measured values in place of logarithms."""
    root = full(lanes, (lanes.root > 0).astype(lanes.target.dtype))
    return lanes._replace(root=root, target=root * _measured(lanes))


def _measured(lanes: LaneArrays) -> Array:
    """The measured values over the scale of each lane's data; 1 where a point has no weight."""
    known = lanes.root > 0
    return jnp.exp(jnp.where(known, lanes.target / jnp.where(known, lanes.root, 1.0), 0.0))


def first_weights(layout: Layout, lanes: LaneArrays, unit: Array) -> Array:
    """Weights (n, lanes) from which to search at coordinates (d, lanes): of several, those of least E.

    They are the weights of least relative error, and those of each term alone. The first can be near zero, or leave the
    model negative somewhere, where errors are large.
    """
    of_ratios = relative(lanes)
    terms = basis(layout, lanes, shape_values(unit, lanes.axes))
    best = jnp.zeros((layout.n, unit.shape[1]), dtype=lanes.target.dtype)
    if not layout.n:
        return best
    best = projected(layout, of_ratios, weighted(layout, of_ratios, terms), best.astype(jnp.int32))[1]
    cost = modelled(layout, lanes, terms, best).cost
    for name, index in layout.weights:
        weights = jnp.clip(_alone(layout, lanes, terms[name], index), lanes.lower, lanes.upper)
        of_term = modelled(layout, lanes, terms, weights).cost
        best, cost = jnp.where(of_term < cost, weights, best), jnp.minimum(of_term, cost)
    return best


def _alone(layout: Layout, lanes: LaneArrays, term: Array, index: tuple[int, ...]) -> Array:
    """The weights (n, lanes) of one term that fits best alone, where it is positive; zeros for the others."""
    positive = full(lanes, (term > 0) & (lanes.root > 0))
    root = lanes.root * positive
    ratio = root * (lanes.target - root * jnp.log(jnp.where(positive, term, 1.0)))
    total, count = (summed(layout, [(index, full(lanes, part))], layout.n) for part in (ratio, root**2))
    return jnp.where(count > 0, jnp.exp(total / jnp.where(count > 0, count, 1.0)), 0.0)


class Modelled(NamedTuple):
    """The model over the scale of each lane's data (cells, rows, lanes) and what is left of the logarithms.

    inverse: one over the model, zero where it has no logarithm and so no derivative.
    """

    inverse: Array
    residual: Array

    @property
    def cost(self) -> Array:
        """E (lanes,)."""
        return jnp.sum(self.residual**2, axis=(0, 1))


def modelled(layout: Layout, lanes: LaneArrays, terms: dict[str, Array], weights: Array) -> Modelled:
    """The model for some weights, from its terms."""
    total = jnp.zeros(lanes.target.shape, dtype=lanes.target.dtype)
    for name, index in layout.weights:
        total = total + in_cells(weights, index) * terms[name]
    for name in layout.held:
        if name in layout.model.terms:
            total = total + lanes.held[name] * terms[name] * lanes.fixed
    has_logarithm = total > 0
    safe, lowest = jnp.where(has_logarithm, total, 1.0), LOWEST + jnp.log(lanes.fixed)
    logarithm = jnp.where(has_logarithm, jnp.maximum(jnp.log(safe), lowest), lowest)
    return Modelled(jnp.where(has_logarithm, 1 / safe, 0.0), lanes.target - lanes.root * logarithm)


def _by_weight(layout: Layout, lanes: LaneArrays, terms: dict[str, Array], model: Modelled) -> Columns:
    """Derivatives of s ln f by the weights."""
    return [(index, lanes.root * terms[name] * model.inverse) for name, index in layout.weights]


def linearised(layout: Layout, lanes: LaneArrays, unit: Array, weights: Array) -> tuple[Columns, Columns, Array]:
    """Derivatives of s ln f by the weights and by the shape, and the residual (cells, rows, lanes)."""
    shape = shape_values(unit, lanes.axes)
    terms = basis(layout, lanes, shape)
    model = modelled(layout, lanes, terms, weights)
    by_shape = times(slopes(layout, lanes, shape, weights), model.inverse)
    return _by_weight(layout, lanes, terms, model), by_shape, model.residual


def evaluate(layout: Layout, lanes: LaneArrays, unit: Array, weights: Array) -> Evaluation:
    """E at coordinates, and what a step of weights and coordinates needs, at better weights than those that are given.

    One step of the weights alone follows at the new shape, where it lowers E. Without it a search would creep along
    valleys, where weights and shape make up for each other: the straight step leaves the valley, and this returns.
    """
    shape = shape_values(unit, lanes.axes)
    terms = basis(layout, lanes, shape)
    weights, model = _corrected(layout, lanes, terms, weights)
    columns = _by_weight(layout, lanes, terms, model)
    if layout.d:
        along = slope_of_axes(unit, lanes.axes)
        for index, slope in times(slopes(layout, lanes, shape, weights), model.inverse):
            columns.append((tuple(layout.n + c for c in index), slope * in_cells(along, index)))
    size = layout.n + layout.d
    side = (weights >= lanes.upper) * 1 - (weights <= lanes.lower) * 1
    return Evaluation(
        weights,
        side.astype(jnp.int32),
        model.cost,
        gram(layout, columns, size),
        summed(layout, times(columns, model.residual), size),
    )


def _corrected(layout: Layout, lanes: LaneArrays, terms: dict[str, Array], weights: Array) -> tuple[Array, Modelled]:
    """The weights after a step of them alone, where that lowers E, and the model there."""
    before = modelled(layout, lanes, terms, weights)
    if not layout.n:
        return weights, before
    columns = _by_weight(layout, lanes, terms, before)
    pull = summed(layout, times(columns, before.residual), layout.n)
    side = jnp.zeros(weights.shape, dtype=jnp.int32)
    change, _ = bounded(gram(layout, columns, layout.n), pull, lanes.lower - weights, lanes.upper - weights, side)
    changed = moved(weights, change, lanes.lower, lanes.upper)
    after = modelled(layout, lanes, terms, changed)
    better = after.cost < before.cost
    return jnp.where(better, changed, weights), Modelled(
        *(jnp.where(better, a, b) for a, b in zip(after, before, strict=True))
    )


def moved(values: Array, step: Array, lower: Array | float, upper: Array | float) -> Array:
    """Values after a step within their bounds; one that reaches a bound is at it, without the rounding of a sum."""
    after = jnp.clip(values + step, lower, upper)
    return jnp.where(step <= lower - values, lower, jnp.where(step >= upper - values, upper, after))


def step(lanes: LaneArrays, unit: Array, at: "State", damping: Array) -> tuple[Array, Array]:
    """A damped step (n + d, lanes) of weights and coordinates, and by how much it would lower E without curvature.

    It is the exact minimum of the damped quadratic model within the bounds. unit (d, lanes): the coordinates of `at`.
    """
    size = len(at.pull)
    own = jnp.diagonal(at.hessian, axis1=0, axis2=1).T
    damped = at.hessian + damping * own * np.eye(size, dtype=at.pull.dtype)[:, :, None]
    low = jnp.concatenate([lanes.lower - at.weights, -unit])
    high = jnp.concatenate([lanes.upper - at.weights, 1 - unit])
    move, _ = bounded(damped, at.pull, low, high, jnp.zeros(at.pull.shape, dtype=jnp.int32))
    along = jnp.sum(at.hessian * move[None], axis=1)
    return move, 2 * jnp.sum(at.pull * move, axis=0) - jnp.sum(move * along, axis=0)
