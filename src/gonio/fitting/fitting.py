"""Fitting: a problem and a solver in, a Solution out."""

import time
from dataclasses import asdict, replace
from importlib.metadata import version

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.certainty.covariance import DEFAULT, estimator, jacobian, systematic_shift, tangent
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search import bulk
from gonio.fitting.search.projection import Projection
from gonio.fitting.search.reweighting import Settled, minimum
from gonio.fitting.search.solver import Progress, Solver, silent
from gonio.fitting.search.strength import effective_values, resolved
from gonio.fitting.solution import Optimum, Solution, Status
from gonio.measured import dataset

Values = npt.NDArray[np.float64]


def fit(
    problem: Problem, solver: Solver | None = None, progress: Progress = silent, covariance: str = DEFAULT
) -> Solution:
    """Search the values of least E (guo2023, eq 11) and say how sure they are.

    Strengths and scales of smooth parameters that the problem leaves open are `resolved` first.
    covariance: `robust` and `scaled` learn the noise from the scatter about the fit, `absolute` takes the uncertainty
    that the scan states at its word (`fit.covariance`).
    A fit that goes wrong has a status that says so; it raises nothing and hides nothing. Its cost is E under any loss.
    Raises ValueError for another covariance, or where the scan does not state what it needs.
    """
    solver = solver or Projection()
    estimator(problem, covariance)  # what it refuses is refused before the search
    started = time.perf_counter()
    problem = resolved(problem)
    optimum, settled = minimum(problem, solver, progress)
    spread = _spread(settled, optimum.vector, covariance)
    pinned = _at_bound(optimum.vector, problem.lower) | _at_bound(optimum.vector, problem.upper)
    shift = _systematic(settled.problem, optimum.vector, pinned)
    found = _solution(problem, optimum, settled, spread, pinned, shift)
    found.attrs |= {
        "solver": solver.name,
        "settings": repr(solver),
        "seconds": time.perf_counter() - started,
        "covariance": covariance,
    }
    return Solution(found)


def _spread(settled: Settled, vector: Values, kind: str) -> Values:
    """The covariance of the free values (n, n)."""
    problem = settled.problem
    if problem.bulk:
        return bulk.covariance(problem, problem.bulk, vector, kind)
    residual = problem.difference(problem.brdf(vector))
    return estimator(problem, kind, settled.slope)(tangent(problem, vector), residual)


def _systematic(problem: Problem, vector: Values, pinned: npt.NDArray[np.bool_]) -> Values:
    """Shift of the free values by one systematic standard uncertainty; NaN unless the scan states it everywhere."""
    stated = problem.points.get("uncertainty_systematic")
    if stated is None or not (stated.values >= 0).all():
        return np.full(len(vector), np.nan)
    if problem.bulk:
        return bulk.systematic_shift(problem.bulk, vector, problem.error(stated.values), pinned)
    slopes = np.concatenate([jacobian(problem, vector), problem.penalty])
    return systematic_shift(slopes, problem.error(stated.values), pinned)


def _solution(
    problem: Problem,
    optimum: Optimum,
    settled: Settled,
    spread: Values,
    pinned: npt.NDArray[np.bool_],
    shift: Values,
) -> xr.Dataset:
    entries = [(entry, label) for entry in problem.entries for label in entry.labels]
    names = [name for entry in problem.entries for name in entry.names]
    free = np.array([entry.held is None for entry, _ in entries])
    value = np.array([v for entry in problem.entries for v in entry.held or [np.nan] * entry.size])
    value[free] = optimum.vector
    full = np.full((len(names), len(names)), np.nan)
    full[np.ix_(free, free)] = spread
    at_bound = np.zeros(len(names), dtype=bool)
    at_bound[free] = pinned
    systematic = np.full(len(names), np.nan)
    systematic[free] = shift
    effective = effective_values(problem, optimum.vector)
    status = _status(problem, optimum, effective, spread, at_bound)
    text = {
        "name": [entry.name for entry, _ in entries],
        "by": [",".join(entry.by) for entry, _ in entries],
        "group": [label for _, label in entries],
        "unit": [entry.unit for entry, _ in entries],
    }
    history = optimum.history if optimum.history.ndim == 2 else optimum.history[:, None]
    return xr.Dataset(
        {
            "value": ("parameter", value),
            "uncertainty": ("parameter", np.sqrt(np.diag(full))),
            "uncertainty_systematic": ("parameter", np.abs(systematic)),
            "systematic_shift": ("parameter", systematic),
            "at_bound": ("parameter", at_bound),
            "held": ("parameter", ~free),
            "covariance": (("parameter", "parameter_b"), full),
            "history": (("step", "chain"), history),
        },
        coords={"parameter": names} | {key: ("parameter", column) for key, column in text.items()},
        attrs={
            "model": problem.model.name,
            "cite": problem.model.cite,
            "status": status.value,
            "cost": optimum.cost - float(problem.cost(problem.penalty @ optimum.vector)),
            "evaluations": optimum.evaluations,
            "weighting": problem.weighting,
            "noise_floor": problem.noise_floor,
            "loss": problem.loss,
            "loss_scale": settled.scale,
            "points_discounted": _discounted(settled),
            "points": len(problem.measured),
            "points_searched": optimum.searched or len(problem.measured),
            "effective_values": effective,
            "smooth": " ".join(f"{name}={one}" for name, one in problem.smoothed.items()),
            "unit": dataset.unit(problem.data),
            "data_history": problem.data.attrs.get("history", ""),
            "versions": ", ".join(f"{name} {version(name)}" for name in ("gonio", "numpy", "scipy")),
            **{f"instrument_{name}": value for name, value in asdict(problem.instrument).items()},
            "instrument_error": _instrument_error(problem, optimum.vector),
        },
    )


def _discounted(settled: Settled) -> int:
    """How many points the loss lets count for less than half."""
    weights = settled.problem.point_weights
    return 0 if weights is None else int((weights < 0.5).sum())


def _instrument_error(problem: Problem, vector: Values) -> float:
    """Root of E of the change that a finer rule for the instrument's cones makes, over the root of E itself."""
    if not problem.instrument:
        return 0.0
    residual = problem.residual(vector)
    change = replace(problem, instrument=problem.instrument.finer()).residual(vector) - residual
    left = float(np.linalg.norm(residual))
    return float(np.linalg.norm(change)) / left if left > 0 else 0.0


def _at_bound(vector: Values, bound: Values) -> npt.NDArray[np.bool_]:
    """At a bound to within rounding of the search's own coordinates."""
    near: npt.NDArray[np.bool_] = np.isfinite(bound) & (
        np.abs(vector - bound) <= 1e-9 * np.maximum(np.abs(bound), 1e-300)
    )
    return near


def _status(
    problem: Problem, optimum: Optimum, effective: float, spread: Values, at_bound: npt.NDArray[np.bool_]
) -> Status:
    if len(problem.measured) <= effective:
        return Status.TOO_FEW_POINTS
    if optimum.exhausted:
        return Status.STEPS_EXHAUSTED
    if not np.isfinite(np.diag(spread)).all():
        return Status.NOT_DETERMINED
    return Status.AT_BOUND if at_bound.any() else Status.CONVERGED
