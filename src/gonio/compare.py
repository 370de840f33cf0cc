"""How far two reflectances are apart, and which of several models is nearest to a scan."""

import functools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.certainty.hold_out import predictions
from gonio.fitting.fitting import fit
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.solver import Progress, Solver, silent
from gonio.fitting.search.strength import resolved
from gonio.fitting.solution import Solution
from gonio.measured import dataset
from gonio.measured.distinct import distinct
from gonio.measured.instrument import Acceptance
from gonio.model import Model
from gonio.processes import results

Values = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Metric:
    """One figure of merit: its heading, what it is in a few words and in full; smaller is better for each."""

    title: str
    brief: str
    help: str


METRICS: Mapping[str, Metric] = {
    "delta": Metric(
        "delta",
        "rms relative error",
        "rms of the error relative to the measured value, over positive values (guo2023, eq 9)",
    ),
    "E": Metric(
        "E",
        "squared error over squared measurement",
        "weighted squared error over weighted squared measurement (eq 11)",
    ),
    "nrmse": Metric(
        "nRMSE",
        "rms error of curves over their specular value",
        "rms difference of curves that are each divided by their own value at the specular angle (Tables 2 and 3)",
    ),
    "log10_rmse": Metric(
        "lg RMSE",
        "rms error of the decimal logarithm",
        "rms difference of decimal logarithms, over values positive in both",
    ),
}

# The models that guo2023 compares, its own made reciprocal, and the simplest of all.
MOST_INCIDENCES = 1000  # angles; a scan has tens
TOGETHER = 2**16  # directions that are evaluated at once: more cost memory and no less time
TIE = 1e-6  # relative difference of a metric below which two models do equally well
FAMILY = ("lambert", "torrance-sparrow", "wang-2016", "liu-2016", "cauchy-lorentz", "cauchy-lorentz-reciprocal")

# What the paper calls T-S and T-C: the second is wang-2016 for its metals and liu-2016 for its coatings.
REFERENCES: Mapping[str, tuple[str, ...]] = {"T-S": ("torrance-sparrow",), "T-C": ("wang-2016", "liu-2016")}


def metrics(points: xr.Dataset, modelled: Values, weights: Values | None = None) -> dict[str, float]:
    """Every metric of METRICS between the BRDF of a flat scan and `modelled` at the same directions.

    `weights` are those of E (eq 11), 1 where None. A metric that the data do not allow is NaN: delta and log10_rmse
    without positive values, nrmse without a curve that holds its specular angle.
    """
    measured = points["brdf"].values
    weights = np.ones_like(measured) if weights is None else weights
    positive = measured > 0
    both = positive & (modelled > 0)
    error = modelled - measured
    return {
        "delta": _rms(error[positive] / measured[positive]),
        "E": float(np.sum(weights * error**2) / np.sum(weights * measured**2)),
        "nrmse": _rms(_normalised_error(points, modelled)),
        "log10_rmse": _rms(np.log10(modelled[both] / measured[both])),
    }


def metrics_by_incidence(points: xr.Dataset, modelled: Values) -> dict[float, dict[str, float]]:
    """The metrics of each incidence angle [deg] on its own; none where there are more than MOST_INCIDENCES.

    A grid of other coordinates than theta_i has as many as directions, and no angle of it means anything alone.
    """
    theta_i = points["theta_i"].values
    if len(distinct(theta_i[: 100 * MOST_INCIDENCES])[0]) > MOST_INCIDENCES:  # the first of millions tell
        return {}
    angles, place = distinct(theta_i)
    if len(angles) > MOST_INCIDENCES:
        return {}
    rows = {float(angle): np.flatnonzero(place == k) for k, angle in enumerate(angles)}
    return {angle: metrics(points.isel(direction=at), modelled[at]) for angle, at in rows.items()}


def drop(reference: float, value: float) -> float:
    """Percentage by which `value` is below `reference`, as in Tables 2 and 3 (negative where it is above)."""
    return 100 * (reference - value) / reference


