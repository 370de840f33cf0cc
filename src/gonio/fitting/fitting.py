"""Fitting: a problem and a solver in, a Solution out.

The objective is the relative weighted squared error of the model f against the measured BRDF m (guo2023, eq 11),

    E = sum_k g_k (f_k - m_k)^2 / sum_k g_k m_k^2,    g = g1(theta_i) g2(theta_r),

to which a problem with smooth parameters adds a penalty (`objective.smooth`). `fit` calls the parts in their order:

    1. the strengths and scales of smooth parameters that the problem leaves open (`search.strength`),
    2. the search for the least E by the solver, variable projection unless another is given (`search.projection`),
    3. for a robust loss, the same with points weighted anew until the weights settle (`search.reweighting`),
    4. the covariance and the systematic shifts of the values at the minimum (`certainty.covariance`),
    5. the status, and the Dataset of it all (`schema`).

Nothing is searched or estimated in this file itself. Fits of many scans at once are in `many`.
"""

import logging
import math
import time
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from gonio.fitting.certainty.covariance import covariance as covariance_of
from gonio.fitting.certainty.covariance import estimator, systematic_shifts
from gonio.fitting.covariance_kinds import DEFAULT
from gonio.fitting.objective.cells.memory import refuse_too_large
from gonio.fitting.objective.problem import Problem
from gonio.fitting.schema import Parameters, assembled, problem_attributes
from gonio.fitting.search.projection import Projection
from gonio.fitting.search.reweighting import Settled, as_found, reweighted
from gonio.fitting.search.solver import Optimum, Progress, Solver, silent
from gonio.fitting.search.strength import effective_values, resolved
from gonio.fitting.solution import Solution
from gonio.fitting.status import Status
from gonio.measured.causes import CAUSE
from gonio.measured.polarimetry.ratio import whole

Values = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
NEARLY = 1e-3  # of E: searches that end so near to one another have met the same minimum, its last digits not sought


def fit(
    problem: Problem, solver: Solver | None = None, progress: Progress = silent, covariance: str = DEFAULT
) -> Solution:
    """Find the values of least E (guo2023, eq 11) and their uncertainties.

    solver: `Projection()` unless another is given. progress: called with the fraction of the search that is done.
    covariance: `robust` and `scaled` estimate the noise from the residuals, `absolute` uses the standard uncertainty
    that the scan states (`certainty.covariance`).
    A search that does not end at a good minimum raises nothing: the status of the Solution says what is wrong. Its cost
    is E of the data, without the penalty of smooth parameters and without the weights of a robust loss.
    Raises ValueError for a covariance that does not exist, for `absolute` where the scan states no uncertainty, for
    another one than `robust` under a robust loss, where a smooth parameter has no scale (`search.strength`), and where
    there is not enough memory.
    """
    solver = solver or Projection()
    # both only for what they refuse, before the search takes its time
    estimator(problem, covariance)
    refuse_too_large(problem)
    started = time.perf_counter()
    problem = resolved(problem)
    optimum = solver.search(problem, progress)
    settled = as_found(problem, optimum.vector, optimum.exhausted)
    if problem.loss != "squared":
        optimum, settled = reweighted(problem, solver, optimum)
    # Of the settled problem, whose point weights are those of the loss: the minimum is one of squared errors with them.
    spread = covariance_of(settled.problem, optimum.vector, covariance, settled.slope)
    pinned = _at_bound(optimum.vector, problem.lower) | _at_bound(optimum.vector, problem.upper)
    parameters = Parameters.of(problem)
    shifts = systematic_shifts(settled.problem, optimum.vector, pinned)
    columns = {
        "value": parameters.values(optimum.vector),
        "at_bound": parameters.spread(pinned, False),
        "held": ~parameters.free,
        "covariance": parameters.spread(spread, np.nan, axes=2),
        "shift_by_cause": parameters.spread(np.array([*shifts.values()]), np.nan),
        "history": optimum.history if optimum.history.ndim == 2 else optimum.history[:, None],  # (steps, chains)
    }
    effective = effective_values(problem, optimum.vector)
    attributes = (
        problem_attributes(problem)
        | _of_the_search(problem, optimum, settled)
        | {
            "effective_values": effective,
            "status": _status(problem, optimum, effective, spread, pinned),
            "solver": solver.name,
            "settings": repr(solver),
            "seconds": time.perf_counter() - started,
            "covariance": covariance,
        }
    )
    return _logged(
        Solution(assembled({**parameters.coords, CAUSE: list(shifts)}, columns, attributes), whole(problem.model))
    )


