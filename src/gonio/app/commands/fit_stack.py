"""`gonio fit-stack`: one model fitted to every scan of a stack, on all cores or on a cluster."""

import logging
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import typer

from gonio import catalogue
from gonio.app import talk
from gonio.app.help_page import Example
from gonio.app.options import ModelName, OutputOptions
from gonio.app.output import progress_bar
from gonio.app.views.stacks import fitted as view_of_fits
from gonio.app.views.stacks import made as view_of_stack
from gonio.files import refuse_existing
from gonio.fitting.covariance_kinds import COVARIANCES, DEFAULT
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.search.projection import FOR_MANY
from gonio.fitting.search.solvers import SearchOptions
from gonio.fitting.stack.lock import refuse_held
from gonio.fitting.stack.manifest import Manifest
from gonio.fitting.stack.run import LANES_OF_BLOCK, StackFit, prepare
from gonio.options import Option, Panel, one_of
from gonio.processes.ending import last_words
from gonio.stacking import stack as make_stack
from gonio.stacking.reuse import is_folder_of_files, is_made_of

if TYPE_CHECKING:
    from gonio.fitting.stack.run import Run

EXAMPLES = (
    Example(
        "gonio fit-stack stack.zarr --model lambert --out fits.zarr",
        "Fit every scan; the same line goes on after a crash",
    ),
    Example("gonio fit-stack wafers --model lambert --out fits.zarr", "Make a stack of a folder of scans, and fit it"),
    Example(
        "gonio fit-stack stack.zarr --model lambert --out log.zarr --weighting log",
        "In logarithms: every decade counts alike",
    ),
    Example(
        "gonio fit-stack stack.zarr --model lambert --out f.zarr --precision float32",
        "In single precision",
    ),
    Example(
        "gonio fit-stack stack.zarr --model lambert --out fits.zarr --force",
        "Start anew, whatever is there",
    ),
)


@dataclass(frozen=True, kw_only=True)
class StackOptions:
    """What of a stack is one fit, and which uncertainties its values get."""

    PANEL: ClassVar = Panel.DATA
    each: Annotated[
        tuple[str, ...],
        Option("fit each value of this coordinate for itself, not jointly: wavelength", metavar="COORD"),
    ] = ()
    covariance: Annotated[
        str,
        Option(
            f"where uncertainties come from: {one_of(COVARIANCES)} (the uncertainties in the scans)",
            panel=Panel.UNCERTAINTY,
            names=tuple(COVARIANCES),
        ),
    ] = DEFAULT


@dataclass(frozen=True, kw_only=True)
class ClusterOptions:
    """Which processes fit the blocks, and on what."""

    PANEL: ClassVar = Panel.CLUSTER
    precision: Annotated[str, Option("numbers to compute with: float64 or float32", names=("float64", "float32"))] = (
        "float64"
    )
    device: Annotated[str, Option("cpu or gpu; without it JAX chooses", metavar="cpu|gpu", names=("cpu", "gpu"))] = ""
    block: Annotated[int, Option("scans fitted at once; a crash loses the blocks that are not written", lowest=1)] = (
        LANES_OF_BLOCK
    )
    workers: Annotated[
        int, Option("number of processes of one thread each; 0 is one a core, on a GPU one in all", lowest=0)
    ] = 0
    scheduler: Annotated[str, Option("address of a Dask scheduler whose workers do the fits", metavar="tcp://..")] = ""

    @property
    def processes(self) -> int:
        """How many workers to start, 0 for one a core; one in all on a device whose memory they could not share."""
        alone = self.device not in ("", "cpu") and not self.scheduler
        return self.workers or int(alone)


