"""Which model describes a scan, how well, with which values, and how sure: the answer where nothing else is asked.

1. Values that the rest of the scan contradicts are left out of the fit (`consistency`), and said to be.
2. The weighting that the data ask for (`fitting.objective.automatic`), unless one is named.
3. A first look at every model (`race`), and a fit of those that may predict best.
4. Each of these is validated on directions that its fit was not shown, whole incidence angles where the scan has three.
5. The one with the least error there, its values and uncertainties, and a verdict in plain words (`verdict`).

The error of the best of several models is a little too small, as the model was chosen by it. Of very many points some
stand for all while models are compared; the best is then fitted to all.
"""

import functools
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import xarray as xr

from gonio.comparison.assessment import Row
from gonio.comparison.consistency import Contradiction, consistent
from gonio.comparison.consistency import record as contradicted_record
from gonio.comparison.race import FIRST, first_look, sample_rows, worth_fitting
from gonio.comparison.ranking import assessed, for_model, longest_first, ordered, problems_of, settled
from gonio.comparison.runs import LOOKED, Asked, Run, Watch
from gonio.comparison.verdict import Verdict, verdict
from gonio.fitting import fitting
from gonio.fitting.certainty.hold_out import predictable
from gonio.fitting.covariance_kinds import DEFAULT
from gonio.fitting.objective.automatic import AUTO
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.solver import Progress, Solver, silent
from gonio.fitting.solution import Solution
from gonio.measured import dataset
from gonio.measured.dataset import is_degree
from gonio.measured.polarisers import unpolarised
from gonio.model import Model
from gonio.processes import crew

RACED = 1000  # points on which models are compared: a scan has some hundred
VALIDATED = 5_000  # points of a scan that is validated as a whole, unless that is asked for
FEWEST_ANGLES = 3  # of incidence, so that two are left when one is left out
BLOCKS = "5"  # what is left out of a scan of fewer: each in turn of so many parts of blocks of directions
NOTHING = "none"  # to leave out


def _finite(value: float | None) -> float | None:
    """For JSON, which has neither NaN nor infinity."""
    return value if value is not None and math.isfinite(value) else None


@dataclass(frozen=True)
class Answer:
    """What was found about one scan.

    rows: the models that were validated, or else fitted, the best first; the first is of all points. problem: that of
    the first. dropped: the others, with the error of the first look, a root of E on few points: that look or a fit by
    few searches said that they do not come first. raced: on how many points
    models were compared. left_out: what was left out in turn, or nothing. contradicted: values of the scan that no fit
    was shown.
    """

    rows: Sequence[Row]
    problem: Problem
    verdict: Verdict
    dropped: Mapping[str, float] = field(default_factory=dict)
    raced: int = 0
    left_out: str = ""
    contradicted: Sequence[Contradiction] = ()

    @property
    def best(self) -> Row:
        """The model that predicts best."""
        return self.rows[0]

    @property
    def tried(self) -> list[dict[str, Any]]:
        """Every model with its left-out error in the metric of the weighting, None for those that were dropped."""
        fitted = [{"model": r.model.name, "validated": _finite(r.validated.get(r.metric))} for r in self.rows]
        return fitted + [{"model": name, "validated": None} for name in self.dropped]

    def with_record(self) -> "Answer":
        """The same, with the record in the attributes of the best solution, so that it is kept with it."""
        solution = self.best.solution
        text = json.dumps(self.record(), ensure_ascii=False, allow_nan=False)
        kept = Solution(solution.dataset.assign_attrs(answer=text), solution.model)
        return replace(self, rows=[replace(self.best, solution=kept), *self.rows[1:]])

    def record(self) -> dict[str, Any]:
        """The answer beside the fit itself, as plain data."""
        attrs, best = self.best.solution.dataset.attrs, self.best
        validated = {name: _finite(value) for name, value in best.validated.items()}
        found = {
            name: value for name, value in self.verdict._asdict().items() if name not in ("model", "metric", "grade")
        }
        return {
            "weighting": {"name": attrs["weighting"], "reason": attrs["weighting_reason"] or "it was asked for"},
            "metric": best.metric,
            "validated": validated | {"by": self.left_out} if validated else {},
            "verdict": {"grade": self.verdict.grade}
            | {name: _finite(value) for name, value in found.items()}
            | {"words": self.verdict.words},
            "tried": self.tried,
            "compared_on": self.raced,
            "contradicted": contradicted_record(self.contradicted),
        }


