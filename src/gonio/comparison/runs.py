"""The full fits of models that are compared: how many at a time, by which search, and who is told of them."""

import functools
import logging
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

from gonio.comparison.assessment import Row, validate
from gonio.comparison.race import HOPE, RACE
from gonio.comparison.ranking import assessed
from gonio.completion import Correction
from gonio.fitting.certainty.hold_out import SETTLED
from gonio.fitting.covariance_kinds import DEFAULT
from gonio.fitting.objective.automatic import AUTO
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.projection import Projection
from gonio.fitting.search.solver import Solver
from gonio.processes import Crew

ROUGHLY = 1e-4  # relative change of a cost that ends the validation of a model in the race
TOGETHER = 2  # models that are fitted before the least error is looked at: the same whatever the number of workers
FINALISTS = 2  # models at most that are fitted by all searches
CLOSE = 1.15  # times the least left-out error: beyond it more searches do not bring a model to the front
LOOKED, RAN = 0.3, 0.95  # of the time when every model was looked at, and when all were fitted


def _unwatched(fraction: float, what: str = "") -> None:
    """Do nothing with the progress."""


@dataclass(frozen=True, kw_only=True)
class Asked:
    """How an answer is looked for.

    left_out: as `compare` takes it; `auto` is theta_i where the scan has three incidence angles, else five parts of
    blocks of directions; `none` leaves nothing out. by: a metric of the fit to rank by in place of what is left out.
    race: fit only models that a first look finds near to the best; else all. keep_all: fit values that the rest of the
    scan contradicts, too. solver, covariance: as `fitting.fit` takes them. workers: processes that share the models.
    correction: how predictions of what is left out are corrected; None leaves them as they are.
    """

    left_out: str = AUTO
    by: str = ""
    race: bool = True
    keep_all: bool = False
    solver: Solver | None = None
    covariance: str = DEFAULT
    workers: int = 1
    correction: Correction | None = None


def _ignored(row: Row) -> None:
    """Do nothing with a row."""


class Watch(NamedTuple):
    """Who is told how far it is: of the fraction that is done with the last model, and of each row when it is there."""

    progress: Callable[[float, str], None] = _unwatched
    fitted: Callable[[Row], None] = _ignored


@dataclass
class Run:
    """The full fits of some problems, and who is told of them."""

    problems: Sequence[Problem]
    left_out: str
    asked: Asked
    watch: Watch
    shared: Crew
    runners: int
    done: int = 0

    def race(self, runners: Sequence[int], looks: Mapping[int, float]) -> list[Row]:
        """Models in the order of their first looks, TOGETHER at a time, while one may come first.

        They are fitted by few searches. Without hope is a model whose first look is worse than what the best so far
        predicts, and one whose fit is, which is not validated. The best, and a second that is close to it, are then
        fitted by all searches.
        """
        if not self.left_out:
            return self.fitted(runners)
        rows: dict[int, Row] = {}
        least = math.inf
        for start in range(0, len(runners), TOGETHER):
            some = [k for k in runners[start : start + TOGETHER] if looks[k] <= HOPE * least]
            rows |= self._fits(some, RACE if self.asked.solver in (None, Projection()) else self.asked.solver, least)
            least = min([least, *(_root(row, row.validated) for row in rows.values() if row.validated)])
        rows = {k: row for k, row in rows.items() if row.validated}
        if not rows:  # none predicts a number
            return self.fitted(runners)
        order = sorted(rows, key=lambda k: _root(rows[k], rows[k].validated))
        front = [k for k in order if _root(rows[k], rows[k].validated) <= CLOSE * least][:FINALISTS]
        if self.asked.solver in (None, Projection()):
            rows |= self._fits(front, self.asked.solver)
        return list(rows.values())

    def fitted(self, runners: Sequence[int]) -> list[Row]:
        """All of them, by all searches."""
        return list(self._fits(runners, self.asked.solver).values())

    def _fits(self, some: Sequence[int], solver: Solver | None, unless: float = math.inf) -> dict[int, Row]:
        work = functools.partial(_assessed, solver=solver, left_out=self.left_out, asked=self.asked, unless=unless)
        rows = {}
        for index, row in self.shared(work, [self.problems[k] for k in some]):
            rows[some[index]] = row
            self.done += 1
            logging.getLogger(__name__).info("compared %s, %d of %d", row.model.name, self.done, self.runners)
            self.watch.fitted(row)
            part = min(self.done / (self.runners + FINALISTS), 1.0)
            self.watch.progress(LOOKED + (RAN - LOOKED) * part, row.model.name)
        return rows


def _assessed(problem: Problem, solver: Solver | None, left_out: str, asked: Asked, unless: float) -> Row:
    """A problem fitted, and validated where something is left out, unless the fit errs by more than what is given."""
    row = assessed(problem, solver, "", asked.covariance)
    if not left_out or _root(row, row.metrics) > unless:
        return row
    return validate(problem, row, left_out, ROUGHLY if solver == RACE else SETTLED, asked.correction)


def _root(row: Row, metrics: Mapping[str, float]) -> float:
    """An error in the metric of the weighting as a root of E, which first looks have; lg RMSE in natural logarithms."""
    value = metrics[row.metric]
    return value * math.log(10) if row.metric == "log10_rmse" else math.sqrt(value)
