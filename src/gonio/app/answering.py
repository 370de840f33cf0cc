"""How `fit` and `compare` look for the best model, and what a person sees while they do."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

from gonio.app.options import processes
from gonio.app.output import figure, progress_bar
from gonio.comparison.answer import NOTHING
from gonio.comparison.assessment import Row
from gonio.comparison.metrics import METRICS
from gonio.comparison.ranking import ordered
from gonio.comparison.runs import Asked, Watch
from gonio.fitting.objective.automatic import AUTO
from gonio.options import Option, Panel
from gonio.processes.ending import last_words


@dataclass(frozen=True, kw_only=True)
class AnswerOptions:
    """What models are judged by, and which values take part."""

    PANEL: ClassVar = Panel.RANKING
    validate: Annotated[
        str,
        Option(
            "fit again without some points and judge the model there: theta_i (each incidence angle in turn), "
            f"out-of-plane, a number of parts such as 5, {AUTO}, or {NOTHING}",
            metavar="BY",
            panel=Panel.RANKING,
            names=(AUTO, "theta_i", "out-of-plane", NOTHING),
        ),
    ] = AUTO
    keep_all: Annotated[bool, Option("also fit values that the rest of the scan contradicts", panel=Panel.DATA)] = False
    workers: Annotated[
        int, Option("number of processes that share the models; 0 chooses it", panel=Panel.SOLVER, lowest=0)
    ] = 0

    def asked(self, models: int, **others: Any) -> Asked:
        """The same for the functions that answer."""
        return Asked(left_out=self.validate, keep_all=self.keep_all, workers=processes(self.workers, models), **others)


@contextmanager
def watched(description: str) -> Iterator[Watch]:
    """A bar that names the model; where Ctrl-C ends the program, its last words are the models fitted so far."""
    done: list[Row] = []

    def so_far() -> str:
        if not done:
            return "stopped: no model was fitted in full yet"
        count = "1 model was" if len(done) == 1 else f"{len(done)} models were"
        lines = [f"stopped: {count} fitted in full, the best first"]
        for row in ordered(done):
            error = row.validated[row.metric] if row.validated else row.metrics[row.metric]
            values = ", ".join(f"{name} {figure(value)}" for name, value in list(row.solution.values.items())[:12])
            metric = "left-out " * bool(row.validated) + METRICS[row.metric].title
            lines.append(f"  {row.model.name}: {metric} {figure(error)} ({values})")
        return "\n".join(lines)

    with last_words(so_far), progress_bar(description) as progress:
        yield Watch(progress, done.append)