def command(
    stack: Annotated[
        list[Path],
        typer.Argument(
            metavar="STACK.zarr|FOLDER|FILE",
            help="scans side by side in a Zarr store; or a folder of scans or several files, of which a store is made",
            show_default=False,
        ),
    ],
    model: ModelName,
    out: Annotated[
        Path, Option("where the results go, and the list of what is done", metavar="OUT.zarr", panel=Panel.OUTPUT)
    ],
    fits: StackOptions,
    problem: ProblemOptions,
    search: SearchOptions,
    cluster: ClusterOptions,
    output: OutputOptions,
) -> None:
    """Fit one model to every scan of a stack, on all cores or a cluster.

    STACK.zarr holds brdf over directions (and sets fitted jointly, such as channel) and over any other dimensions:
    sample, x, y. Each place along these is one fit, with its own values, uncertainties and status in OUT.zarr, which
    xarray.open_zarr opens.

    Scans are fitted in blocks, and a manifest in OUT.zarr says which are written. After Ctrl-C, a crash or a power cut
    the same command goes on with the others; with other options it is refused, unless --force starts anew.

    Of a folder or several files a stack is made first, as gonio stack does, beside the results: OUT-stack.zarr.

    Without --scheduler the workers are processes on this machine. Those of a scheduler need gonio and the same paths.
    """
    if output.json not in ("", "-"):
        refuse_existing(Path(output.json), output.force)
    settings: dict[str, Any] = {"covariance": fits.covariance, "precision": cluster.precision, "device": cluster.device}
    settings["solver"] = search.chosen(FOR_MANY)
    scans = _one_stack(stack, out, output.force)
    asked = StackFit(catalogue[model], scans, out, fits.each, problem, settings, cluster.block)
    run = prepare(asked, output.force)
    seconds = _fitted(run, cluster, output.force) if run.todo else 0.0
    record = view_of_fits.record(run, scans, out, seconds)
    output.show(record, view_of_fits.lines(record))


def _one_stack(given: list[Path], out: Path, force: bool) -> Path:
    """The stack that is named; of a folder or several files one that is made beside the results, or was before."""
    if len(given) == 1 and not is_folder_of_files(given[0]):
        return given[0]
    refuse_held(Manifest(out).folder)  # a run that is at work reads its stack
    made = out.with_name(f"{out.stem}-stack{out.suffix or '.zarr'}")
    if is_made_of(made, given):
        talk.tell(f"the stack {made} was made of these files before")
        return made
    with progress_bar("stacking") as bar:
        done = make_stack(given, made, force=force, progress=bar)
    view_of_stack.warn_of_skipped(done)
    for line in (f"made the stack {made} of {len(done.names)} scans, as gonio stack does", *done.notes[1:]):
        talk.tell(line)
    return made


def _fitted(run: "Run", asked: ClusterOptions, force: bool) -> float:
    """Fit the blocks that are not written yet, and tell of it; how long that took [s] with the workers there."""
    from gonio.fitting.stack.cluster import connected, fit_blocks

    blocks = run.job.blocks
    done = sum(map(blocks.size, run.done))
    if run.resumed:
        talk.tell(f"resuming: {len(run.done)} of {len(blocks)} blocks are there")

    def stopped() -> str:
        there, same = len(run.manifest.written()), "the same command" + " without --force" * force
        return f"stopped: {there} of {len(blocks)} blocks are there, and {same} goes on with the others"

    progress = progress_bar(f"fitting {run.job.asked.model.name}")
    with last_words(stopped), connected(asked.scheduler, asked.processes, run.job.modules) as cluster, progress as bar:
        talk.tell(_where(cluster))
        started = time.perf_counter()
        bar(done / blocks.lanes)
        for record in fit_blocks(cluster.client, run):
            done += record.lanes
            bar(done / blocks.lanes)
        return time.perf_counter() - started


def _where(cluster: Any) -> str:
    """Who fits, and where to watch it."""
    threads = cluster.client.nthreads()
    who = f"{len(threads)} worker{'s' * (len(threads) != 1)}" + (" on this machine" if cluster.is_local else "")
    if cluster.dashboard:
        return f"{who}; dashboard at {cluster.dashboard}"
    logging.getLogger(__name__).info("no dashboard, which needs bokeh: pip install 'gonio[cluster]'")
    return who