def answer(
    scan: xr.Dataset,
    models: Sequence[Model] = (),
    asked: Asked | None = None,
    watch: Watch | None = None,
    **options: Any,
) -> Answer:
    """The best of some models, or of the whole catalogue, for a scan; `options` are those of ProblemOptions."""
    asked, watch = asked or Asked(), watch or Watch()
    models = tried(scan, list(models or everything()))
    if is_degree(scan):
        models = [model for model in models if model.polarised] if is_everything(models) else models
    elif not all(model.polarised for model in models):
        scan = unpolarised(scan)
    scan, contradicted = (scan, []) if asked.keep_all else consistent(scan)
    settings = settled(scan, options)
    is_race = asked.race and len(models) > 1
    problems = problems_of(*_raced(scan, models, settings)) if is_race else problems_of(scan, models, settings)
    raced = len(problems[0].measured)
    left_out = _left_out(problems, asked.left_out)
    with crew(asked.workers) as shared:
        looks: dict[int, float] = {}
        order = longest_first(problems)
        for some in (order[:FIRST], order[FIRST:]) if is_race else ():
            look = functools.partial(first_look, least=min(looks.values(), default=math.inf))
            for index, error in shared(look, [problems[k] for k in some]):
                looks[some[index]] = error
                watch.progress(LOOKED * len(looks) / len(models), models[some[index]].name)
        runners = worth_fitting(looks) if is_race else order
        run = Run(problems, left_out, asked, watch, shared, len(runners))
        rows = run.race(runners, looks) if is_race else run.fitted(runners)
    rows = ordered(rows, asked.by) if left_out or asked.by or not is_race else sorted(rows, key=_unvalidated)
    problem = next(p for p in problems if p.model.name == rows[0].model.name)
    if is_race and raced < dataset.points(scan).sizes["direction"]:
        problem = Problem(problem.model, scan, **for_model(problem.model, models, settings))
        rows[0] = _of_all(problem, rows[0], asked)
    names = {row.model.name for row in rows}
    dropped = {models[k].name: looks[k] for k in sorted(looks, key=lambda k: looks[k]) if models[k].name not in names}
    found = Answer(rows, problem, verdict(rows[0], problem.points), dropped, raced, left_out, contradicted)
    return found.with_record()


def _raced(
    scan: xr.Dataset, models: Sequence[Model], settings: ProblemOptions
) -> tuple[xr.Dataset, Sequence[Model], ProblemOptions]:
    """What `problems_of` takes for the points on which models are compared."""
    points = dataset.points(scan)
    rows = sample_rows(points, RACED)
    if len(rows) == points.sizes["direction"]:
        return scan, models, settings
    weights = settings.point_weights
    settings = replace(settings, point_weights=None if weights is None else weights[rows])
    return points.isel(direction=rows), models, settings


def everything() -> list[Model]:
    """Every model of the catalogue that a search tries for any scan without its name being given."""
    from gonio.models import catalogue

    return [model for model in catalogue.values() if not (model.only_named or model.for_turned)]


def tried(scan: xr.Dataset, models: list[Model]) -> list[Model]:
    """The models, and where they are all that a search tries and the surface was turned, those for such a surface."""
    from gonio.models import catalogue

    if not (is_everything(models) and dataset.is_turned(scan)):
        return models
    return models + [model for model in catalogue.values() if model.for_turned and model not in models]


def polarised() -> list[Model]:
    """The models of the catalogue that know polarisation, by their Mueller matrices."""
    return [model for model in everything() if model.polarised]


