"""How much worse the best fit becomes as one value moves: intervals for values that are bounded or skewed.

The profile likelihood (venzon1988) holds one value x at a place, fits all others anew, and compares costs. With S the
least squared residual at that place, S0 that of the best fit x0, and s^2 the variance that scales them,

    t(x) = sign(x - x0) sqrt((S(x) - S0) / s^2)

is the rise, bates1988's profile t. The interval ends where |t| is the coverage factor. For a linear model t is a
straight line, (x - x0) over the standard uncertainty, and the interval is the symmetric one. Where t bends, the
interval is skewed; where it stays below the factor as far as a bound, the interval is open to that side.

Each place costs a fit, so that profiles are computed on demand.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gonio.fitting.certainty.covariance import estimator, tangent
from gonio.fitting.objective.differences import SMALLEST
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.tangent import Tangent
from gonio.fitting.search.refit import refit
from gonio.fitting.solution import Solution
from gonio.units import unit_label

Values = npt.NDArray[np.float64]

STEP = 0.25  # of the coverage factor: by how much the rise should grow from one fit to the next
GUESS = 0.1  # of a value whose standard uncertainty is infinite
ROUNDING = 1e-20  # of the mean squared measurement: a variance of residuals that is arithmetic alone
FARTHEST = 60  # fits on one side at most; steps that gain little double, so that this reaches any scale
ANOTHER = 1e-3  # squared rise below zero, from which another minimum is better and no rounding


@dataclass(frozen=True)
class Profile:
    """The rise of the cost along one value, and the values within the level.

    at, rise: the curve: values in ascending order, and how many standard uncertainties each is from the best one
    (bates1988's profile t), negative below it. value: the best one. level, factor: the probability of the interval, and
    the rise at its ends. lower, upper: the interval, which ends at a bound of the value or at infinity where the data
    exclude nothing on that side: then `open_below`, `open_above`.
    """

    name: str
    unit: str
    value: float
    level: float
    factor: float
    at: Values
    rise: Values
    lower: float
    upper: float
    open_below: bool
    open_above: bool

    @property
    def words(self) -> str:
        """What the data allow, as the end of a sentence: `from 30 deg upwards`."""
        unit = f" {unit_label(self.unit)}".rstrip()
        if self.open_below and self.open_above:
            return "at any value"
        if self.open_above:
            return f"from {self.lower:.3g}{unit} upwards"
        if self.open_below:
            return f"up to {self.upper:.3g}{unit}"
        return f"from {between(self.lower, self.upper, ' to ')}{unit}"


def between(low: float, high: float, mark: str = " .. ") -> str:
    """Both ends of an interval to three significant digits of its width; a whole number has all its digits."""
    width = high - low
    if not (math.isfinite(width) and width > 0):
        return f"{low:.4g}{mark}{high:.4g}"
    digits = max(2 - math.floor(math.log10(width)), 0)
    form = ".4e" if digits > 7 or max(abs(low), abs(high)) >= 1e7 else f".{digits}f"
    return f"{low:{form}}{mark}{high:{form}}"


def profile(problem: Problem, solution: Solution, name: str, level: float = 0.95) -> Profile:
    """The profile likelihood of one free value (venzon1988): how much worse the fit becomes where it is held elsewhere.

    The rise is measured in the solution's own kind of covariance: scaled so that it grows near the minimum as that
    standard uncertainty says (royall2003), as residuals scatter where that is infinite. For a linear model the
    interval is the one of `Solution.intervals`.

    Parameters
    ----------
    problem : Problem
        What was fitted.
    solution : Solution
        Its fit.
    name : str
        The value, `ks[30]` for one of a group.
    level : float
        The probability of the interval, between 0 and 1.

    Returns
    -------
    Profile
        The curve `at`, `rise`, and the interval `lower`, `upper`.

    Raises
    ------
    ValueError
        The name is not free, the loss is robust, the fit leaves no scatter, or the profile meets a better fit than the
        solution.

    """
    line = _Minimum(problem, solution).line(name)
    factor = solution.coverage_factor(level)  # of Student's t, or of the normal distribution for `absolute`
    below, (lower, open_below) = line.side(-1, factor)
    above, (upper, open_above) = line.side(1, factor)
    curve = dict(sorted([*below, (line.value, 0.0), *above]))  # by value; places that were met twice count once
    at, rise = np.array(list(curve)), np.array(list(curve.values()))
    unit = str(solution.dataset["unit"].sel(parameter=name).item())
    return Profile(name, unit, line.value, level, factor, at, rise, lower, upper, open_below, open_above)


def rises(problem: Problem, solution: Solution, at: Mapping[str, float]) -> dict[str, float]:
    """How many standard uncertainties the best fit is worse than the best of all, with each value in turn held `at`.

    Raises ValueError as `profile` does.
    """
    minimum = _Minimum(problem, solution)
    return {name: minimum.line(name).rise(minimum.best.point, held)[1] for name, held in at.items()}


def refuse_unfit(problem: Problem) -> None:
    """ValueError for a loss of which no profile is taken."""
    if problem.loss != "squared":
        raise ValueError(f"a profile is of squared errors, and this is a {problem.loss} loss: leave out one of them")


class _Minimum:
    """The best fit, and the rise of the squared residual that one standard uncertainty of each value is worth there.

    scale (n,): the variance s^2 by which rises are divided. Let d_k be the standard uncertainty of value k where
    residuals have unit variance, the root of a diagonal element of (J'J)^-1. S rises by (x - x0)^2/d_k^2 near the
    minimum, so that scale = (standard uncertainty/d_k)^2 makes t = 1 at one standard uncertainty, whatever the kind of
    covariance (royall2003). sigma (n,): the standard uncertainties, or a guess where they are infinite.
    """

    def __init__(self, problem: Problem, solution: Solution) -> None:
        refuse_unfit(problem)
        self.problem = problem = solution.as_fitted(problem)
        # costs along a line are those of `refit`, and so is the cost that they are compared with
        self.best = refit(problem, solution.vector(problem.names))
        plane, residual = tangent(problem, self.best.point), problem.difference(problem.brdf(self.best.point))
        estimate = estimator(problem, solution.covariance_kind)
        variance = np.diag(estimate(plane, residual))
        known = np.isfinite(variance) & (variance > 0)
        unscaled = plane.unit_variances()
        # for a value that is not determined: the variance of one residual, from that of their mean, which every kind of
        # covariance gives: the mean is the value of a problem whose derivative is one at every point
        plane_of_mean = Tangent(np.ones((len(residual), 1)))
        noise = float(estimate(plane_of_mean, residual)[0, 0]) * len(residual)
        self.scale = np.where(known, variance / np.where(known, unscaled, 1.0), noise)
        self.sigma = np.where(known, np.sqrt(variance), GUESS * np.maximum(np.abs(self.best.point), SMALLEST))

    def line(self, name: str) -> "_Line":
        """The profile of one value; ValueError for a name that is not free, or where no scatter is left."""
        if name not in self.problem.names:
            raise ValueError(f"{name!r} is no free value of this fit: choose one of {', '.join(self.problem.names)}")
        place = self.problem.names.index(name)
        if not self.scale[place] > ROUNDING * self.problem.scale / len(self.problem.measured):
            raise ValueError(f"no scatter is left about the fit that would say how far {name} may move")
        return _Line(self, place)


class _Line:
    """The best fits along one value, each found from the one before."""

    def __init__(self, minimum: _Minimum, place: int) -> None:
        self.problem, self.best, self.place = minimum.problem, minimum.best, place
        self.value = float(self.best.point[place])
        self.scale, self.sigma = float(minimum.scale[place]), float(minimum.sigma[place])

    def side(self, sign: int, factor: float) -> tuple[list[tuple[float, float]], tuple[float, bool]]:
        """The curve to one side, and the end of the interval there with whether it is open.

        Steps outwards from the best value until the rise passes the factor or the value meets its bound. The last fit
        is the start of the next, since it is nearer than the best one.
        """
        bound = float((self.problem.lower if sign < 0 else self.problem.upper)[self.place])
        step, near, curve = STEP * factor * self.sigma, self.best.point, [(self.value, 0.0)]
        if self.value == bound:
            return [], (bound, True)
        for _ in range(FARTHEST):
            at = max(curve[-1][0] - step, bound) if sign < 0 else min(curve[-1][0] + step, bound)
            last, (near, rise) = near, self.rise(near, at)
            curve.append((at, sign * rise))
            if rise > factor:
                end = self._crossing(last, curve[-2][0], at, factor)
                return [*curve[1:], (end, sign * factor)], (end, False)
            if at == bound:
                return curve[1:], (bound, True)
            if abs(curve[-1][1] - curve[-2][1]) < STEP * factor / 2:  # flatter than the standard uncertainty says
                step *= 2
        return curve[1:], (sign * math.inf, True)

    def rise(self, near: Values, at: float) -> tuple[Values, float]:
        """The best fit with the value held at `at`, from a vector that is near, and the root of the rise of its cost.

        Raises ValueError where that fit is better than the best one by more than rounding: the solution is then not
        the minimum, and an interval about it would be wrong.
        """
        start = near.copy()
        start[self.place] = at
        end = refit(self.problem, start, held=self.place)
        squared = (end.cost - self.best.cost) / self.scale
        if squared < -ANOTHER:
            name = self.problem.names[self.place]
            raise ValueError(
                f"the profile of {name} met a better fit at {name} = {at:g} than the solution: "
                "fit again with more searches (projection: --setting searches=16) and profile that"
            )
        return end.point, math.sqrt(max(squared, 0.0))

    def _crossing(self, near: Values, inside: float, outside: float, factor: float) -> float:
        """The value at which the rise is the factor, between two places, by Brent's method."""
        from scipy.optimize import brentq  # late: half a second that who only looks does not need

        return float(brentq(lambda at: self.rise(near, at)[1] - factor, inside, outside, rtol=1e-6))
