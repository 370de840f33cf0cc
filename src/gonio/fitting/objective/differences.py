"""Derivatives by differences of function values, within bounds, as accurate as double precision allows.

A plain difference (f(x + h) - f(x))/h errs by some h in the curvature and by some eps/h in rounding, with eps = 2.2e-16
the precision of the arithmetic. The best step is then sqrt(eps) of the value's size, and half of the digits are right.
A central difference (f(x + h) - f(x - h))/(2 h) gives two thirds of the digits. Central differences over halved steps,
extrapolated to step zero, give some twelve digits (ridders1982), which is what uncertainties and Newton steps need.

Arrays: a point is (values,); a function of a point is (points,), as many as the scan has; a derivative is
(points, values).
"""

from collections.abc import Callable, Generator

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
Function = Callable[[Values], Values]
Bound = Values | float
Difference = Generator[Values, Values, Values]  # asks for values at two points at a time, returns a derivative
EPS = float(np.finfo(float).eps)

SMALLEST = 1e-3  # scale of a value that is zero: small in the unit of every parameter
FORWARD = EPS ** (1 / 2)  # of a value's scale: where the error of a forward difference is least
CENTRAL = EPS ** (1 / 3)  # the same for differences of second order
WIDEST = 2.0**-6  # of a value's scale: the first step of an extrapolated difference; halving it loses no digits
HALVINGS = 16  # down to 2^-22 of the scale, below which a plain difference is as good as it gets
ENOUGH = 1e-10  # estimated error at which an extrapolation ends: the estimate lags the error by 1e-2 or more


def derivative(
    function: Function,
    point: Values,
    lower: Bound = -np.inf,
    upper: Bound = np.inf,
    *,
    scale: Bound = 0.0,
    vectorised: bool = False,
) -> Values:
    """Derivative (points, values) of a function at a point (values,), within bounds.

    By central differences extrapolated to step zero (ridders1982), accurate to some 1e-12 of a column's length. Where a
    bound leaves no room for both sides: a one-sided difference of second order, accurate to 1e-10.
    scale (values,): by how much a value must change to matter where it is smaller itself. vectorised: whether the
    function also takes several points (n, values) at once and returns (n, points).
    """
    return derivative_of(Counted(function, vectorised), *within(point, lower, upper), scale)


class Counted:
    """A function that counts its calls and remembers the last, which a search repeats when it takes differences."""

    def __init__(self, function: Function, vectorised: bool) -> None:
        self._function, self._vectorised = function, vectorised
        self._point, self._value = np.empty(0), np.empty(0)
        self.evaluations = 0

    def __call__(self, point: Values) -> Values:
        """The value (points,) at one point (values,)."""
        if not np.array_equal(point, self._point) or not self.evaluations:
            self.evaluations += 1
            self._point, self._value = point.copy(), self._function(point)
        return self._value

    def each(self, points: Values) -> Values:
        """The values (n, points) at several points (n, values)."""
        self.evaluations += len(points)
        return self._function(points) if self._vectorised else np.stack([self._function(point) for point in points])


def within(point: Values, lower: Bound, upper: Bound) -> tuple[Values, Values, Values]:
    """The point moved inside its bounds, and the bounds with one entry a value."""
    values = np.asarray(point, dtype=float)
    low, high = (np.broadcast_to(np.asarray(bound, dtype=float), values.shape) for bound in (lower, upper))
    return np.clip(values, low, high), low, high


def sizes_of(point: Values, scale: Bound) -> Values:
    """By how much each value must change to matter; one for a value that is zero and has no scale."""
    sizes = np.maximum(np.abs(point), scale)
    return np.where(sizes > 0, sizes, 1.0)


def replaced(point: Values, where: Mask | int, part: Bound) -> Values:
    """A copy of the point with other values at some places."""
    changed = point.copy()
    changed[where] = part
    return changed


def forward(function: Counted, point: Values, sizes: Values, lower: Values, upper: Values) -> Values:
    """The derivative (points, values) to some 1e-8, with one evaluation a value, towards the bound that is farther."""
    moved = forward_steps(point, sizes, lower, upper)
    return ((function.each(moved) - function(point)) / (np.diagonal(moved) - point)[:, None]).T


def forward_steps(point: Values, sizes: Values, lower: Values, upper: Values) -> Values:
    """The points (values, values) of forward differences, each towards the bound that is farther."""
    return point + np.diag(FORWARD * sizes * np.where(upper - point >= point - lower, 1, -1))


