"""`gonio measure`: what a plan asks for and its journal lacks, measured on a bench."""

from pathlib import Path
from typing import Annotated

import typer

from gonio import catalogue
from gonio.acquisition import Journal, read_bench, read_journal, read_plan, run
from gonio.app.help_page import Example
from gonio.app.options import OutputOptions
from gonio.app.output import progress_bar, warn
from gonio.app.views.measuring import measured as view
from gonio.options import Option, Panel
from gonio.processes.ending import last_words

EXAMPLES = (
    Example(
        "gonio measure plan.toml --bench bench.toml --log run.jsonl",
        "Measure a plan; the same line goes on after a power cut",
    ),
    Example("gonio measure plan.toml --bench trial.toml --log try.jsonl", "Try the plan on a bench that is computed"),
    Example(
        "gonio measure plan.toml --bench bench.toml --log run.jsonl --json -",
        "The same, with a summary for a program",
    ),
)


def command(
    plan: Annotated[
        Path, typer.Argument(metavar="PLAN.toml", help="what to measure, as gonio plan writes it", show_default=False)
    ],
    bench: Annotated[Path, Option("the devices and their drivers", metavar="BENCH.toml", panel=Panel.MEASUREMENT)],
    log: Annotated[Path, Option("the journal of all readings", metavar="RUN.jsonl", panel=Panel.OUTPUT)],
    output: OutputOptions,
) -> None:
    """Measure a plan on a bench, and go on after a stop.

    Every reading is in the journal, on the disk, before the next begins. After a crash the same command measures what
    the journal lacks, after dark and check direction were read again. However the measurement ends, the shutter is
    closed; a process that is killed at once cannot do that, and the next one does it first.
    """
    asked = read_plan(plan)
    before = read_journal(log) if log.exists() and log.stat().st_size else None
    last = max((one["t_utc"] for one in before.records), default=None) if before else None
    devices = read_bench(bench, asked.conditions, catalogue.__getitem__, last)
    if before and before.torn:
        warn(log, view.tail_line(before, log))
    with Journal(log, asked, devices.described(asked.conditions.filter)) as journal:
        content = journal.content
        total = len(asked.steps)

        def stopped() -> str:
            return f"gonio: stopped: {len(content.done)} of {total} steps are measured; the same command goes on"

        with last_words(stopped), progress_bar("measuring") as bar:
            bar(len(content.done) / total)
            for done in run(asked, devices, journal):
                bar(len(content.done) / total, done["kind"])
        output.show(view.record(content, log), view.lines(content, log))
