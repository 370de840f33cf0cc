"""The local search of every fit: a trust region finds the minimum, Newton steps find its last digits.

Near a minimum the cost is flat: points whose costs agree to rounding can differ in the eighth digit of a value. The
last digits are therefore sought where the residual is orthogonal to its tangent plane (bates1981), which needs accurate
derivatives and no comparison of costs.
"""

from collections.abc import Callable, Generator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.optimize import OptimizeResult, least_squares

Values = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Function = Callable[[Values], Values]
Bound = Values | float
Difference = Generator[Values, Values, Values]  # asks for values at two points at a time, returns a derivative
EPS = float(np.finfo(float).eps)

SEARCHED = 1e-10  # relative change of cost or point that ends a search: Newton steps start well from there
ROUGH = 1e-3  # the same for a first search that only finds out which bounds hold values
ROUNDS = 6  # searches at most, each with those values held that press against their bound

FORWARD = EPS ** (1 / 2)  # of a value's scale: where the error of a forward difference is least
CENTRAL = EPS ** (1 / 3)  # the same for differences of second order
WIDEST = 2.0**-6  # of a value's scale: the first step of an extrapolated difference; halving it loses no digits
HALVINGS = 16  # down to 2^-22 of the scale, below which a plain difference is as good as it gets
ENOUGH = 1e-10  # estimated error at which an extrapolation ends: the estimate lags the error by 1e-2 or more

SETTLED = 1e-11  # offset that is enough: it moves a value by 1e-11 sqrt(points) of its standard deviation
POLISHING = 20  # Newton steps at most; they end when one does not halve the offset
LOWER = 1e-12  # of the cost: by how much a step that does not halve the offset must lower it, in a curved valley
SAME = EPS**0.5  # by how much rounding may raise the relative cost of a better point; a jump elsewhere raises it more
BENT = 2.0**-6  # of a standard deviation: the step that measures curvature, short of the next kink and above rounding
SADDLE = 0.01  # least curvature, in units of the tangent plane's own, of what is still a minimum


class Descent(NamedTuple):
    """Where a local search ended.

    cost: squared sum of the residual. offset: the part of its length that lies in the tangent plane, zero at an exact
    minimum (bates1981); NaN where the last digits were not sought. exhausted: the search ran out of steps.
    """

    point: Values
    cost: float
    offset: float
    exhausted: bool
    evaluations: int


def descend(
    residual: Function,
    start: Values,
    lower: Bound = -np.inf,
    upper: Bound = np.inf,
    *,
    scale: Bound = 0.0,
    jacobian: Function | None = None,
    tolerance: float = SEARCHED,
    max_steps: int = 2000,
    last_digits: bool = True,
    vectorised: bool = False,
) -> Descent:
    """The minimum of the squared residual within bounds that lies downhill of `start` (branch1999, by SciPy).

    scale: what a value must change by to matter where it is smaller itself; it sets the steps of differences.
    jacobian: the exact derivative (points, values), where there is one. tolerance: relative change of cost or point
    that ends the search. max_steps: points that it may try, not counting those of differences. last_digits: whether to
    `polish`, which can double the evaluations of a short search. vectorised: whether the residual also takes several
    points (n, values) at once.
    """
    counted = _Counted(residual, vectorised)
    point, low, high = _within(start, lower, upper)
    slopes = jacobian or (lambda x: _forward(counted, x, _sizes(x, scale), low, high))
    bounded = bool(np.isfinite([low, high]).any())
    held, reached, steps, exhausted = np.zeros(len(point), dtype=bool), np.inf, 0, False
    for _ in range(ROUNDS):
        value, tangent = counted(point), slopes(point)
        sizes, downhill = _sizes(point, scale), -(tangent.T @ value)
        with np.errstate(all="ignore"):  # a slope that overflows is not flat
            flat = sizes**2 * np.sum(tangent**2, axis=0) <= (4 * FORWARD) ** 2 * _squared(value)  # rounding
        pressed = ((point <= low) & (downhill <= 0)) | ((point >= high) & (downhill >= 0))
        if (pressed | flat).all() or not value.any() or (reached == tolerance and np.array_equal(pressed, held)):
            break
        held, reached = pressed, (ROUGH if bounded and not steps else tolerance)
        found = _trust_region(counted, slopes, point, low, high, sizes, ~held, reached, max_steps - steps)
        point = _edges(counted, found.x, _reach(found, sizes, ~held), low, high)
        steps, exhausted = steps + found.nfev, found.status == 0
        if exhausted or not bounded:
            break
    end = Descent(point, _squared(counted(point)), np.nan, exhausted, counted.evaluations)
    if not last_digits:
        return end
    return polish(residual, end, low, high, scale=scale, jacobian=jacobian, vectorised=vectorised)


