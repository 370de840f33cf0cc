"""The local search of every fit: a trust region finds the minimum, Newton steps find its last digits.

What is minimised is half of r'r, with r the residual (points,) and J its derivative (points, values). Its gradient is
J'r, and its second derivative J'J + C, with the curvature C the sum of each residual times its own second derivative.

`descend` is SciPy's trust region (branch1999). A step d solves (J'J + a D) d = -J'r, with D diagonal, which is a
Levenberg-Marquardt step (levenberg1944, marquardt1963). The damping a follows from the size of the region in which
the last steps showed the linear model of r to hold; D also grows towards bounds, so that steps turn away from them.

`polish` takes Newton steps, (J'J + C) d = -J'r. Near a minimum the cost is flat: points whose costs agree to rounding
can differ in the eighth digit of a value. The last digits are therefore sought where the residual is orthogonal to its
tangent plane (bates1981), which needs accurate derivatives and no comparison of costs. Steps are taken in units of the
tangent plane (`objective.tangent`), where J'J is the identity.

Both find the minimum downhill of a start, which need not be the lowest one: that is for `projection` to look for.
How many digits they reach on NIST's certified problems (nist1998) is in docs/solver-quality.md.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.differences import (
    EPS,
    FORWARD,
    Bound,
    Counted,
    Function,
    derivative_of,
    forward,
    replaced,
    sizes_of,
    within,
)
from gonio.fitting.objective.tangent import Tangent

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

Values = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]

SEARCHED = 1e-10  # relative change of cost or point that ends a search: Newton steps start well from there
ROUGH = 1e-3  # the same for a first search that only finds out which bounds hold values
ROUNDS = 6  # searches at most, each with those values held that press against their bound

SETTLED = 1e-11  # offset that is enough: it moves a value by 1e-11 sqrt(points) of its standard deviation
POLISHING = 20  # Newton steps at most; they end when one does not halve the offset
LOWER = 1e-12  # of the cost: by how much a step that does not halve the offset must lower it, in a curved valley
SAME = EPS**0.5  # by how much rounding may raise the relative cost of a better point; a jump elsewhere raises it more
CURVED = 2.0**-6  # of a standard deviation: the step that measures curvature, short of the next kink, above rounding
SADDLE = 0.01  # least eigenvalue of the second derivative, in units of the tangent plane, of what is still a minimum


@dataclass(frozen=True)
class LeastSquares:
    """A residual whose squared sum is to be made least, and what is known about it.

    residual: a function of a point (values,). lower, upper: bounds of the values, one for all or one each.
    scale: what a value must change by to matter where it is smaller itself; it sets the steps of differences.
    jacobian: the exact derivative (points, values), where there is one.
    curvature: at a point, what the second derivative of half the squared residual has (values, values) beside J'J,
        where that is known.
    vectorised: whether the residual also takes several points (n, values) at once.
    """

    residual: Function
    lower: Bound = -np.inf
    upper: Bound = np.inf
    scale: Bound = 0.0
    jacobian: Function | None = None
    curvature: Function | None = None
    vectorised: bool = False


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
    squares: LeastSquares,
    start: Values,
    *,
    tolerance: float = SEARCHED,
    max_steps: int = 2000,
    last_digits: bool = True,
) -> Descent:
    """The minimum of the squared residual within bounds that lies downhill of `start` (branch1999, by SciPy).

    tolerance: relative change of cost or point that ends the search. max_steps: points that it may try, not counting
    those of differences. last_digits: whether to `polish`, which can double the evaluations of a short search.

    A trust region stays strictly inside the bounds and creeps along them. Values that press against a bound are
    therefore held there, the others are searched, and both are looked at again, ROUNDS times at most. The first of
    these searches is rough, since it only finds out which values press.

    A start outside the bounds is moved to them. A search that runs out of steps raises nothing; `exhausted` says so.
    """
    counted = Counted(squares.residual, squares.vectorised)
    point, low, high = within(start, squares.lower, squares.upper)
    slopes = squares.jacobian or (lambda x: forward(counted, x, sizes_of(x, squares.scale), low, high))
    bounded = bool(np.isfinite([low, high]).any())
    held, reached, steps, exhausted = np.zeros(len(point), dtype=bool), np.inf, 0, False
    for _ in range(ROUNDS):
        value, tangent = counted(point), slopes(point)
        sizes, downhill = sizes_of(point, squares.scale), -(tangent.T @ value)
        # rounding of a forward difference: EPS |r| over a step of FORWARD sizes; four times that is no slope
        with np.errstate(all="ignore"):  # a slope that overflows is not flat
            flat = sizes**2 * np.sum(tangent**2, axis=0) <= (4 * FORWARD) ** 2 * _squared(value)
        pressed = ((point <= low) & (downhill <= 0)) | ((point >= high) & (downhill >= 0))
        if (pressed | flat).all() or not value.any() or (reached == tolerance and np.array_equal(pressed, held)):
            break
        held, reached = pressed, (ROUGH if bounded and not steps else tolerance)
        region = _Region(point, low, high, sizes, ~held)
        result = _trust_region(counted, slopes, region, reached, max_steps - steps)
        point = _edges(counted, result.x, _reach(result, sizes, ~held), low, high)
        steps, exhausted = steps + result.nfev, result.status == 0
        if exhausted or not bounded:
            break
    end = Descent(point, _squared(counted(point)), np.nan, exhausted, counted.evaluations)
    return polish(squares, end) if last_digits else end


class _State(NamedTuple):
    """A point of the Newton iteration: the residual there, its squared sum and its tangent plane of the free values."""

    point: Values
    value: Values
    cost: float
    slopes: Values
    plane: Tangent
    offset: float


def polish(squares: LeastSquares, end: Descent, settled: float = SETTLED) -> Descent:
    """The last digits of a minimum: Newton steps on the values that are at no bound, while each halves the offset.

    The offset is |U'r| / |r|, with U an orthonormal basis of the tangent plane. Rounding keeps it from zero, so that
    the steps end where they no longer halve it. settled: offset that is enough.

    Gauss-Newton steps, without the curvature, contract by the ratio of the residual to the radius of curvature of the
    model's surface, which a poor fit brings near one (bates1980). With the curvature, measured once, the first step
    already brings most digits; where it is known exactly, the first step, from farther off, goes without it.

    A point from which no step helps, or at which a derivative is no number, keeps its values.
    """
    newton = _Newton(squares, end.point)
    with np.errstate(all="ignore"):  # a step out of the model's domain gives no number, and is refused
        now = newton.state(newton.start, end.cost)
        if now is None:
            return end
        model: tuple[Values, Values] | None = None
        for step in range(POLISHING):
            if not now.offset > settled:
                break
            model = model or newton.model(now, first=step == 0)
            tried = newton.step(now, *model)
            if tried is None:
                break
            lower_still = squares.curvature is not None and tried.cost < now.cost * (1 - LOWER)
            if not (tried.offset < now.offset / 2 or lower_still):
                break
            still_holds = tried.offset < now.offset / 10  # else the curvature was that of too far a point
            model, now = model if still_holds else None, tried
    exhausted = end.exhausted and not now.offset < SEARCHED**0.5  # the offset of a search that ends by itself
    return Descent(now.point, now.cost, now.offset, exhausted, end.evaluations + newton.counted.evaluations)


class _Newton:
    """Newton steps on the values that are at no bound where the iteration starts.

    The others stay where they are: a minimum at a bound has a slope there, which no step within the bounds removes.
    """

    def __init__(self, squares: LeastSquares, start: Values) -> None:
        self.squares = squares
        self.counted = Counted(squares.residual, squares.vectorised)
        self.start, self._low, self._high = within(start, squares.lower, squares.upper)
        self._free = (self._low < self.start) & (self.start < self._high)

    def state(self, point: Values, cost: float | None = None) -> _State | None:
        """What is known at a point; None where a derivative is no number there."""
        value = self.counted(point)
        slopes = self._slopes(point)
        if not np.isfinite(slopes).all():
            return None
        plane = Tangent(slopes)
        return _State(point, value, _squared(value) if cost is None else cost, slopes, plane, plane.offset(value))

    def _slopes(self, point: Values) -> Values:
        """The accurate derivative (points, free values): exact where there is one, else by extrapolated differences."""
        if self.squares.jacobian:
            return self.squares.jacobian(point)[:, self._free]
        return derivative_of(self.counted, point, self._low, self._high, self.squares.scale)[:, self._free]

    def model(self, now: _State, first: bool) -> tuple[Values, Values]:
        """Directions (values, rank) of the tangent plane, and the second derivative (rank, rank) along them."""
        directions = np.zeros((len(now.point), now.plane.directions.shape[1]))
        directions[self._free] = now.plane.directions
        if self.squares.curvature is None:
            return directions, _hessian(self.counted, now, directions, self._low, self._high)
        curvature = directions.T @ self.squares.curvature(now.point) @ directions
        return directions, _sound(0 * curvature if first else curvature)

    def step(self, now: _State, directions: Values, hessian: Values) -> _State | None:
        """The state after a Newton step; None where that leaves the bounds or raises the cost."""
        gradient = (now.slopes @ directions[self._free]).T @ now.value
        trial = now.point - directions @ np.linalg.solve(hessian, gradient)
        if not np.all((self._low <= trial) & (trial <= self._high)):
            return None
        cost = _squared(self.counted(trial))
        return self.state(trial, cost) if cost <= now.cost * (1 + SAME) else None


def _squared(value: Values) -> float:
    return float(value @ value)


class _Region(NamedTuple):
    """Where a trust region searches: from a point, within bounds, over the free values, in units of their sizes."""

    point: Values
    lower: Values
    upper: Values
    sizes: Values
    free: Mask


def _trust_region(
    residual: Function, jacobian: Function, region: _Region, tolerance: float, max_steps: int
) -> "OptimizeResult":
    """SciPy's search over the free values, in units of their sizes and of the residual's length at the start.

    So no unit decides when SciPy's absolute tolerance of the gradient ends it. `x` of the result holds all values.
    """
    from scipy.optimize import least_squares  # late: half a second that who only looks does not need

    point, free = region.point, region.free
    units = region.sizes[free]
    length = _squared(residual(point)) ** 0.5 or 1.0  # an exact fit leaves nothing to divide by

    def all_values(scaled: Values) -> Values:
        """The point with its free values moved; a bound divided by its unit and multiplied again may round past it."""
        return np.clip(replaced(point, free, scaled * units), region.lower, region.upper)

    with np.errstate(all="ignore"):  # a trial point may overflow: the search then shortens its step
        result = least_squares(
            lambda scaled: residual(all_values(scaled)) / length,
            point[free] / units,
            jac=lambda scaled: jacobian(all_values(scaled))[:, free] * (units / length),
            bounds=(region.lower[free] / units, region.upper[free] / units),
            x_scale="jac",
            xtol=tolerance,
            ftol=tolerance,
            gtol=EPS,
            max_nfev=max(max_steps, 1),  # SciPy refuses zero
        )
    result.x = all_values(result.x)
    return result


def _reach(result: "OptimizeResult", sizes: Values, free: Mask) -> Values:
    """The change of each value that would move the residual by its own length; zero for a value that is held.

    SciPy's cost is half the squared residual. A value without slope reaches everywhere, at infinity.
    """
    with np.errstate(divide="ignore", over="ignore"):
        steps = sizes[free] * np.sqrt(2 * result.cost / np.sum(result.jac**2, axis=0))
        return replaced(np.zeros(len(free)), free, steps)


def _edges(residual: Function, point: Values, reach: Values, lower: Values, upper: Values) -> Values:
    """The search stays strictly inside: a bound itself may be better, and is tried where it is within reach.

    The bound is also taken where the cost is the same but for the rounding of its sum, so that a minimum at a bound is
    met exactly.
    """
    value = residual(point)
    cost, rounding = _squared(value), EPS * len(value)
    for k in range(len(point)):
        for edge in (lower[k], upper[k]):
            if np.isfinite(edge) and 0 < abs(point[k] - edge) < reach[k]:
                at_edge = replaced(point, k, edge)
                if (edge_cost := _squared(residual(at_edge))) <= cost * (1 + rounding):
                    point, cost = at_edge, edge_cost
    return point


def _hessian(residual: Counted, now: _State, directions: Values, lower: Values, upper: Values) -> Values:
    """Second derivative (rank, rank) of half the squared residual: one in the tangent plane, plus the curvature.

    The curvature r . (r(x + d) - 2 r(x) + r(x - d))/h^2 is measured by differences over a fraction of a standard
    deviation; the result is without it where it would say that this is no minimum. Measured are the directions a of the
    plane and the sums of two, since c(a + b) = c(a) + c(b) + 2 c(a, b).
    """
    point, value, n = now.point, now.value, directions.shape[1]
    # no shift moves a value by more than step * reach: half of its room keeps it within the bounds
    reach = np.abs(directions).sum(axis=1)
    room = np.minimum(point - lower, upper - point)[reach > 0] / reach[reach > 0]
    step = min(CURVED * float(np.linalg.norm(value)) / len(value) ** 0.5, float(room.min(initial=np.inf)) / 2)
    a, b = np.tril_indices(n, -1)
    shifts = step * np.concatenate([directions.T, (directions[:, a] + directions[:, b]).T])
    ahead, behind = np.split(residual.each(np.concatenate([point + shifts, point - shifts])), 2)
    # differences of near numbers are exact, and small; ahead + behind would round at the size of the values
    along = ((ahead - value) + (behind - value)) @ value / step**2
    curvature = np.diag(along[:n])
    curvature[a, b] = curvature[b, a] = (along[n:] - along[a] - along[b]) / 2
    return _sound(curvature)


def _sound(curvature: Values) -> Values:
    """One plus the curvature, or one alone where that would be no minimum: then a Gauss-Newton step is taken."""
    hessian = np.eye(len(curvature)) + curvature
    sound = np.isfinite(hessian).all() and np.linalg.eigvalsh(hessian).min(initial=np.inf) > SADDLE
    return hessian if sound else np.eye(len(curvature))