def _logged(solution: Solution) -> Solution:
    """The same, after `logging` was told of it."""
    attrs = solution.dataset.attrs
    words = "fitted %s to %d points with %s weighting by %s: E %.4g after %d evaluations, %.3g s, %s"
    names = ("model", "points", "weighting", "settings", "cost", "evaluations", "seconds", "status")
    logging.getLogger(__name__).info(words, *(attrs[name] for name in names))
    return solution


def _of_the_search(problem: Problem, optimum: Optimum, settled: Settled) -> dict[str, Any]:
    """The attributes that say how the search went."""
    weights = settled.problem.point_weights
    return {
        # The solver's cost contains the penalty; that of a Solution is E of the data, to be compared between fits.
        "cost": optimum.cost - float(problem.cost(problem.penalty @ optimum.vector)),
        "evaluations": optimum.evaluations,
        "loss_scale": settled.scale,
        "points": len(problem.measured),
        "points_searched": optimum.searched or len(problem.measured),
        **_minima(problem, optimum),
        "points_discounted": 0 if weights is None else int((weights < 0.5).sum()),
        "instrument_error": _instrument_error(problem, optimum.vector),
    }


def _minima(problem: Problem, optimum: Optimum) -> dict[str, Any]:
    """How many searches ended at the lowest minimum, and where the next one lies.

    Where each search met another minimum, there may be a lower one that none has met.
    """
    if not optimum.rivals or problem.smooth or not optimum.cost > 0:
        return {}
    others = sorted(float(problem.cost(problem.residual(vector))) for vector in optimum.rivals)
    ratios = np.array(others) / optimum.cost
    apart = ratios[ratios > 1 + NEARLY]
    return {
        "searches": 1 + len(others),
        "searches_alike": 1 + len(others) - len(apart),
        "next_minimum": float(apart[0]) if len(apart) else math.nan,
    }


def _instrument_error(problem: Problem, vector: Values) -> float:
    """How much the numerical integration over the instrument's cones can matter to the fit.

    With r the residual and r' the residual for at least twice as many rings of directions in each cone, it is
    |r' - r|/|r|. A value near 1 means that the error of the integration is as large as the misfit: take a smaller step.
    Zero without an instrument, and where the fit is perfect.
    """
    if not problem.instrument:
        return 0.0
    residual = problem.residual(vector)
    change = replace(problem, instrument=problem.instrument.finer()).residual(vector) - residual
    remaining = float(np.linalg.norm(residual))
    return float(np.linalg.norm(change)) / remaining if remaining > 0 else 0.0


def _at_bound(vector: Values, bound: Values) -> Mask:
    """Which values (n,) are at a bound (n,).

    A relative tolerance, because a search works in coordinates from 0 to 1, and the way back to a parameter's own scale
    rounds. A bound of zero is met exactly.
    """
    near: Mask = np.isfinite(bound) & (np.abs(vector - bound) <= 1e-9 * np.maximum(np.abs(bound), 1e-300))
    return near


def _status(problem: Problem, optimum: Optimum, effective: float, spread: Values, pinned: Mask) -> Status:
    """How the search ended; where several statuses apply, the one that makes the values least trustworthy.

    effective: the effective number of values, against which the points are counted. spread: the covariance (n, n).
    """
    # First, because without degrees of freedom `robust` and `scaled` are infinite as well: NOT_DETERMINED would name a
    # consequence and not the cause.
    if len(problem.measured) <= effective:
        return Status.TOO_FEW_POINTS
    if optimum.exhausted:
        return Status.STEPS_EXHAUSTED
    if not np.isfinite(np.diag(spread)).all():
        return Status.NOT_DETERMINED
    return Status.AT_BOUND if pinned.any() else Status.CONVERGED