def curves(points: xr.Dataset) -> Iterator[tuple[dict[str, Any], npt.NDArray[np.intp]]]:
    """The in-plane curves of a flat scan: what tells each apart, and its rows in the order of signed theta_r."""
    keys = ("theta_i", *dataset.sets(points))
    some = np.flatnonzero(dataset.is_in_plane(points))
    if not some.size:
        return
    columns = [distinct(points[key].values[some]) for key in keys]
    order = np.lexsort((dataset.signed_theta_r(points)[some], *(place for _, place in reversed(columns))))
    next_one = np.any([np.diff(place[order]) != 0 for _, place in columns], axis=0)
    for part in np.split(order, np.flatnonzero(next_one) + 1):
        yield {k: v[place[part[0]]].item() for k, (v, place) in zip(keys, columns, strict=True)}, some[part]


def at_specular(theta_r: Values, values: Values, theta_i: float) -> float:
    """A curve's value at its specular angle, interpolated; NaN where the scan does not reach it."""
    if not theta_r[0] <= theta_i <= theta_r[-1]:
        return math.nan
    return float(np.interp(theta_i, theta_r, values))


def _normalised_error(points: xr.Dataset, modelled: Values) -> Values:
    """Differences of the curves that hold their specular angle, each curve normalised by its own value there."""
    signed, measured = dataset.signed_theta_r(points), points["brdf"].values
    errors = []
    for key, rows in curves(points):
        ours = at_specular(signed[rows], modelled[rows], key["theta_i"])
        theirs = at_specular(signed[rows], measured[rows], key["theta_i"])
        if ours > 0 and theirs > 0:
            errors.append(modelled[rows] / ours - measured[rows] / theirs)
    return np.concatenate(errors) if errors else np.empty(0)


def _rms(values: Values) -> float:
    return float(np.sqrt(np.mean(values**2))) if values.size else math.nan


@dataclass(frozen=True)
class Row:
    """One model on one scan."""

    model: Model
    solution: Solution
    free_parameters: int
    effective_values: float
    metrics: Mapping[str, float]
    by_incidence: Mapping[float, Mapping[str, float]]
    aicc: float
    bic: float
    farthest: float
    validated: Mapping[str, float] = field(default_factory=dict)
    by_fold: Mapping[str, float] = field(default_factory=dict)


def parts(model: Model, solution: Solution, points: xr.Dataset) -> dict[str, Values]:
    """Every weight times its term at the directions of a flat scan, as the instrument of the fit reads them."""
    values = solution.at(points)
    acceptance = Acceptance(solution.instrument, dataset.geometry(points))
    basis = acceptance.basis(model, {name: value for name, value in values.items() if name in model.shape})
    return {weight: np.asarray(values[weight] * term, dtype=float) for weight, term in basis.items()}


def predict(model: Model, solution: Solution, points: xr.Dataset) -> Values:
    """The fitted BRDF at the directions of a flat scan, as the instrument of the fit reads it."""
    parts = [points]
    if points.sizes["direction"] > TOGETHER:
        some = range(0, points.sizes["direction"], TOGETHER)
        parts = [points.isel(direction=slice(at, at + TOGETHER)) for at in some]
    acceptances = (Acceptance(solution.instrument, dataset.geometry(part)) for part in parts)
    found = [a.brdf(model, solution.at(part)) for a, part in zip(acceptances, parts, strict=True)]
    return np.concatenate([np.broadcast_to(f, p.sizes["direction"]) for f, p in zip(found, parts, strict=True)])


VALIDATED = ("delta", "log10_rmse")


def assess(problem: Problem, solution: Solution) -> Row:
    """A fit and its metrics over the points that it was fitted to, E under the weights of the fit.

    AICc and BIC (burnham2002) take the residuals of the fit as independent and Gaussian, with a variance that is fitted
    too; only their differences between models of one scan and one weighting mean something. Where parameters are smooth
    they count what that leaves of the free values.
    """
    modelled = predict(problem.model, solution, problem.points)
    weights = None if problem.logarithmic else problem.root_weights**2
    effective = float(solution.dataset.attrs["effective_values"])
    return Row(
        problem.model,
        solution,
        len(problem.names),
        effective,
        metrics(problem.points, modelled, weights),
        metrics_by_incidence(problem.points, modelled),
        *information_criteria(float(problem.scale * solution.cost), len(problem.measured), effective),
        float(problem.points["theta_r"].max()),
    )


