"""The local search of very many values at once: Levenberg-Marquardt steps, each solved cell by cell.

A step d solves (J'J + a D) d = -J'r, with J the derivative of the residual r and D the diagonal of J'J (marquardt1963).
It is cut at the bounds, and values that press against theirs are left out of it (kanzow2004). The damping a falls where
the cost falls as the linear model says, and grows where it does not. `search.descent` takes the same kind of step with
one matrix of all points and values; here the system is that of `objective.cells.plane`.

The last digits are sought by steps without damping, with accurate derivatives, until the residual is orthogonal to its
tangent plane, as `search.descent.polish` does. The curvature is left out, since it would take an evaluation for each
pair of values; steps are then more, and end at the same place.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.cells.plane import CellPlane
from gonio.fitting.objective.cells.slopes import Slopes, slopes
from gonio.fitting.objective.cells.structure import Cells
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.descent import SAME, SETTLED, Descent

Values = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

FIRST, LEAST, MOST = 1e-4, 1e-15, 1e15  # damping, relative to the squared length of each column
GOOD, POOR = 0.75, 0.25  # of the fall of the cost that the linear model says, beyond which the damping changes
POLISHING = 60  # steps without damping at most
SLOWER = 0.9  # of the offset: a step that leaves more gains nothing that more steps would not lose to rounding


@dataclass(frozen=True, eq=False)
class Changed:
    """A problem in cells with its residual changed: a factor and an offset for each point, and values that stay.

    factors, offset (points,): see `search.refit`. lower, upper (n,): bounds, equal for a value that stays. exact: from
    a vector, the one of its shape with the weights that are best for it, where they are linear.
    """

    problem: Problem
    cells: Cells
    factors: Values | float
    offset: Values | float
    lower: Values
    upper: Values
    exact: Callable[[Values], Values] | None = None

    def residual(self, vector: Values) -> Values:
        """The residual (points + m,) with that of the penalty."""
        out, points = self.problem.residual(vector), self.cells.points
        out[:points] = self.factors * out[:points] + self.offset
        return out

    def slopes(self, vector: Values, accurate: bool) -> Slopes:
        """Its derivative."""
        return slopes(self.problem, self.cells, vector, accurate, self.problem.penalty).scaled(self.factors)

    def inside(self, vector: Values, downhill: Values) -> Mask:
        """Which values (n,) may move: those that do not press against a bound, by J'r with the other sign (n,)."""
        pressed = ((vector <= self.lower) & (downhill <= 0)) | ((vector >= self.upper) & (downhill >= 0))
        inside: Mask = ~pressed & (self.lower < self.upper)
        return inside


def changed(
    problem: Problem,
    cells: Cells,
    factors: Values | float = 1.0,
    offset: Values | float = 0.0,
    held: tuple[int, float] | None = None,
    exact: Callable[[Values], Values] | None = None,
) -> Changed:
    """A problem as `descend` takes it; held: the place of a value that stays, and the value; exact: see Changed."""
    lower, upper = problem.lower.copy(), problem.upper.copy()
    if held:
        lower[held[0]] = upper[held[0]] = held[1]
    return Changed(problem, cells, factors, offset, lower, upper, exact)


class _Reached(NamedTuple):
    """A point of the search, with the evaluations so far; `settled`: the cost no longer falls."""

    point: Values
    value: Values
    evaluations: int
    settled: bool

    @property
    def cost(self) -> float:
        return float(self.value @ self.value)


def descend(changed: Changed, start: Values, tolerance: float, max_steps: int, last_digits: bool = False) -> Descent:
    """The minimum of the squared residual within bounds that lies downhill of `start` (n,).

    tolerance: relative change of the cost that ends the search. max_steps: points that it may try. last_digits: whether
    to look for these too. A search that runs out of steps raises nothing; `exhausted` says so.
    """
    point = np.clip(start, changed.lower, changed.upper)
    with np.errstate(all="ignore"):  # a trial point may overflow: the step is then refused
        now = _Reached(point, changed.residual(point), 1, False)
        damping = FIRST
        while not now.settled and now.evaluations < max_steps:
            now, damping = _step(changed, now, damping, tolerance, max_steps)
        end = Descent(now.point, now.cost, np.nan, not now.settled, now.evaluations)
        return _polished(changed, now, end) if last_digits else end


def _step(changed: Changed, now: _Reached, damping: float, tolerance: float, max_steps: int) -> tuple[_Reached, float]:
    """The next point whose cost is lower, and the damping for the step after it."""
    linear, evaluations = changed.slopes(now.point, accurate=False), now.evaluations
    downhill = -linear.transposed_times(now.value)
    inside = changed.inside(now.point, downhill)
    if not inside.any() or not now.value.any():
        return now._replace(settled=True), damping
    while damping < MOST and evaluations < max_steps:
        moved = CellPlane(linear, inside, damping).moved(-now.value, refined=False)
        trial = np.clip(now.point + moved, changed.lower, changed.upper)
        step = trial - now.point
        value, evaluations = changed.residual(trial), evaluations + 1
        if changed.exact:  # a product of a weight and a shape value makes a curved valley, which this follows
            better = changed.exact(trial)
            left = changed.residual(better)
            trial, value = (better, left) if left @ left < value @ value else (trial, value)
        along = linear @ step
        foreseen = 2 * float(downhill @ step) - float(along @ along)
        fall = now.cost - float(value @ value)
        if fall > 0 and foreseen > 0:
            ratio = fall / foreseen
            settled = max(fall, foreseen) <= tolerance * now.cost
            softer = damping / 10 if ratio > GOOD else damping * 4 if ratio < POOR else damping
            return _Reached(trial, value, evaluations, settled), max(softer, LEAST)
        if abs(foreseen) <= tolerance * now.cost:
            break  # what is left to gain is rounding
        damping *= 10
    return now._replace(evaluations=evaluations, settled=evaluations < max_steps), damping


def _polished(changed: Changed, now: _Reached, end: Descent) -> Descent:
    """The last digits: steps without damping, while each brings the residual nearer to orthogonal to its tangent."""
    evaluations, before, best = now.evaluations, np.inf, now
    for _ in range(POLISHING):
        linear = changed.slopes(now.point, accurate=True)
        inside = changed.inside(now.point, -linear.transposed_times(now.value))
        plane = CellPlane(linear, inside)
        offset = plane.offset(now.value)
        if not offset < SLOWER * before:
            break
        best, before = now, offset
        if offset <= SETTLED:
            break
        trial = np.clip(now.point + plane.moved(-now.value), changed.lower, changed.upper)
        value, evaluations = changed.residual(trial), evaluations + 1
        if not float(value @ value) <= now.cost * (1 + SAME):
            break
        now = _Reached(trial, value, evaluations, True)
    return Descent(best.point, best.cost, before, end.exhausted, evaluations)
