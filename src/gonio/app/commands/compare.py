"""`gonio compare`: several models fitted to scans, and ranked."""

from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Annotated, ClassVar

from gonio.app.answering import AnswerOptions, watched
from gonio.app.correcting import CorrectionOptions
from gonio.app.help_page import Example
from gonio.app.legend import legend
from gonio.app.options import ModelNames, OutputOptions, ScanOptions, Scans, chosen_models
from gonio.app.views import ranking
from gonio.comparison import answer as answering
from gonio.comparison.metrics import METRICS
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.search.solvers import SearchOptions
from gonio.options import Option, Panel, one_of

EXAMPLES = (
    Example("gonio compare scan.csv", "Rank the models that come near to the best of all"),
    Example("gonio compare scan.csv --models ggx,ward,gonio-best", "Rank some models"),
    Example(
        "gonio compare scan.csv --models family --weighting uniform --validate none",
        "The study of the paper: its models, by the squared error of the fit",
    ),
    Example(
        "gonio compare scan.csv --models ggx,ward --validate theta_i --correct",
        "How well corrected models predict an incidence angle that was not measured",
    ),
)


@dataclass(frozen=True, kw_only=True)
class RankingOptions(AnswerOptions):
    """Which models are ranked, and by what."""

    PANEL: ClassVar = Panel.RANKING
    models: ModelNames = ""
    rank: Annotated[
        str,
        Option(
            f"rank by an error of the fit, and not by what was left out: {one_of(METRICS)}",
            metavar="METRIC",
            names=tuple(METRICS),
        ),
    ] = ""
    by_incidence: Annotated[bool, Option("also print the nRMSE at each incidence angle")] = False
    correct: Annotated[
        bool, Option("correct each prediction of what is left out by what the rest of the scan shows beyond the model")
    ] = False


def command(
    scans: Scans,
    ranked: RankingOptions,
    correction: CorrectionOptions,
    problem: ProblemOptions,
    search: SearchOptions,
    scan: ScanOptions,
    output: OutputOptions,
) -> None:
    """Fit several models to scans and rank them, by what each predicts at directions that its fit was not shown.

    Without --models every model of the catalogue is looked at, and those that come near to the best are fitted.
    """
    if ranked.rank and ranked.rank not in METRICS:
        raise ValueError(f"no metric {ranked.rank!r}: choose one of {', '.join(METRICS)}")
    if not ranked.correct:
        correction.refuse_unused("--correct")
    elif ranked.validate == answering.NOTHING:
        raise ValueError("--correct corrects what is left out, and --validate none leaves nothing out: name theta_i")
    models = chosen_models(ranked.models) if ranked.models else answering.everything()
    if not models:
        raise ValueError("--models names no model: there is nothing to compare")
    asked = ranked.asked(
        len(models),
        solver=search.chosen(),
        race=not ranked.models,
        by=ranked.rank,
        correction=correction.chosen if ranked.correct else None,
    )
    answers: list[tuple[Path, answering.Answer]] = []
    for path, data in [(path, scan.read(path)) for path in scans]:
        with watched(path.name) as watch:
            answers.append((path, answering.answer(data, models, asked, watch, **problem.given())))
    lines = (line for path, one in answers for line in ranking.lines(path, one, ranked.rank, ranked.by_incidence))
    meanings = legend([one.rows for _, one in answers], ranked.rank)
    output.show([ranking.record(path, one) for path, one in answers], chain(lines, meanings))
