"""A stack fitted by many processes, here or on other machines: Dask hands out blocks, what is big stays in stores."""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import xarray as xr

from gonio.fitting.search.solver import Progress, silent
from gonio.fitting.stack.manifest import Record
from gonio.fitting.stack.run import Run, StackFit, fit_block, prepare
from gonio.portable import cores, ignore_interrupts
from gonio.processes import THREADS

REMEDY = "pip install 'gonio[cluster]'"
TASKS_A_THREAD = 2  # at work and waiting: few, so that memory is bounded and no worker waits for the next
DEATHS = 3  # of workers that a block may cause before it is given up
MOST_FAILURES = 3  # blocks that may fail before the others are not tried
PATIENCE = 30  # s until a scheduler answers and has a worker
# What a worker's libraries compute with one thread, because cores are shared out among processes already. XLA takes the
# size of its thread pool from NPROC; its flag alone leaves the parts of one computation to several threads.
ONE_THREAD = dict.fromkeys((*THREADS, "NPROC", "ZARR_THREADING__MAX_WORKERS"), "1") | {
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false"
}

# Arrays of a block are made and dropped again and again. Dask has glibc give all of them back to the system each time,
# whose page faults cost a sixth of a worker's time and more: what is below 32 MiB is kept, 256 MiB in all.
KEPT_MEMORY = {"MALLOC_MMAP_THRESHOLD_": str(32 * 2**20), "MALLOC_TRIM_THRESHOLD_": str(256 * 2**20)}

# Dask looks after its processes many times a second, for tasks of milliseconds. Ours take half a second and more, and
# the scheduler has no core of its own.
LOOKED_AFTER = {
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.system-monitor.interval": "2s",
    "distributed.worker.memory.monitor-interval": "500ms",
    "distributed.worker.profile.enabled": False,
}


@dataclass(frozen=True)
class Cluster:
    """A client of a scheduler, and the address of its dashboard, empty where there is none."""

    client: Any = field(repr=False)
    dashboard: str
    is_local: bool


def dask_setup(worker: Any) -> None:
    """What Dask calls in every process that starts: Ctrl-C is for the one that started it, which ends the others."""
    ignore_interrupts()


@contextmanager
def connected(scheduler: str = "", workers: int = 0, preload: Sequence[str] = ()) -> Iterator[Cluster]:
    """A cluster: that of the scheduler at an address such as tcp://host:8786, or one of processes on this machine.

    workers: how many processes, of one thread each; 0 is one a core. Those of a scheduler are its own.
    preload: modules that each process loads as it starts, side by side, rather than in its first task.
    Raises ValueError where Dask is not installed, or the scheduler does not answer or has no worker.
    """
    if workers < 0:
        raise ValueError(f"the number of workers must be at least 1, and is {workers}")
    if scheduler and workers:
        raise ValueError("the workers of a scheduler are started beside it: leave out --workers, or --scheduler")
    try:
        import dask
        import distributed
    except ImportError:
        raise ValueError(f"this needs Dask: {REMEDY}") from None
    with ExitStack() as stack:
        stack.enter_context(dask.config.set(_settings()))
        if scheduler:
            client = stack.enter_context(_reached(scheduler))
        else:
            local = stack.enter_context(_local(workers or cores(), preload))
            client = stack.enter_context(distributed.Client(local))
        yield Cluster(client, _dashboard(client), is_local=not scheduler)


def _settings() -> dict[str, Any]:
    """Dask's settings; variables of the environment that are set already are left to who set them."""
    environment = ONE_THREAD | KEPT_MEMORY | _compiled()
    spawned = {f"distributed.nanny.pre-spawn-environ.{name}": value for name, value in environment.items()}
    limits = {"distributed.scheduler.allowed-failures": DEATHS, "distributed.comm.timeouts.connect": PATIENCE}
    return limits | LOOKED_AFTER | spawned


def _compiled() -> dict[str, str]:
    """Where JAX keeps what it compiled, for workers to come: by machine, as processors differ."""
    import socket

    import pooch

    folder = Path(pooch.os_cache("gonio")) / "compiled" / socket.gethostname()
    return {"JAX_COMPILATION_CACHE_DIR": str(folder), "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0.3"}


def _local(workers: int, preload: Sequence[str]) -> Any:
    import logging

    from distributed import LocalCluster

    return LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        processes=True,
        dashboard_address="127.0.0.1:0",
        silence_logs=logging.CRITICAL,  # a worker that dies is started anew, and a block that fails is told once
        preload=[__name__, *preload],
    )