def information_criteria(squares: float, points: int, free: float) -> tuple[float, float]:
    """AICc and BIC (burnham2002) of a sum of squared residuals; NaN where the points do not outnumber the values."""
    k = free + 1
    if points <= k + 1:
        return math.nan, math.nan
    deviance = points * math.log(max(squares, np.finfo(float).tiny) / points)
    return deviance + 2 * k + 2 * k * (k + 1) / (points - k - 1), deviance + k * math.log(points)


def validate(problem: Problem, row: Row, by: str) -> Row:
    """The row with what its model predicts for parts that the fit was not shown (`fit.hold_out.folds` says which).

    `validated` holds the metrics over all left-out points, `by_fold` lg RMSE of each part.
    Raises ValueError where a part cannot be predicted.
    """
    modelled, parts = predictions(problem, row.solution, by)
    seen = np.flatnonzero(np.isfinite(modelled))
    left_out = metrics(problem.points.isel(direction=seen), modelled[seen])
    by_fold = {}
    for name, left in parts:
        at = np.flatnonzero(left)
        by_fold[name] = metrics(problem.points.isel(direction=at), modelled[at])["log10_rmse"]
    return replace(row, validated={name: left_out[name] for name in VALIDATED}, by_fold=by_fold)


def behind(row: Row, best: Row) -> tuple[float, float]:
    """By how much a model's left-out lg RMSE exceeds the best one's: mean over the parts and its standard error.

    NaN for the error with fewer than two parts. A difference below twice its error means nothing.
    """
    differences = np.array([row.by_fold[name] - error for name, error in best.by_fold.items()])
    if differences.size < 2:
        return float(np.mean(differences)), math.nan
    return float(np.mean(differences)), float(np.std(differences, ddof=1) / math.sqrt(differences.size))


def rank(
    scan: xr.Dataset,
    models: Sequence[Model],
    *,
    by: str = "E",
    solver: Solver | None = None,
    progress: Progress = silent,
    left_out: str = "",
    workers: int = 1,
    **options: Any,
) -> list[Row]:
    """Fit several models to one scan and order them by a metric, the nearest first, ties by fewer free values.

    With `left_out` (`theta_i`, `out-of-plane`, or a number of blocks) each is validated, and the order is by lg RMSE of
    what was left out.

    `workers` processes share the models (`processes.results`), and find the same whatever their number.
    `options` are those of Problem; held, grouped, shared, smooth and bounded names apply to the models that have them.
    Raises ValueError for a name that none of the models has, or a metric that does not exist.
    """
    if by not in METRICS:
        raise ValueError(f"no metric {by!r}: choose one of {', '.join(METRICS)}")
    problems = [Problem(model, scan, **_for_model(model, models, options)) for model in models]
    longest = sorted(range(len(models)), key=lambda k: -len(problems[k].free_shape))  # their searches start first
    found: dict[int, Row] = {}
    work = functools.partial(_assessed, solver=solver, left_out=left_out)
    for place, row in results(work, [problems[k] for k in longest], workers):
        found[longest[place]] = row
        progress(len(found) / len(models))
    rows = [found[k] for k in range(len(models))]
    return _ordered(rows, (lambda row: row.validated["log10_rmse"]) if left_out else (lambda row: row.metrics[by]))


def _assessed(problem: Problem, solver: Solver | None, left_out: str) -> Row:
    problem = resolved(problem)
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


def reference_errors(rows: Sequence[Row], metric: str = "nrmse") -> dict[str, float]:
    """The error of the paper's reference models among `rows`; where both T-C models are there, the better one's."""
    known = {row.model.name: row.metrics[metric] for row in rows}
    found = {short: [known[name] for name in names if name in known] for short, names in REFERENCES.items()}
    return {short: min(errors) for short, errors in found.items() if errors}


def _for_model(model: Model, models: Sequence[Model], options: Mapping[str, Any]) -> dict[str, Any]:
    out = dict(options)
    known = {name for m in models for name in m.parameters}
    for what in ("held", "grouped", "bounds", "shared", "smooth"):
        given = options.get(what)
        if not given:
            continue
        if unknown := [name for name in given if name not in known]:
            raise ValueError(
                f"{what}: none of the models has a parameter {unknown[0]!r}; there are {', '.join(sorted(known))}"
            )
        if isinstance(given, Mapping):
            out[what] = {name: value for name, value in given.items() if name in model.parameters}
        else:
            out[what] = tuple(name for name in given if name in model.parameters)
    return out
