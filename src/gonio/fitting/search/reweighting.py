"""Fits under a robust loss: squared errors, weighted anew from the residuals of the last fit until nothing moves.

A robust loss rho(u) of residuals u in units of their scatter has its minimum where that of sum w_k u_k^2 is, if each
point has the weight w_k = rho'(u_k)/u_k. Weights and fit are computed in turn until they agree: iteratively reweighted
least squares (holland1977). So every step is a fit of squared errors like any other, and any solver will
do. The scatter is found anew with the weights, from the median residual. `objective.loss` has the losses.
"""

from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.loss import LOSSES
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.descent import SEARCHED
from gonio.fitting.search.refit import refit
from gonio.fitting.search.solver import Optimum, Solver

Values = npt.NDArray[np.float64]

NORMAL_MEDIAN = 0.6745  # median size of a standard normal number
STILL = 1e-4  # of the scale: when no residual moves by more, the weights have settled
ROUNDS = 100  # fits at most; a tenth of that is usual
LOWER_LOSS = 1e-6  # of the loss: by how much the minimum of a second search must be lower


@dataclass(frozen=True)
class Settled:
    """A minimum under a loss.

    vector (n,): the values there. problem: with the weights that the loss gives its points. scale: the scatter of the
    residuals before these weights, NaN for squared errors. slope (points,): rho''(u)/w(u), the derivative of weight
    times residual over the weight, 1 for squared errors; the covariance needs it. exhausted: whether the weights had
    not settled after ROUNDS fits.
    """

    vector: Values
    problem: Problem
    scale: float
    slope: Values
    exhausted: bool


def as_found(problem: Problem, vector: Values, exhausted: bool = False) -> Settled:
    """A minimum of squared errors as one under a loss: nothing is weighted anew."""
    return Settled(vector, problem, np.nan, np.ones_like(problem.measured), exhausted)


def scatter(residual: Values, free: int) -> float:
    """Standard deviation of a normal residual (points,) from its median size, which outliers hardly move.

    The smallest residuals, as many as there are `free` values, are left out: a fit can bring as many to zero, whatever
    the noise is. Zero where all residuals are.
    """
    size = np.sort(np.abs(residual))
    return float(np.median(size[min(free, len(size) - 1) :])) / NORMAL_MEDIAN


def reweighted(problem: Problem, solver: Solver, start: Optimum) -> tuple[Optimum, Settled]:
    """The optimum under the robust loss of a problem, from the optimum of its squared errors.

    A search of squared errors may end in a minimum that outliers made: it is repeated with the weights that settled,
    and the lower of both is kept. Both losses are of residuals in units of the first one's scatter: losses in
    units of different scatters could not be compared.
    """
    settled = settle(problem, start.vector)
    again = solver.search(settled.problem)
    other = settle(problem, again.vector)
    if _total(problem, other.vector, settled.scale) < _total(problem, settled.vector, settled.scale) * (1 - LOWER_LOSS):
        settled = other
    cost = float(problem.cost(problem.residual(settled.vector)))
    evaluations = start.evaluations + again.evaluations
    return Optimum(settled.vector, cost, settled.exhausted, evaluations, start.history), settled


def settle(problem: Problem, start: Values, tolerance: float = SEARCHED, max_steps: int = 2000) -> Settled:
    """The minimum downhill of a vector (n,) of weights and shape under the loss of the problem, as `refit` finds it.

    tolerance, max_steps: of each fit. The first is of squared errors, which needs no scatter.
    """
    vector = refit(problem, start, tolerance, max_steps).point
    if problem.loss == "squared":
        return as_found(problem, vector)
    loss = LOSSES[problem.loss]
    own_weights = 1.0 if problem.point_weights is None else problem.point_weights
    residual = _of_points(problem, vector)
    for _ in range(ROUNDS):
        # an exact fit has no scatter: rounding of the largest value stands for it, so that nothing divides by zero
        scale = max(scatter(residual, len(vector)), np.finfo(float).eps * float(np.abs(problem.target).max()))
        weights = loss.weight(residual / scale)
        vector = refit(problem, vector, tolerance, max_steps, factors=np.sqrt(weights)).point
        before, residual = residual, _of_points(problem, vector)
        if still := bool(np.abs(residual - before).max() <= STILL * scale):
            break
    return Settled(
        vector,
        replace(problem, point_weights=own_weights * weights),
        scale,
        loss.slope(residual / scale),
        exhausted=not still,
    )


def _of_points(problem: Problem, vector: Values) -> Values:
    """The residual (points,) without the rows of a penalty, to which no loss applies."""
    return problem.difference(problem.brdf(vector))


def _total(problem: Problem, vector: Values, scale: float) -> float:
    """The loss of all points and the penalty at a vector, with residuals in units of `scale`."""
    penalty = problem.penalty @ vector / scale
    return float(np.sum(LOSSES[problem.loss].cost(_of_points(problem, vector) / scale)) + penalty @ penalty / 2)