@contextmanager
def _reached(scheduler: str) -> Iterator[Any]:
    from distributed import Client

    try:
        client = Client(scheduler, timeout=PATIENCE)
    except (OSError, TimeoutError, ValueError) as error:
        said = " ".join(str(error).split())
        raise ValueError(f"no scheduler answers at {scheduler} ({said[:120]}): start one by `dask scheduler`") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise ValueError(
                f"the scheduler at {scheduler} has no worker: start one by `dask worker {scheduler} --nthreads 1`"
            ) from None
        yield client


def _dashboard(client: Any) -> str:
    from importlib.util import find_spec

    return str(client.dashboard_link) if find_spec("bokeh") else ""


def fit_blocks(client: Any, run: Run) -> Iterator[Record]:
    """Fit every block that is not written yet, and hand out the record of each as it is.

    A few tasks at a time are with the scheduler. Where a block fails, the others go on.
    Raises ValueError, which names the blocks, at the end, or as soon as MOST_FAILURES have failed.
    """
    from distributed import as_completed

    run.begin()
    waiting, failed, again = iter(run.todo), dict[int, str](), Counter[int]()
    tasks: dict[Any, int] = {}
    ended = as_completed()

    def submit(block: int) -> None:
        future = client.submit(fit_block, run.job, block, pure=False)
        tasks[future] = block
        ended.add(future)

    def refill() -> None:
        room = TASKS_A_THREAD * max(1, sum(client.nthreads().values()))
        while len(tasks) < room:
            block = next(waiting, None)
            if block is None:
                return
            submit(block)

    try:
        refill()
        for future in ended:
            block = tasks.pop(future)
            if future.status == "finished":
                yield future.result()
            elif run.manifest.is_written(block):  # by a worker that died before it could say so
                yield run.manifest.record(block)
            elif again[block] < DEATHS and _is_innocent(future, run, block):
                again[block] += 1
                submit(block)
            else:
                failed[block] = _why(future, run, block)
            if len(failed) >= MOST_FAILURES:
                break
            refill()
    finally:
        client.cancel(list(tasks))  # what Ctrl-C leaves in the queue
    if failed:
        raise ValueError(_told(failed, run))


def _is_innocent(future: Any, run: Run, block: int) -> bool:
    """Whether a task was lost with a worker, or given up for deaths of workers in whose queue it only waited."""
    return future.status == "lost" or (_is_killed(future) and run.attempts(block) <= DEATHS)


def _is_killed(future: Any) -> bool:
    from distributed import KilledWorker

    return future.status == "error" and isinstance(future.exception(), KilledWorker)


def _why(future: Any, run: Run, block: int) -> str:
    where = run.job.blocks.words(block)
    if _is_killed(future):
        return (
            f"{where} ended its worker {max(run.attempts(block), DEATHS + 1)} times, perhaps for want of memory: "
            "try a smaller --block, or look at its lanes"
        )
    if future.status != "error":
        return f"{where} was given back by the scheduler ({future.status})"
    error = future.exception()
    return str(error) if isinstance(error, ValueError) else f"{where}: {error!r}"


def _told(failed: dict[int, str], run: Run) -> str:
    there = len(run.manifest.written())
    blocks = f"{len(failed)} block{'s' * (len(failed) > 1)} failed"
    if len(failed) >= MOST_FAILURES:
        blocks += ", and the rest was not tried"
    return f"{'; '.join(failed.values())} ({blocks}; {there} of {len(run.job.blocks)} are there and are kept)"


def fit_stack(
    asked: StackFit,
    *,
    scheduler: str = "",
    workers: int = 0,
    force: bool = False,
    progress: Progress = silent,
) -> xr.Dataset:
    """Fit every lane of a stack, and return the opened store of the results.

    What was written before is kept where `out` holds the same run, so a call that was ended is simply made again;
    `force` starts anew. scheduler, workers: as `connected` takes them.
    A script that calls this needs its guard `if __name__ == "__main__"`, since workers are fresh processes.
    """
    run = prepare(asked, force)
    if run.todo:
        with connected(scheduler, workers, run.job.modules) as cluster:
            done = sum(run.job.blocks.size(block) for block in run.done)
            for record in fit_blocks(cluster.client, run):
                done += record.lanes
                progress(done / run.job.blocks.lanes)
    return xr.open_zarr(asked.out)
