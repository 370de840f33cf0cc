"""The command about stacks: one model to thousands or millions of scans, on all cores or on a cluster."""

import sys
import time
from collections import Counter
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from gonio.app.options import Bound, CovarianceKind, Group, Hold, Json, ModelName, NoiseFloor, Share, Weigh
from gonio.app.terminal import app

if TYPE_CHECKING:
    from rich.table import Table

    from gonio.fitting.stack.manifest import Record
    from gonio.fitting.stack.run import Run

Stack = Annotated[
    Path,
    typer.Argument(metavar="STACK.zarr", help="scans side by side in a Zarr store", show_default=False),
]
Out = Annotated[
    Path, typer.Option("--out", metavar="OUT.zarr", help="where the results and the manifest go", show_default=False)
]
Each = Annotated[
    list[str], typer.Option("--each", metavar="COORD", help="fit each value for itself, as in wavelength, not jointly")
]
Starts = Annotated[
    int,
    typer.Option("--starts", metavar="N", help="starts followed for every scan; 0: 2, or 4 from three shape values on"),
]
Block = Annotated[
    int, typer.Option("--block", metavar="N", help="the most scans of a task, which is what a crash costs")
]
Precision = Annotated[str, typer.Option("--precision", help="float64 or float32")]
Device = Annotated[
    str, typer.Option("--device", metavar="NAME", help="cpu or gpu; without it the one that JAX prefers")
]
Processes = Annotated[
    int, typer.Option("--workers", metavar="N", help="processes of one thread each; 0: one a core, one in all for gpu")
]
Scheduler = Annotated[
    str, typer.Option("--scheduler", metavar="tcp://..", help="a Dask scheduler with workers of its own")
]
Anew = Annotated[bool, typer.Option("--force", help="start anew, whatever OUT.zarr holds")]


@app.command("fit-stack")
def fit_stack(
    stack: Stack,
    model: ModelName,
    out: Out,
    hold: Hold = [],  # noqa: B006
    group: Group = [],  # noqa: B006
    share: Share = [],  # noqa: B006
    bound: Bound = [],  # noqa: B006
    each: Each = [],  # noqa: B006
    weighting: Weigh = "uniform",
    noise_floor: NoiseFloor = 0.0,
    covariance: CovarianceKind = "robust",
    starts: Starts = 0,
    precision: Precision = "float64",
    device: Device = "",
    block: Block = 2048,
    workers: Processes = 0,
    scheduler: Scheduler = "",
    force: Anew = False,
    json: Json = "",
) -> None:
    """Fit one model to every scan of a stack, on all cores or on a cluster; a run that was ended goes on.

    STACK.zarr holds brdf over directions (and sets fitted jointly, such as channel) and over any other dimensions:
    sample, x, y. Each place along these is one fit, with its own values, uncertainties and status in OUT.zarr, which
    xarray.open_zarr opens.

    Scans are fitted in blocks, and a manifest in OUT.zarr says which are written. After Ctrl-C, a crash or a power cut
    the same command goes on with the others; with other options it is refused, unless --force starts anew.

    Without --scheduler the workers are processes on this machine. Those of a scheduler need gonio and the same paths.

    Example: gonio fit-stack wafers.zarr --model ggx --group ks=theta_i --out fits.zarr
    """
    from gonio import catalogue
    from gonio.app import arguments, present
    from gonio.files import refuse_existing
    from gonio.fitting.stack.run import prepare

    if json not in ("", "-"):
        refuse_existing(Path(json), force)
    if any(text.endswith(f"={arguments.HALF_WIDTH}") for text in hold):
        raise ValueError("--hold gamma=half-width reads one scan, and a stack has many: hold gamma at a number")
    run = prepare(
        catalogue[model],
        stack,
        out,
        each=tuple(each),
        problem={
            "held": arguments.numbers(hold, "--hold"),
            "grouped": arguments.groups(group),
            "shared": tuple(share),
            "bounds": arguments.bounds(bound),
            "weighting": weighting,
            "noise_floor": noise_floor,
        },
        settings={"starts": starts, "covariance": covariance, "precision": precision, "device": device},
        block=block,
        force=force,
    )
    if device not in ("", "cpu") and not scheduler:
        workers = workers or 1  # each would take the device's memory for itself
    seconds = _fitted(run, scheduler, workers, force) if run.todo else 0.0
    found = _record(run, stack, out, seconds)
    if json:
        present.emit_json(found, json, force)
    if json != "-":
        for part in _summary(found):
            present.console().print(part)


