"""How good one fit is: over the points that it was fitted to, and over points that were left out."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from gonio.comparison.corrected import Intervals, predicted
from gonio.comparison.metrics import Judged, judged, least, metrics, metrics_by_incidence
from gonio.completion import Correction
from gonio.fitting.certainty.hold_out import SETTLED
from gonio.fitting.objective.problem import Problem
from gonio.fitting.quantiles import student_t
from gonio.fitting.solution import Solution
from gonio.model import Model
from gonio.resampling.difference import FLOOR

Values = npt.NDArray[np.float64]
FEWEST_PARTS = 5  # of a validation that says which models predict alike
VALIDATED = ("log10_rmse", "delta", "E")  # metrics of what was left out


@dataclass(frozen=True)
class Row:
    """One fit of one scan, and how good it is: a row of a ranking.

    Parameters
    ----------
    solution : Solution
        The fit.
    free_parameters : int
        How many values were free.
    metrics : mapping
        Over all points in use, by name of METRICS.
    judged, judged_left_out : Judged
        How many of the points lg RMSE leaves out or floors: of all, and of those that were left out.
    by_incidence : mapping
        The metrics for each incidence angle [deg].
    aicc, bic : float
        Information criteria.
    farthest : float
        Largest theta_r [deg] of the scan.
    metric : str
        The metric of the weighting, by which models of the scan are ranked.
    left_out : str
        What was left out, as `hold_out.folds` takes it; empty where nothing was.
    validated, by_fold : mapping
        The metrics over the points that were left out, and `metric` of each left-out part; both empty where nothing
        was. Of corrected predictions where a correction was asked for.
    validated_plain : mapping
        Those of the model alone, where a correction was asked for.
    intervals : Intervals
        How often the 95 % intervals of corrected predictions hold what was measured, or None.

    """

    solution: Solution
    free_parameters: int
    metrics: Mapping[str, float]
    judged: Judged
    by_incidence: Mapping[float, Mapping[str, float]]
    aicc: float
    bic: float
    farthest: float
    metric: str
    validated: Mapping[str, float] = field(default_factory=dict)
    left_out: str = ""
    by_fold: Mapping[str, float] = field(default_factory=dict)
    judged_left_out: Judged | None = None
    validated_plain: Mapping[str, float] = field(default_factory=dict)
    intervals: Intervals | None = None

    @property
    def model(self) -> Model:
        """The model that was fitted."""
        return self.solution.model

    @property
    def effective_values(self) -> float:
        """How many free values the fit had, effective ones where parameters are smooth."""
        return self.solution.effective_values


def assess(problem: Problem, solution: Solution) -> Row:
    """A fit and its metrics over the points that it was fitted to, E under the weights of the fit.

    AICc and BIC (burnham2002) take the residuals of the fit as independent and Gaussian, with a variance that is fitted
    too; only their differences between models of one scan and one weighting mean something. Where parameters are smooth
    they count effective values.
    """
    modelled = solution.brdf(problem.points)
    floor = floor_of(problem)
    weights = None if problem.logarithmic else problem.root_weights**2
    squares = float(problem.scale * solution.cost)
    return Row(
        solution,
        len(problem.names),
        metrics(problem.points, modelled, weights, floor),
        judged(problem.points, modelled, floor),
        metrics_by_incidence(problem.points, modelled, floor),
        *information_criteria(squares, len(problem.measured), solution.effective_values),
        float(problem.points["theta_r"].max()),
        ranked_by(problem),
    )


def floor_of(problem: Problem) -> float:
    """The value below which a logarithm says nothing, in the unit of the BRDF: a tenth of the noise floor of the fit.

    Without one, or where that is smaller, it is a tenth of the least positive value (`metrics.least`).
    """
    return float(np.fmax(least(problem.points), FLOOR * problem.noise_floor))


def ranked_by(problem: Problem) -> str:
    """The metric of the weighting, by which models are ranked: lg RMSE in logarithms, else E under the weights.

    Another metric may be small for a model that misses what the fit was asked for, or the other way round.
    """
    return "log10_rmse" if problem.logarithmic else "E"


def information_criteria(squares: float, points: int, free: float) -> tuple[float, float]:
    """AICc and BIC (burnham2002) of a sum of squared residuals; NaN where the points do not outnumber the values.

    With n points, k values (those of the fit and the variance) and the sum S of squares, AICc is
    n ln(S/n) + 2 k + 2 k (k + 1)/(n - k - 1) and BIC is n ln(S/n) + k ln n.
    """
    k = free + 1
    if points <= k + 1:
        return math.nan, math.nan
    deviance = points * math.log(max(squares, np.finfo(float).tiny) / points)
    return deviance + 2 * k + 2 * k * (k + 1) / (points - k - 1), deviance + k * math.log(points)


def validate(
    problem: Problem, row: Row, by: str, settled: float = SETTLED, correction: Correction | None = None
) -> Row:
    """Cross-validate one fit: predict the parts of a scan that the fit is not shown.

    Parameters
    ----------
    problem : Problem
        What was fitted.
    row : Row
        Its fit, as `assess` or `gonio.compare` gives it.
    by : str
        What is left out in turn: `theta_i`, `out-of-plane`, or a number of blocks.
    settled : float
        The relative change of E at which the search of a part ends, as `hold_out.predictions` takes it.
    correction : Correction, optional
        The predictions are corrected by what is learned from the directions that each fit was shown.

    Returns
    -------
    Row
        The row with `validated`, the metrics over all left-out points, and `by_fold`, the metric of the weighting for
        each part, with the floor of the whole scan and the weights of the fit.

    Raises
    ------
    ValueError
        A part cannot be predicted.

    """
    found = predicted(problem, row.solution, by, settled, correction)
    modelled, parts = found.values, found.parts
    # not where the prediction is finite: every model answers for the same points
    rows = np.flatnonzero(np.logical_or.reduce([part for _, part in parts]))
    floor, left_out = floor_of(problem), problem.points.isel(direction=rows)
    weights = None if problem.logarithmic else problem.root_weights**2
    weights_left_out = weights if weights is None else weights[rows]
    validated = metrics(left_out, modelled[rows], weights_left_out, floor)
    plain = metrics(left_out, found.plain[rows], weights_left_out, floor) if correction else {}
    by_fold = {}
    for name, part in parts:
        points = problem.points.isel(direction=np.flatnonzero(part))
        by_fold[name] = metrics(points, modelled[part], weights if weights is None else weights[part], floor)[
            row.metric
        ]
    return replace(
        row,
        validated={name: validated[name] for name in VALIDATED},
        by_fold=by_fold,
        left_out=by,
        judged_left_out=judged(left_out, modelled[rows], floor),
        validated_plain={name: plain[name] for name in VALIDATED if name in plain},
        intervals=found.intervals,
    )


def scored_parts(row: Row) -> list[str]:
    """The left-out parts that have an error: one without any positive measurement has no lg RMSE, for no model."""
    return [name for name, error in row.by_fold.items() if not math.isnan(error)]


def behind(row: Row, best: Row) -> tuple[float, float]:
    """By how much a model's left-out error exceeds the best one's: mean over the parts and its standard error.

    NaN for the error with fewer than two parts, and for both where a model predicts no number somewhere. `alike`
    says whether the difference means anything.
    """
    differences = np.array([row.by_fold[name] - best.by_fold[name] for name in scored_parts(best)])
    if differences.size < 2 or not np.isfinite(differences).all():
        return float(np.mean(differences)) if differences.size else math.nan, math.nan
    return float(np.mean(differences)), float(np.std(differences, ddof=1) / math.sqrt(differences.size))


def alike(row: Row, best: Row) -> bool | None:
    """Whether two models predict alike: the difference lies within its 95 % interval by Student's t over the parts.

    None with fewer than FEWEST_PARTS parts, which say too little about their own scatter. The parts share most of what
    was fitted, so their errors are correlated, and the interval is rather too short than too long.
    """
    parts = len(scored_parts(best))
    if parts < FEWEST_PARTS:
        return None
    mean, error = behind(row, best)
    return abs(mean) <= float(student_t(parts - 1, 0.975)) * error