def polish(
    residual: Function,
    end: Descent,
    lower: Bound = -np.inf,
    upper: Bound = np.inf,
    *,
    scale: Bound = 0.0,
    jacobian: Function | None = None,
    vectorised: bool = False,
    curvature: Function | None = None,
    settled: float = SETTLED,
) -> Descent:
    """The last digits of a minimum: Newton steps on the values that are at no bound, while each halves the offset.

    Gauss-Newton steps contract by the ratio of the residual to the radius of curvature of the model's surface, which a
    poor fit brings near one (bates1980). With the curvature, measured once, the first step already brings most digits.
    curvature: at a point, what the second derivative of half the squared residual has (values, values) beside the
    product of the Jacobian with itself, where that is known; the first step, from farther off, goes without it.
    settled: offset that is enough.
    """
    counted = _Counted(residual, vectorised)
    point, low, high = _within(end.point, lower, upper)
    free = (low < point) & (point < high)

    def slopes(point: Values) -> Values:
        return (jacobian(point) if jacobian else _derivative(counted, point, low, high, scale))[:, free]

    with np.errstate(all="ignore"):  # a step out of the model's domain gives no number, and is refused
        value, tangent = counted(point), slopes(point)
        if not np.isfinite(tangent).all():
            return end
        plane, cost, measured = Tangent(tangent), end.cost, False
        offset = plane.offset(value)
        for step in range(POLISHING):
            if not offset > settled:
                break
            if not measured:
                directions = np.zeros((len(point), plane.directions.shape[1]))
                directions[free] = plane.directions
                if curvature is None:
                    hessian = _hessian(counted, point, value, directions, low, high)
                else:
                    bend = directions.T @ curvature(point) @ directions
                    hessian = _sound(bend if step else 0 * bend)
                measured = curvature is None  # one that is known is so at every point
            trial = point - directions @ np.linalg.solve(hessian, (tangent @ directions[free]).T @ value)
            if not np.all((low <= trial) & (trial <= high)):
                break
            trial_value = counted(trial)
            trial_cost = _squared(trial_value)
            if not trial_cost <= cost * (1 + SAME):
                break
            tangent = slopes(trial)
            if not np.isfinite(tangent).all():
                break
            plane = Tangent(tangent)
            trial_offset = plane.offset(trial_value)
            lower_still = curvature is not None and trial_cost < cost * (1 - LOWER)
            if not (trial_offset < offset / 2 or lower_still):
                break
            measured = trial_offset < offset / 10  # else the curvature was that of too far a point
            point, value, cost, offset = trial, trial_value, trial_cost, trial_offset
    exhausted = end.exhausted and not offset < SEARCHED**0.5  # the offset of a search that ends by itself
    return Descent(point, cost, offset, exhausted, end.evaluations + counted.evaluations)


def derivative(
    function: Function,
    point: Values,
    lower: Bound = -np.inf,
    upper: Bound = np.inf,
    *,
    scale: Bound = 0.0,
    vectorised: bool = False,
) -> Values:
    """Derivative (points, values) by central differences, extrapolated to step zero (ridders1982), within bounds.

    Accurate to some 1e-12 of a column's length. Where a bound leaves no room for both sides: a plain difference, 1e-10.
    scale, vectorised: as `descend` takes them.
    """
    return _derivative(_Counted(function, vectorised), *_within(point, lower, upper), scale)


class Tangent:
    """The tangent plane of a residual: an orthonormal basis, and how the values move along it.

    `directions` (values, rank) are the changes of the values that move the residual by the unit vectors `basis`
    (points, rank). `blind` marks the values that the data do not determine. Columns are scaled to unit length first,
    so that units do not matter.
    """

    def __init__(self, jacobian: Values) -> None:
        length = np.sqrt(np.sum(jacobian**2, axis=0))
        unseen = ~(length > 0)
        length[unseen] = 1.0
        u, s, vt = np.linalg.svd(jacobian / length, full_matrices=False)
        kept = s > 1e-10 * s.max(initial=0.0)  # below, the errors of differences are as large as what they tell
        self.basis: Values = u[:, kept]
        self.directions: Values = vt[kept].T / s[kept] / length[:, None]
        self.blind: Mask = unseen | (np.abs(vt[~kept]).max(axis=0, initial=0.0) > 1e-6)

    def offset(self, residual: Values) -> float:
        """The part of the residual's length that lies in the plane (bates1981)."""
        length = float(np.linalg.norm(residual))
        return float(np.linalg.norm(self.basis.T @ residual)) / length if length > 0 else 0.0