def _tell(line: str) -> None:
    print(line, file=sys.stderr, flush=True)


def _fitted(run: "Run", scheduler: str, workers: int, force: bool) -> float:
    """Fit what is to do, and tell of it; how long that took [s] with the workers there."""
    from gonio.app import present
    from gonio.fitting.stack.cluster import connected, fit_blocks

    blocks = run.job.blocks
    done = sum(map(blocks.size, run.done))
    if run.resumed:
        _tell(f"resuming: {len(run.done)} of {len(blocks)} blocks are there")
    try:
        progress = present.progress_bar(f"fitting {run.job.model.name}")
        with connected(scheduler, workers, run.job.modules) as cluster, progress as bar:
            _tell(_where(cluster))
            started = time.perf_counter()
            bar(done / blocks.lanes)
            for record in fit_blocks(cluster.client, run):
                done += record.lanes
                bar(done / blocks.lanes)
            return time.perf_counter() - started
    except KeyboardInterrupt:
        there, same = len(run.manifest.written()), "the same command" + " without --force" * force
        _tell(f"stopped: {there} of {len(blocks)} blocks are there, and {same} goes on with the others")
        raise typer.Exit(130) from None


def _where(cluster: Any) -> str:
    threads = cluster.client.nthreads()
    who = f"{len(threads)} worker{'s' * (len(threads) != 1)}" + (" on this machine" if cluster.is_local else "")
    if cluster.dashboard:
        return f"{who}; dashboard at {cluster.dashboard}"
    return f"{who}; no dashboard, which needs bokeh: pip install 'gonio[cluster]'"


def _record(run: "Run", stack: Path, out: Path, seconds: float) -> dict[str, Any]:
    """What came of all blocks, as plain data."""
    records = list(run.manifest.records())
    fitted = sum(record.lanes for record in records if record.block not in run.done)
    return {
        "stack": str(stack),
        "out": str(out),
        "model": run.job.model.name,
        "scans": run.job.blocks.lanes,
        "blocks": len(run.job.blocks),
        "blocks_resumed": len(run.done),
        "seconds": seconds,
        "fits_per_second": fitted / seconds if seconds else None,
        "statuses": _statuses(records),
        "worst": max((r.worst for r in records if r.worst), key=lambda worst: worst["cost"], default=None),
    }


def _statuses(records: "Iterable[Record]") -> dict[str, int]:
    total: Counter[str] = Counter()
    for record in records:
        total.update(record.statuses)
    return dict(total.most_common())


def _summary(found: dict[str, Any]) -> "Iterable[Table | str]":
    from gonio.app.present import figure, table

    rows = table("status", "scans", "part")
    for status, count in found["statuses"].items():
        rows.add_row(status.replace("_", " "), f"{count}", f"{100 * count / found['scans']:.2f} %")
    yield rows
    if found["seconds"]:
        yield f"{found['fits_per_second']:.4g} fits a second, {found['seconds']:.3g} s"
    else:
        yield f"nothing to do: {found['blocks']} of {found['blocks']} blocks are there"
    if worst := found["worst"]:
        where = ", ".join(f"{dim} {value}" for dim, value in worst["at"].items())
        yield f"worst: E {figure(worst['cost'])} at {where} ({worst['status'].replace('_', ' ')})"
    yield f"wrote {found['out']}"
