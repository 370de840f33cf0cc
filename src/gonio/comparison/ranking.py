"""Several models fitted to one scan, the nearest first, and the drops of the paper's tables."""

import functools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import xarray as xr

from gonio.comparison.assessment import Row, assess, validate
from gonio.comparison.metrics import METRICS
from gonio.fitting.fitting import fit
from gonio.fitting.objective.from_scan import answered
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.solver import Progress, Solver, silent
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
    by: str = "E",
    left_out: str = "",
    solver: Solver | None = None,
    workers: int = 1,
    progress: Progress = silent,
    **options: Any,
) -> list[Row]:
    """Fit several models to one scan and order them by a metric, the nearest first, ties by fewer free values.

    by: a name of METRICS. left_out: `theta_i`, `out-of-plane`, or a number of blocks: each model is validated on what
    is left out in turn, and the order is by lg RMSE of that.
    workers: processes that share the models (`processes.results`); they find the same whatever their number.
    options: those of ProblemOptions. Names of parameters apply to the models that have them.
    Raises ValueError for a name that none of the models has, or a metric that does not exist.
    """
    if by not in METRICS:
        raise ValueError(f"no metric {by!r}: choose one of {', '.join(METRICS)}")
    asked = ProblemOptions(**options)
    asked = replace(asked, **answered(asked, scan))
    problems = [Problem(model, scan, **_for_model(model, models, asked)) for model in models]
    longest = sorted(range(len(models)), key=lambda k: -len(problems[k].free_shape))  # their searches start first
    done: dict[int, Row] = {}
    work = functools.partial(_assessed, solver=solver, left_out=left_out)
    for place, row in results(work, [problems[k] for k in longest], workers):
        done[longest[place]] = row
        progress(len(done) / len(models))
    rows = [done[k] for k in range(len(models))]
    return _ordered(rows, (lambda row: row.validated["log10_rmse"]) if left_out else (lambda row: row.metrics[by]))


def _assessed(problem: Problem, solver: Solver | None, left_out: str) -> Row:
    row = assess(problem, fit(problem, solver))
    return validate(problem, row, left_out) if left_out else row


def _ordered(rows: Sequence[Row], of: Callable[[Row], float]) -> list[Row]:
    """By an error; of models that agree in it to a millionth the simpler first, because rounding decides nothing."""
    out: list[list[Row]] = []
    for row in sorted(rows, key=lambda row: (math.isnan(of(row)), of(row))):
        if out and math.isclose(of(out[-1][0]), of(row), rel_tol=TIE):
            out[-1].append(row)
        else:
            out.append([row])
    return [row for tied in out for row in sorted(tied, key=lambda row: row.free_parameters)]


def _for_model(model: Model, models: Sequence[Model], options: ProblemOptions) -> dict[str, Any]:
    """The options with the names of parameters that this model has."""
    out = options.given()
    known = {name for m in models for name in m.parameters}
    for what, option in options_of(ProblemOptions).items():
        given = out[what] if option.of_parameters else ()
        if unknown := [name for name in given if name not in known]:
            raise ValueError(
                f"{what}: none of the models has a parameter {unknown[0]!r}; there are {', '.join(sorted(known))}"
            )
        if given and isinstance(given, Mapping):
            out[what] = {name: value for name, value in given.items() if name in model.parameters}
        elif given:
            out[what] = tuple(name for name in given if name in model.parameters)
    return out


def drop(reference: float, value: float) -> float:
    """Percentage by which `value` is below `reference`, as in Tables 2 and 3 (negative where it is above)."""
    return 100 * (reference - value) / reference


def reference_errors(rows: Sequence[Row], metric: str = "nrmse") -> dict[str, float]:
    """The error of the paper's reference models among `rows`; where both T-C models are there, the better one's."""
    known = {row.model.name: row.metrics[metric] for row in rows}
    errors = {short: [known[name] for name in names if name in known] for short, names in REFERENCES.items()}
    return {short: min(some) for short, some in errors.items() if some}