class _Counted:
    """A function that counts its calls and remembers the last, which a search repeats when it takes differences."""

    def __init__(self, function: Function, vectorised: bool) -> None:
        self._function, self._vectorised = function, vectorised
        self._point, self._value = np.empty(0), np.empty(0)
        self.evaluations = 0

    def __call__(self, point: Values) -> Values:
        if not np.array_equal(point, self._point) or not self.evaluations:
            self.evaluations += 1
            self._point, self._value = point.copy(), self._function(point)
        return self._value

    def each(self, points: Values) -> Values:
        """The values (n, points) at several points (n, values)."""
        self.evaluations += len(points)
        return self._function(points) if self._vectorised else np.stack([self._function(point) for point in points])


def _within(point: Values, lower: Bound, upper: Bound) -> tuple[Values, Values, Values]:
    """The point moved inside its bounds, and they one a value."""
    values = np.asarray(point, dtype=float)
    low, high = (np.broadcast_to(np.asarray(bound, dtype=float), values.shape) for bound in (lower, upper))
    return np.clip(values, low, high), low, high


def _sizes(point: Values, scale: Bound) -> Values:
    """By how much each value must change to matter; one for a value that is zero and has no scale."""
    sizes = np.maximum(np.abs(point), scale)
    return np.where(sizes > 0, sizes, 1.0)


def _replaced(point: Values, where: Mask | int, part: Bound) -> Values:
    replaced = point.copy()
    replaced[where] = part
    return replaced


def _squared(value: Values) -> float:
    return float(value @ value)


def _trust_region(
    residual: Function,
    jacobian: Function,
    point: Values,
    lower: Values,
    upper: Values,
    sizes: Values,
    free: Mask,
    tolerance: float,
    max_steps: int,
) -> OptimizeResult:
    """SciPy's search over the free values, in units of their sizes and of the residual's length at the start.

    So no unit decides when SciPy's absolute tolerance of the gradient ends it.
    """
    units, length = sizes[free], _squared(residual(point)) ** 0.5 or 1.0  # nothing is left to divide by in an exact fit

    def whole(part: Values) -> Values:
        return np.clip(_replaced(point, free, part * units), lower, upper)

    with np.errstate(all="ignore"):  # a trial point may overflow: the search then shortens its step
        found = least_squares(
            lambda part: residual(whole(part)) / length,
            point[free] / units,
            jac=lambda part: jacobian(whole(part))[:, free] * (units / length),
            bounds=(lower[free] / units, upper[free] / units),
            x_scale="jac",
            xtol=tolerance,
            ftol=tolerance,
            gtol=EPS,
            max_nfev=max(max_steps, 1),
        )
    found.x = whole(found.x)
    return found


def _reach(found: OptimizeResult, sizes: Values, free: Mask) -> Values:
    """The change of each value that would move the residual by its own length; zero for a value that is held."""
    with np.errstate(divide="ignore", over="ignore"):
        return _replaced(
            np.zeros(len(free)), free, sizes[free] * np.sqrt(2 * found.cost / np.sum(found.jac**2, axis=0))
        )


def _edges(residual: Function, point: Values, reach: Values, lower: Values, upper: Values) -> Values:
    """The search stays strictly inside: a bound itself may be better, and is tried where it is within reach."""
    value = residual(point)
    cost, rounding = _squared(value), EPS * len(value)
    for k in range(len(point)):
        for edge in (lower[k], upper[k]):
            if np.isfinite(edge) and 0 < abs(point[k] - edge) < reach[k]:
                at_edge = _replaced(point, k, edge)
                if (edge_cost := _squared(residual(at_edge))) <= cost * (1 + rounding):
                    point, cost = at_edge, edge_cost
    return point


