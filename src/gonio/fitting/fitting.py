"""Fitting: a problem and a solver in, a Solution out."""

import time
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from gonio.fitting.certainty.covariance import covariance as covariance_of
from gonio.fitting.certainty.covariance import estimator, systematic_shift
from gonio.fitting.covariance_kinds import DEFAULT
from gonio.fitting.objective.problem import Problem
from gonio.fitting.schema import Parameters, assembled, told_by
from gonio.fitting.search.projection import Projection
from gonio.fitting.search.reweighting import Settled, as_found, reweighted
from gonio.fitting.search.solver import Optimum, Progress, Solver, silent
from gonio.fitting.search.strength import effective_values, resolved
from gonio.fitting.solution import Solution
from gonio.fitting.status import Status

Values = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]


def fit(
    problem: Problem, solver: Solver | None = None, progress: Progress = silent, covariance: str = DEFAULT
) -> Solution:
    """Search the values of least E (guo2023, eq 11) and say how sure they are.

    solver: `Projection()` unless another is given. Strengths and scales of smooth parameters that the problem leaves
    open are settled first (`search.strength`).
    covariance: `robust` and `scaled` learn the noise from the scatter about the fit, `absolute` takes the uncertainty
    that the scan states at its word (`certainty.covariance`).
    A fit that goes wrong has a status that says so; it raises nothing and hides nothing. Its cost is E under any loss.
    Raises ValueError for another covariance, or where the scan does not state what it needs.
    """
    solver = solver or Projection()
    estimator(problem, covariance)  # what it refuses is refused before the search
    started = time.perf_counter()
    problem = resolved(problem)
    optimum = solver.search(problem, progress)
    settled = as_found(problem, optimum.vector, optimum.exhausted)
    if problem.loss != "squared":
        optimum, settled = reweighted(problem, solver, optimum)
    spread = covariance_of(settled.problem, optimum.vector, covariance, settled.slope)
    pinned = _at_bound(optimum.vector, problem.lower) | _at_bound(optimum.vector, problem.upper)
    parameters = Parameters.of(problem)
    columns = {
        "value": parameters.values(optimum.vector),
        "at_bound": parameters.spread(pinned, False),
        "held": ~parameters.free,
        "covariance": parameters.spread(spread, np.nan, axes=2),
        "systematic_shift": parameters.spread(systematic_shift(settled.problem, optimum.vector, pinned), np.nan),
        "history": optimum.history if optimum.history.ndim == 2 else optimum.history[:, None],
    }
    effective = effective_values(problem, optimum.vector)
    attributes = (
        told_by(problem)
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
    return Solution(assembled(parameters.coords, columns, attributes), problem.model)


def _of_the_search(problem: Problem, optimum: Optimum, settled: Settled) -> dict[str, Any]:
    """The attributes that say what became of the search."""
    weights = settled.problem.point_weights
    return {
        "cost": optimum.cost - float(problem.cost(problem.penalty @ optimum.vector)),
        "evaluations": optimum.evaluations,
        "loss_scale": settled.scale,
        "points": len(problem.measured),
        "points_searched": optimum.searched or len(problem.measured),
        "points_discounted": 0 if weights is None else int((weights < 0.5).sum()),
        "instrument_error": _instrument_error(problem, optimum.vector),
    }


def _instrument_error(problem: Problem, vector: Values) -> float:
    """Root of E of the change that a finer rule for the instrument's cones makes, over the root of E itself."""
    if not problem.instrument:
        return 0.0
    residual = problem.residual(vector)
    change = replace(problem, instrument=problem.instrument.finer()).residual(vector) - residual
    remaining = float(np.linalg.norm(residual))
    return float(np.linalg.norm(change)) / remaining if remaining > 0 else 0.0


def _at_bound(vector: Values, bound: Values) -> Mask:
    """Which values are at a bound, to within rounding of the search's own coordinates."""
    near: Mask = np.isfinite(bound) & (np.abs(vector - bound) <= 1e-9 * np.maximum(np.abs(bound), 1e-300))
    return near


def _status(problem: Problem, optimum: Optimum, effective: float, spread: Values, pinned: Mask) -> Status:
    """How the search ended; the worst that applies."""
    if len(problem.measured) <= effective:
        return Status.TOO_FEW_POINTS
    if optimum.exhausted:
        return Status.STEPS_EXHAUSTED
    if not np.isfinite(np.diag(spread)).all():
        return Status.NOT_DETERMINED
    return Status.AT_BOUND if pinned.any() else Status.CONVERGED