def derivative_of(function: Counted, point: Values, lower: Values, upper: Values, scale: Bound) -> Values:
    """What `derivative` gives, of a function that counts, at a point inside its bounds."""
    sizes, room = sizes_of(point, scale), np.minimum(point - lower, upper - point)
    columns: list[Difference] = []
    for k in range(len(point)):
        if room[k] < CENTRAL * sizes[k]:
            inwards = CENTRAL * sizes[k] * (1 if upper[k] - point[k] > point[k] - lower[k] else -1)
            columns.append(_one_sided(function(point), point, k, inwards))
        else:
            columns.append(_extrapolated(point, k, min(WIDEST * sizes[k], room[k])))
    return np.stack(_side_by_side(function, columns), axis=-1)


def _side_by_side(function: Counted, columns: list[Difference]) -> list[Values]:
    """What each difference returns; the points that all of them ask for next are evaluated in one call."""
    finished: dict[int, Values] = {}
    asked = {k: next(column) for k, column in enumerate(columns)}
    while asked:
        values = function.each(np.concatenate(list(asked.values())))
        for k, pair in zip(list(asked), np.split(values, len(asked)), strict=True):
            try:
                asked[k] = columns[k].send(pair)
            except StopIteration as end:
                finished[k] = end.value
                del asked[k]
    return [finished[k] for k in range(len(columns))]


def _one_sided(value: Values, point: Values, k: int, step: float) -> Difference:
    """Derivative by value k to second order from points on one side: (4 d1 - d2)/(2 h), with d1 and d2 the changes."""
    once, twice = (yield np.stack([replaced(point, k, point[k] + many * step) for many in (1, 2)])) - value
    return (4 * once - twice) / (2 * step)  # of differences, so that a slope of zero is exactly zero


def _extrapolated(point: Values, k: int, step: float) -> Difference:
    """Derivative by value k: central differences over halved steps, extrapolated to zero (ridders1982).

    Each entry of a row is of two orders more than the one before. The entry that differs least from its neighbours is
    kept, and the table ends where rounding makes them differ more again.
    """
    row: list[Values] = []
    best, least = np.empty(0), np.inf
    for _ in range(HALVINGS + 1):
        sides = np.stack([replaced(point, k, point[k] + step), replaced(point, k, point[k] - step)])
        ahead, behind = yield sides
        # over the distance of the rounded points, which is not exactly twice the step
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


def derivative_by_group(
    function: Function, values: Values, group: npt.NDArray[np.intp], lower: float, upper: float, scale: float
) -> Values:
    """Derivative (points,) of a function of the values (groups,), each point by the value of its own group.

    group (points,): the only value that a point depends on. All values move at once, so that many groups cost no more
    evaluations than one. Each has its own steps and its own extrapolation, and accuracy is that of `derivative`.
    """

    def norm(numbers: Values) -> Values:
        return np.sqrt(np.bincount(group, numbers**2, minlength=len(values)))

    sizes, room = sizes_of(values, scale), np.minimum(values - lower, upper - values)
    near = room < CENTRAL * sizes
    best, least, done = np.zeros(len(group)), np.full(len(values), np.inf), near.copy()
    step, row = np.where(near, 0.0, np.minimum(WIDEST * sizes, room)), list[Values]()
    for _ in range(HALVINGS + 1):
        if done.all():
            break
        ahead, behind = values + step, values - step
        width = np.where(near, 1.0, ahead - behind)[group]
        above, row = row, [(function(ahead) - function(behind)) / width]
        if not above:
            best = row[0]
        for order, coarser in enumerate(above, start=1):
            row.append(row[-1] + (row[-1] - coarser) / (4.0**order - 1))
            error = np.maximum(norm(row[-1] - row[-2]), norm(row[-1] - coarser))
            better = (error < least) & ~done
            best, least = np.where(better[group], row[-1], best), np.where(better, error, least)
        size = norm(best)
        if above:
            worse = norm(row[-1] - above[-1]) > 2 * least
            done |= (least <= ENOUGH * size) | ((least < CENTRAL * size) & worse)
        step = step / 2
    if near.any():
        inwards = np.where(near, CENTRAL * sizes * np.where(upper - values > values - lower, 1, -1), 0.0)
        value = function(values)
        once, twice = (function(values + many * inwards) - value for many in (1, 2))
        best = np.where(near[group], (4 * once - twice) / (2 * np.where(near, inwards, 1.0))[group], best)
    return best