def _hessian(
    residual: _Counted, point: Values, value: Values, directions: Values, lower: Values, upper: Values
) -> Values:
    """Second derivative of half the squared residual along the directions: one in the tangent plane, plus curvature.

    Measured by differences over a fraction of a standard deviation; without the curvature where that would say that
    this is no minimum.
    """
    n = directions.shape[1]
    reach = np.abs(directions).sum(axis=1)
    room = np.minimum(point - lower, upper - point)[reach > 0] / reach[reach > 0]
    step = min(BENT * float(np.linalg.norm(value)) / len(value) ** 0.5, float(room.min(initial=np.inf)) / 2)
    a, b = np.tril_indices(n, -1)
    shifts = step * np.concatenate([directions.T, (directions[:, a] + directions[:, b]).T])
    ahead, behind = np.split(residual.each(np.concatenate([point + shifts, point - shifts])), 2)
    curvature = ((ahead - value) + (behind - value)) @ value / step**2
    bend = np.diag(curvature[:n])
    bend[a, b] = bend[b, a] = (curvature[n:] - curvature[a] - curvature[b]) / 2
    return _sound(bend)


def _sound(bend: Values) -> Values:
    """One plus the curvature, or one alone where that would be no minimum."""
    hessian = np.eye(len(bend)) + bend
    sound = np.isfinite(hessian).all() and np.linalg.eigvalsh(hessian).min(initial=np.inf) > SADDLE
    return hessian if sound else np.eye(len(bend))


def _forward(function: _Counted, point: Values, sizes: Values, lower: Values, upper: Values) -> Values:
    """The derivative to some 1e-8, with one evaluation a value, towards the bound that is farther."""
    moved = forward_steps(point, sizes, lower, upper)
    return ((function.each(moved) - function(point)) / (np.diagonal(moved) - point)[:, None]).T


def forward_steps(point: Values, sizes: Values, lower: Values, upper: Values) -> Values:
    """The points (values, values) of forward differences, each towards the bound that is farther."""
    return point + np.diag(FORWARD * sizes * np.where(upper - point >= point - lower, 1, -1))


def _derivative(function: _Counted, point: Values, lower: Values, upper: Values, scale: Bound) -> Values:
    sizes, room = _sizes(point, scale), np.minimum(point - lower, upper - point)
    columns: list[Difference] = []
    for k in range(len(point)):
        if room[k] < CENTRAL * sizes[k]:
            inwards = CENTRAL * sizes[k] * (1 if upper[k] - point[k] > point[k] - lower[k] else -1)
            columns.append(_one_sided(function(point), point, k, inwards))
        else:
            columns.append(_extrapolated(point, k, min(WIDEST * sizes[k], room[k])))
    return np.stack(_side_by_side(function, columns), axis=-1)


def _side_by_side(function: _Counted, columns: list[Difference]) -> list[Values]:
    """What each difference returns; what all of them ask for next is evaluated at once."""
    found: dict[int, Values] = {}
    asked = {k: next(column) for k, column in enumerate(columns)}
    while asked:
        values = function.each(np.concatenate(list(asked.values())))
        for k, pair in zip(list(asked), np.split(values, len(asked)), strict=True):
            try:
                asked[k] = columns[k].send(pair)
            except StopIteration as end:
                found[k] = end.value
                del asked[k]
    return [found[k] for k in range(len(columns))]


def _one_sided(value: Values, point: Values, k: int, step: float) -> Difference:
    """Derivative by value k to second order from points on one side."""
    once, twice = (yield np.stack([_replaced(point, k, point[k] + many * step) for many in (1, 2)])) - value
    return (4 * once - twice) / (2 * step)  # of differences: no slope is zero, not rounding


def _extrapolated(point: Values, k: int, step: float) -> Difference:
    """Derivative by value k: central differences over halved steps, extrapolated to zero (ridders1982).

    Each entry of a row is of two orders more than the one before. The entry that differs least from its neighbours is
    kept, and the table ends where rounding makes them differ more again.
    """
    row: list[Values] = []
    best, least = np.empty(0), np.inf
    for _ in range(HALVINGS + 1):
        sides = np.stack([_replaced(point, k, point[k] + step), _replaced(point, k, point[k] - step)])
        ahead, behind = yield sides
        above, row = row, [(ahead - behind) / (sides[0, k] - sides[1, k])]
        if not above:
            best = row[0]
        for order, coarser in enumerate(above, start=1):
            row.append(row[-1] + (row[-1] - coarser) / (4.0**order - 1))
            error = float(max(np.linalg.norm(row[-1] - row[-2]), np.linalg.norm(row[-1] - coarser)))
            if error < least:
                best, least = row[-1], error
        size = np.linalg.norm(best)
        if least <= ENOUGH * size or (least < CENTRAL * size and np.linalg.norm(row[-1] - above[-1]) > 2 * least):
            break
        step /= 2
    return best
