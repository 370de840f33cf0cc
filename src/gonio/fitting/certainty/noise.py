"""The noise of a scan, read from the residuals of a fit: how much of it is constant, and how much in proportion.

The variance of a residual is g (a + b f^2), with f the modelled BRDF and g the weight of the point: a for noise that is
constant, b for noise in proportion to the value. So neither a peak nor a tail looks wrong only because its noise
differs. a and b are those of the largest likelihood under Student's t (lange1989). The residuals are those about a
robust fit in the tangent plane: one derivative serves all its rounds, as far as the model is linear that near.
"""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.cells.linear import Linear, plane_of, scaled
from gonio.fitting.objective.loss import LOSSES
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.tangent import ALONE
from gonio.fitting.search.reweighting import scatter

Values = npt.NDArray[np.float64]

EXACT = 1e-5  # of a value: the least noise that a file of six digits can show
LEAST = 1e-200  # a variance whose reciprocal can be squared: residuals may all be zero, or next to it
FREEDOM = 4.0  # degrees of freedom of the t distribution that stands for noise with outliers
ROBUST_ROUNDS = 20  # fits in the tangent plane
NOISE_ROUNDS = 20  # reweightings; each goes at least a third of the remaining way
TRIMMED = 2.5  # standard deviations: where the far tails begin
TRIMMED_VARIANCE = 0.9113  # of what the trimming leaves of a standard normal number


class Kinds(NamedTuple):
    """Variance of every residual (points, 2) by noise that is constant and by noise in proportion, of one size.

    top: the largest modelled BRDF, at which both kinds are of that size, so that their amounts are numbers of like
    size. logarithmic: whether the residual compares logarithms.
    """

    variances: Values
    top: float
    logarithmic: bool

    @classmethod
    def of(cls, problem: Problem, modelled: Values) -> "Kinds":
        """Those of a problem whose BRDF is `modelled` (points,)."""
        kinds = cls(np.empty(0), float(np.maximum(modelled, 0.0).max()) or 1.0, problem.logarithmic)
        return kinds._replace(variances=kinds.at(problem.root_weights, modelled, problem.measured))

    def at(self, root_weights: Values, modelled: Values, measured: Values) -> Values:
        """The same (m, 2) at other points, from their root weights, modelled and measured BRDF (m,)."""
        modelled = np.maximum(modelled, 0.0)  # a model that is negative there has no noise in proportion
        per_brdf = root_weights
        if self.logarithmic:  # d ln f = df / f, which must not divide by a modelled zero
            per_brdf = per_brdf / np.maximum(modelled, EXACT * measured)
        out: Values = per_brdf[:, None] ** 2 * (modelled[:, None] / self.top) ** [0, 2]
        return out


class Noise(NamedTuple):
    """The scatter of residuals about a robust fit in the tangent plane.

    moved (n,): the values of that fit less those of the fit itself. amounts (2,): how much of each of the Kinds there
    is. least: what a variance is at least, over the sum of its kinds. size: of residuals over the root of that
    variance. leverage (points,): of every point.
    """

    moved: Values
    amounts: Values
    least: float
    size: float
    kinds: Kinds
    leverage: Values

    def deviation(self, kinds: Values) -> Values:
        """The standard deviation of residuals (m,) with these Kinds of variances (m, 2), up to `size`."""
        return np.sqrt(_variance(kinds, self.amounts, self.least))

    def studentised(self, residual: Values, slopes: Linear) -> Values:
        """Residuals (points,) over their scatter, zero for a point that one value fits exactly, which tells nothing."""
        remaining, alone = residual - slopes @ self.moved, self.leverage > ALONE
        deviation = self.deviation(self.kinds.variances) * np.sqrt(np.where(alone, 1.0, 1 - self.leverage))
        out: Values = np.where(alone, 0.0, remaining / deviation / self.size)
        return out


def estimated(residual: Values, free: int, slopes: Linear, kinds: Kinds) -> Noise:
    """The noise of residuals (points,) with derivatives `slopes` by `free` values, by a fit under Cauchy's loss.

    Each round finds the amounts of noise from the residuals that remain, weighs every point by its own variance and by
    how little it is an outlier, and fits again (`search.reweighting` has the reason).
    """
    remaining, trust = residual, np.ones_like(residual)
    for _ in range(ROBUST_ROUNDS):
        amounts, least = _amounts(remaining, kinds.variances)
        deviation = np.sqrt(_variance(kinds.variances, amounts, least))
        root = np.sqrt(trust) / deviation
        plane = plane_of(scaled(slopes, root))
        moved = plane.moved(root * residual)
        remaining = residual - slopes @ moved
        size = _spread(remaining / deviation, free)
        trust = LOSSES["cauchy"].weight(remaining / deviation / size)
    return Noise(moved, amounts, least, size, kinds, plane.leverage(len(residual)))


def _amounts(residual: Values, kinds: Values) -> tuple[Values, float]:
    """How much of each kind of noise makes the residuals likeliest, and the least variance over the sum of its kinds.

    The likelihood is that of Student's t, by reweighting (lange1989): outliers do not move it far. With u^2 the squared
    residual over the variance so far, and n = FREEDOM, the new variance is fitted to (n + 1)/(n + u^2) u^2 times the
    old one, by amounts that are not negative (NNLS). The least variance keeps an exact fit from dividing by zero.
    """
    from scipy.optimize import nnls  # late: half a second that who only looks does not need

    counted = kinds[:, 0] > 0  # a point without weight has no residual either
    squared, shares = residual[counted] ** 2, kinds[counted]
    both = shares.sum(axis=1)
    least = float(EXACT**2 * np.max(squared / both) + LEAST)
    variance = np.maximum(both * np.median(squared / both), both * least)
    for _ in range(NOISE_ROUNDS):
        likely = (FREEDOM + 1) / (FREEDOM + squared / variance) * squared / variance
        amounts = nnls(shares / variance[:, None], likely)[0]
        variance = np.maximum(shares @ amounts, both * least)
    return amounts, least


def _variance(kinds: Values, amounts: Values, least: float) -> Values:
    """Variance of every residual (points,) up to a factor, one for a point without weight."""
    out, counted = np.ones(len(kinds)), kinds[:, 0] > 0
    shares = kinds[counted]
    out[counted] = np.maximum(shares @ amounts, shares.sum(axis=1) * least)
    return out


def _spread(residual: Values, free: int) -> float:
    """Standard deviation of a normal residual from all but its far tails: less uncertain than its median size.

    The median is where it starts, since which residuals are in the tails depends on the deviation itself.
    """
    size = scatter(residual, free)
    for _ in range(NOISE_ROUNDS):
        trimmed = residual[np.abs(residual) < TRIMMED * size]
        size = float(np.sqrt(np.sum(trimmed**2) / max(len(trimmed) - free, 1) / TRIMMED_VARIANCE))
    return size or 1.0  # residuals that are all zero, which any size leaves so
