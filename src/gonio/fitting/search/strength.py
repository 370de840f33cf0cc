"""How strongly parameters are held smooth, where a problem leaves that open: so that points are predicted best.

For one strength, the error of each point in a fit without it is r_k / (1 - h_k) to first order, with the residual r_k
of the fit with it and its leverage h_k. The strength is chosen that makes their squared sum least, the PRESS statistic
(allen1974). This is leave-one-out cross-validation at the cost of one fit for each strength that is tried.

`objective.smooth` says what a strength does to E, and docs/spectral-fits.md how near to the best strength this comes.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.cells.linear import linearised, plane_of
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.smooth import AUTO, Smooth
from gonio.fitting.objective.tangent import ALONE
from gonio.fitting.search.groups import carried, common
from gonio.fitting.search.projection import Projection
from gonio.fitting.search.refit import refit

Values = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
STRONGEST, WEAKEST = 2, -13  # decimal exponents: a straight line, and values as good as free in any measurement
FINE = 0.05  # of a decade: a strength half a decade off changes little


def resolved(problem: Problem) -> Problem:
    """The problem with the strength and the scale of every smooth parameter as numbers.

    The scale is the value of a shape parameter in the fit with one value for all groups, and the root mean square of a
    weight there. The strength is the one whose fits predict best each point from all others (allen1974; in the tangent
    plane, without fitting again): first one for all parameters whose strength is `auto`, then each one's own. Unlike
    generalised cross-validation (craven1978) this does not need the same noise at all points. Like it, it takes the
    errors of different points as independent: an error that all points of a wavelength share is not smoothed away.
    Raises ValueError where a parameter is zero in that fit, and so has no scale.
    """
    if all(smooth.is_resolved for smooth in problem.smoothed.values()):
        return problem
    ungrouped = common(problem)
    vector = carried(Projection().search(ungrouped).vector, ungrouped, problem)
    scaled = replace(problem, smooth=_scaled(problem, vector))
    open_names = [name for name, smooth in scaled.smoothed.items() if smooth.strength == AUTO]
    if not open_names:
        return scaled
    best = _fitted(scaled, open_names, STRONGEST, vector)
    # a point that a value fits alone even under the strongest smoothing is predicted by no other, at any strength
    predicted = _leverage(best.problem, best.vector) < ALONE
    best = _least(best, open_names, predicted)
    for name in open_names if len(open_names) > 1 else ():
        best = _least(best, [name], predicted)
    return best.problem


def effective_values(problem: Problem, vector: Values) -> float:
    """How many free values a fit has the use of: the trace of the matrix that turns measured into modelled values.

    That is the number of free values where nothing is smooth (hastie1990). The matrix is
    that of the tangent plane at the vector (n,); on its diagonal are the leverages of the points.
    """
    return float(np.sum(_leverage(problem, vector))) if len(problem.penalty) else float(len(vector))


def _leverage(problem: Problem, vector: Values) -> Values:
    """By how much each point pulls its own modelled value, 0 to 1 (points,).

    The plane has the rows of the penalty too, which take part of the pull from the points.
    """
    return plane_of(linearised(problem, vector, accurate=False)).leverage(len(problem.measured))


class _Fit(NamedTuple):
    """A problem with its optimum: what is known of one strength."""

    problem: Problem
    vector: Values

    def left_out(self, predicted: Mask) -> float:
        """Sum of the squared errors of predicting each point from all others, over the points that others predict.

        Infinite where so weak a smoothing leaves a value that fits one of these points alone.
        """
        free = 1 - _leverage(self.problem, self.vector)[predicted]
        error = self.problem.difference(self.problem.brdf(self.vector))[predicted]
        return float(np.sum((error / free) ** 2)) if free.min(initial=1.0) > 1 - ALONE else math.inf


def _fitted(problem: Problem, names: Sequence[str], exponent: float, near: Values) -> _Fit:
    """The fit with some parameters held smooth by 10^exponent, from values that are near."""
    changed = {
        name: smooth._replace(strength=float(10.0**exponent))
        for name, smooth in problem.smoothed.items()
        if name in names
    }
    tried = replace(problem, smooth=problem.smoothed | changed)
    return _Fit(tried, refit(tried, near).point)


def _least(fit: _Fit, names: Sequence[str], predicted: Mask) -> _Fit:
    """The best strength for some parameters: from the straight line down by decades, then between two of these.

    Each fit starts from that of the next stronger smoothing, which is near. The sum of errors may have several minima
    over the strength: decades find the lowest, Brent's bounded search only its exact place.
    """
    from scipy.optimize import minimize_scalar  # late: half a second that who only looks does not need

    path = [_fitted(fit.problem, names, STRONGEST, fit.vector)]
    for exponent in range(STRONGEST - 1, WEAKEST - 1, -1):
        path.append(_fitted(fit.problem, names, exponent, path[-1].vector))
    scores = [tried.left_out(predicted) for tried in path]
    best = path[int(np.argmin(scores))]
    middle = STRONGEST - int(np.argmin(scores))
    optimum = minimize_scalar(
        lambda exponent: _fitted(fit.problem, names, exponent, best.vector).left_out(predicted),
        bounds=(max(middle - 1, WEAKEST), min(middle + 1, STRONGEST)),
        method="bounded",
        options={"xatol": FINE},
    )
    return _fitted(fit.problem, names, optimum.x, best.vector) if optimum.fun < min(scores) else best


def _scaled(problem: Problem, vector: Values) -> dict[str, Smooth]:
    """What is smooth, with its scale from the values (n,) of the fit with one value for all groups.

    A scale makes the strength a number without unit. A scale that is stated stays.
    """
    out, start = {}, 0
    for entry in problem.free:
        values = vector[start : start + entry.size]
        start += entry.size
        if not (smooth := problem.smoothed.get(entry.name)):
            continue
        scale = smooth.scale if math.isfinite(smooth.scale) else float(np.sqrt(np.mean(values**2)))
        if not scale > 0:
            raise ValueError(f"{entry.name} is zero in the fit without smoothing, so it has no scale: do not smooth it")
        out[entry.name] = smooth._replace(scale=scale)
    return out
