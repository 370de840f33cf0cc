"""Several models fitted to one scan, the best first, and the reductions of error in the paper's tables."""

import functools
import logging
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import xarray as xr

from gonio.comparison.assessment import Row, assess, validate
from gonio.comparison.metrics import METRICS
from gonio.completion import Correction
from gonio.fitting.covariance_kinds import DEFAULT
from gonio.fitting.fitting import fit
from gonio.fitting.objective.from_scan import answered
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.solver import Progress, Solver, silent
from gonio.measured.dataset import is_degree
from gonio.measured.polarisers import unpolarised
from gonio.model import Model
from gonio.options import options_of
from gonio.processes import results

TIE = 1e-6  # relative difference of a metric below which two models do equally well

# The models that guo2023 compares, its own made reciprocal, and the simplest of all.
FAMILY = ("lambert", "torrance-sparrow", "wang-2016", "liu-2016", "cauchy-lorentz", "cauchy-lorentz-reciprocal")

# What the paper calls T-S and T-C: the second is wang-2016 for its metals and liu-2016 for its coatings.
REFERENCES: Mapping[str, tuple[str, ...]] = {"T-S": ("torrance-sparrow",), "T-C": ("wang-2016", "liu-2016")}


def compare(
    scan: xr.Dataset,
    models: Sequence[Model],
    *,
    by: str = "",
    left_out: str = "",
    solver: Solver | None = None,
    workers: int = 1,
    progress: Progress = silent,
    **options: Any,
) -> list[Row]:
    """Fit several models to one scan, and rank them by a metric: the best first, ties by fewer free values.

    Parameters
    ----------
    scan : xarray.Dataset
        The scan.
    models : sequence of Model
        The models, such as `list(gonio.catalogue.values())`.
    by : str
        A name of `gonio.comparison.METRICS`. Without one it is the metric that the fits minimise: lg RMSE for
        logarithms, E for all other weightings.
    left_out : str
        `theta_i`, `out-of-plane`, or a number of blocks: what is left out in turn and predicted from the rest. The
        order is then by the metric of these predictions.
    solver : Solver, optional
        `gonio.fitting.Projection()` unless another is given.
    workers : int
        Processes that share the models. Results do not depend on their number.
    progress : callable
        Called with the part of the work that is done, 0 to 1.
    **options
        Those of a `Problem`, with `weighting` from the data unless one is named. Names of parameters apply to the
        models that have them.

    Returns
    -------
    list of Row
        For each model its `solution`, `metrics`, `validated` metrics, AICc and BIC.

    Raises
    ------
    ValueError
        No model has a parameter of that name, or there is no such metric.

    """
    if by and by not in METRICS:
        raise ValueError(f"no metric {by!r}: choose one of {', '.join(METRICS)}")
    problems = problems_of(scan, models, settled(scan, options))
    work = functools.partial(assessed, solver=solver, left_out=left_out)
    done: dict[int, Row] = {}
    longest = longest_first(problems)
    for index, row in results(work, [problems[k] for k in longest], workers):
        done[longest[index]] = row
        progress(len(done) / len(models))
        logging.getLogger(__name__).info("compared %s, %d of %d", row.model.name, len(done), len(models))
    return ordered([done[k] for k in range(len(models))], by)


def settled(scan: xr.Dataset, options: Mapping[str, Any]) -> ProblemOptions:
    """The options with those that are read from the scan read, once for all models."""
    asked = ProblemOptions(**options)
    return replace(asked, **answered(asked, scan))


def problems_of(scan: xr.Dataset, models: Sequence[Model], options: ProblemOptions) -> list[Problem]:
    """The problem of each model, with the options that concern it.

    All are judged at the same points: where a model knows no polarisation, of unpolarised light for every one.
    """
    if not is_degree(scan) and not all(model.polarised for model in models):
        scan = unpolarised(scan)
    return [Problem(model, scan, **for_model(model, models, options)) for model in models]


def longest_first(problems: Sequence[Problem]) -> list[int]:
    """Places of the problems, the longest searches first: no process has one left when the others are finished."""
    return sorted(range(len(problems)), key=lambda k: -len(problems[k].free_shape))


def assessed(
    problem: Problem,
    solver: Solver | None,
    left_out: str,
    covariance: str = DEFAULT,
    correction: Correction | None = None,
) -> Row:
    """A problem fitted, and validated where something is left out."""
    row = assess(problem, fit(problem, solver, covariance=covariance))
    return validate(problem, row, left_out, correction=correction) if left_out else row


def ordered(rows: Sequence[Row], by: str = "") -> list[Row]:
    """Rows of one scan, the best first: by a metric of the fit, or else by what was left out where something was."""

    def error_of(row: Row) -> float:
        return row.validated[row.metric] if row.validated and not by else row.metrics[by or row.metric]

    return _ordered(rows, error_of)


def _ordered(rows: Sequence[Row], error_of: Callable[[Row], float]) -> list[Row]:
    """By an error; of models that agree in it to TIE the simpler first, then as given: rounding decides nothing."""
    place = {id(row): k for k, row in enumerate(rows)}
    ties: list[list[Row]] = []
    for row in sorted(rows, key=lambda row: (math.isnan(error_of(row)), error_of(row))):
        if ties and math.isclose(error_of(ties[-1][0]), error_of(row), rel_tol=TIE):
            ties[-1].append(row)
        else:
            ties.append([row])
    return [row for tied in ties for row in sorted(tied, key=lambda row: (row.free_parameters, place[id(row)]))]


def for_model(model: Model, models: Sequence[Model], options: ProblemOptions) -> dict[str, Any]:
    """The options with the names of parameters that this model has."""
    out = options.given()
    parameters = {name for m in models for name in m.parameters}
    for field, option in options_of(ProblemOptions).items():
        setting = out[field] if option.of_parameters else ()
        if unknown := [name for name in setting if name not in parameters]:
            raise ValueError(
                f"{field}: none of the models has a parameter {unknown[0]!r}; there are {', '.join(sorted(parameters))}"
            )
        if setting and isinstance(setting, Mapping):
            out[field] = {name: value for name, value in setting.items() if name in model.parameters}
        elif setting:
            out[field] = tuple(name for name in setting if name in model.parameters)
    return out


def drop(reference: float, value: float) -> float:
    """Percentage by which `value` is below `reference`, as in Tables 2 and 3 (negative where it is above)."""
    return 100 * (reference - value) / reference


def reference_errors(rows: Sequence[Row], metric: str = "nrmse") -> dict[str, float]:
    """The error of the paper's reference models among `rows`; of both T-C models, that of the better one."""
    error_of = {row.model.name: row.metrics[metric] for row in rows}
    errors = {short: [error_of[name] for name in names if name in error_of] for short, names in REFERENCES.items()}
    return {short: min(candidates) for short, candidates in errors.items() if candidates}