def is_everything(models: Sequence[Model]) -> bool:
    """Whether every model of the catalogue is tried, of which those without polarisation know no degree of it."""
    return {model.name for model in everything()} <= {model.name for model in models}


def _unvalidated(row: Row) -> tuple[float, int]:
    """By what models are ranked where nothing can be left out: AICc, which counts the values; else by their number."""
    return (row.aicc if math.isfinite(row.aicc) else math.inf), row.free_parameters


def _of_all(problem: Problem, raced: Row, asked: Asked) -> Row:
    """The row of a model fitted to all points, validated on all where they are not too many, else as it was raced."""
    whole = len(problem.measured) <= VALIDATED
    row = assessed(problem, asked.solver, raced.left_out if whole else "", asked.covariance, asked.correction)
    if whole:
        return row
    return replace(
        row,
        validated=raced.validated,
        by_fold=raced.by_fold,
        left_out=raced.left_out,
        judged_left_out=raced.judged_left_out,
        validated_plain=raced.validated_plain,
        intervals=raced.intervals,
    )


def _left_out(problems: Sequence[Problem], asked: str) -> str:
    """What is left out in turn, or nothing where the scan has no two parts that predict each other."""
    if asked == NOTHING:
        return ""
    if asked != AUTO:
        return asked
    points = problems[0].points
    if points.sizes["direction"] > VALIDATED:
        return ""
    enough = len(np.unique(points["theta_i"].values)) >= FEWEST_ANGLES
    ways = ("theta_i", BLOCKS) if enough else (BLOCKS,)
    return next((by for by in ways if all(predictable(problem, by) for problem in problems)), "")


def fit(
    problem: Problem | xr.Dataset,
    model: Model | str | Sequence[Model | str] = (),
    *,
    solver: Solver | None = None,
    progress: Progress = silent,
    covariance: str = DEFAULT,
    asked: Asked | None = None,
    **options: Any,
) -> Solution:
    """Fit a scan: by the best of many models, by one, or as a problem says.

    Without a model the whole catalogue is tried, under the weighting that the data ask for, and ranked by what each
    model predicts at directions that its fit was not shown.

    Parameters
    ----------
    problem : xarray.Dataset or Problem
        A scan; or a Problem, whose values of least E (guo2023, eq 11) are found.
    model : Model, str, or a sequence of them
        The models to try, by name or as objects; none stands for the whole catalogue. A Problem has its own.
    solver : Solver, optional
        `gonio.fitting.Projection()` unless another is given.
    progress : callable
        Called with the part of the work that is done, 0 to 1.
    covariance : str
        `robust` and `scaled` estimate the noise from the residuals; `absolute` takes the standard uncertainty that the
        scan states.
    asked : Asked, optional
        How the best of several models is looked for.
    **options
        For a scan the options of a `Problem`, such as `held={"index": 1.5}`.

    Returns
    -------
    Solution
        Values, uncertainties, status and metrics; `solution.answer` has the verdict and the models that were tried. A
        search that does not end at a good minimum raises nothing: the status says what is wrong.

    Raises
    ------
    ValueError
        Options are given beside a Problem, a model is not known, or the data do not allow what is asked for.

    Examples
    --------
    >>> import gonio
    >>> solution = gonio.fit(gonio.sample("coating"), "ggx", held={"index": 1.5, "extinction": 0.0})
    >>> str(solution.status)
    'converged'

    """
    if isinstance(problem, Problem):
        if model or options or asked:
            raise ValueError(
                "a Problem has its model and its options already: give them to the Problem, or give a scan"
            )
        return fitting.fit(problem, solver, progress, covariance)
    asked = replace(asked or Asked(), covariance=covariance, solver=solver)
    watch = Watch(lambda fraction, what: progress(fraction))
    return answer(problem, _models(model), asked, watch, **options).best.solution


def _models(asked: Model | str | Sequence[Model | str]) -> list[Model]:
    from gonio.models import catalogue

    some = [asked] if isinstance(asked, Model | str) else asked
    return [catalogue[one] if isinstance(one, str) else one for one in some]
