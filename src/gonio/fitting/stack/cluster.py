"""A stack fitted by many processes, on this machine or on others, with Dask as the scheduler.

One task fits one block of lanes. A task is sent the number of a block and the small Job. The worker that runs it reads
its scans from the stack's store and writes its results into the store of the results, and only a Record comes back. So
memory and network traffic do not grow with the stack, and a block's result does not depend on the worker.

`fit_blocks` is the loop. It keeps a few tasks at the scheduler and submits the next block whenever one ends. It decides
what to do with a task that failed by the manifest on the disk, because Dask's own account of a death is too coarse.

What this file does not do: fit (`run.fit_block`), write results (`store`), or keep the account of blocks (`manifest`).
Dask and what comes with it are imported inside functions, since they are an optional extra and slow to import.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import xarray as xr

from gonio.files import temporary_folder
from gonio.fitting.search.solver import Progress, silent
from gonio.fitting.stack.manifest import Record
from gonio.fitting.stack.run import Run, StackFit, fit_block, prepare
from gonio.processes import THREADS
from gonio.processes.portable import cores, deaf_to_interrupts, ignore_interrupts

REMEDY = "pip install 'gonio[cluster]'"
TASKS_A_THREAD = 2  # one runs and one waits: memory is bounded, and no worker is idle until the next task arrives
DEATHS = 3  # deaths of workers that a block may cause; the fourth gives it up
MOST_FAILURES = 3  # failed blocks that end the run: the cause is then likely to be shared by all, as a full disk is
PATIENCE = 30  # s until a scheduler must have answered, and s until it must have a worker
# Every library of a worker gets one thread, because there is a process for each core already. XLA takes the size of its
# thread pool from NPROC; its flag alone leaves the parts of one computation to several threads.
ONE_THREAD = dict.fromkeys((*THREADS, "NPROC", "ZARR_THREADING__MAX_WORKERS"), "1") | {
    "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false"
}

# Arrays of a block are made and dropped again and again. Dask's default for glibc gives their memory back to the system
# each time, and the page faults of fetching it again cost a sixth of a worker's time and more. With these two settings
# glibc keeps arrays below 32 MiB, and up to 256 MiB of free memory in all.
KEPT_MEMORY = {"MALLOC_MMAP_THRESHOLD_": str(32 * 2**20), "MALLOC_TRIM_THRESHOLD_": str(256 * 2**20)}

# Dask checks its processes many times a second, which suits tasks of milliseconds. Tasks here take half a second and
# more, and the scheduler shares its core with a worker. Checking less often saved a ninth of a core for two workers.
LOOKED_AFTER = {
    "distributed.admin.tick.interval": "500ms",
    "distributed.admin.system-monitor.interval": "2s",
    "distributed.worker.memory.monitor-interval": "500ms",
    "distributed.worker.profile.enabled": False,
}


@dataclass(frozen=True)
class Cluster:
    """A connection to a scheduler and its workers.

    client: the `distributed.Client`. dashboard: the address of its status page, empty where bokeh is not installed.
    is_local: whether the workers are processes of this machine that end with the run.
    """

    client: Any = field(repr=False)
    dashboard: str
    is_local: bool


def dask_setup(_worker: Any) -> None:
    """Make a new process ignore Ctrl-C; Dask calls this by name in every process that preloads this module.

    A terminal sends Ctrl-C to all processes of a command. Only the first one must act on it, and it ends the others.
    """
    ignore_interrupts()


@contextmanager
def connected(scheduler: str = "", workers: int = 0, preload: Sequence[str] = ()) -> Iterator[Cluster]:
    """A cluster: that of the scheduler at an address such as tcp://host:8786, or else one of processes on this machine.

    workers: how many local processes, of one thread each; 0 starts one for each core. A scheduler has its own workers.
    preload: modules that each local process imports while it starts, so that all of them do it at the same time and not
        in their first task.
    Local processes end when the context does; the workers of a scheduler stay.
    Raises ValueError where Dask is not installed, where the scheduler does not answer within PATIENCE or has no worker,
    and for a number of workers that is negative or given beside a scheduler.
    """
    if workers < 0:
        raise ValueError(f"the number of workers must be at least 1, and is {workers}")
    if scheduler and workers:
        raise ValueError("a scheduler has workers of its own: leave out --workers, or --scheduler")
    try:
        import cryptography  # noqa: F401  # for the keys of a local cluster
        import dask
        import distributed
    except ImportError:
        raise ValueError(f"this needs Dask: {REMEDY}") from None
    with ExitStack() as stack:
        stack.enter_context(dask.config.set(_settings()))
        if scheduler:
            client = stack.enter_context(_remote_client(scheduler))
        else:
            folder = stack.enter_context(temporary_folder())  # Dask's own would stay where a signal ends the program
            stack.enter_context(dask.config.set({"temporary-directory": str(folder)}))
            with deaf_to_interrupts():
                local = stack.enter_context(_local_cluster(workers or cores(), preload))
            client = stack.enter_context(distributed.Client(local, set_as_default=False))
        yield Cluster(client, _dashboard(client), is_local=not scheduler)


def _settings() -> dict[str, Any]:
    """The settings of Dask for local processes.

    The variables must be in the environment before a process starts, because libraries read them when they are loaded.
    Dask sets only those that the user's environment does not have, so a user can still choose others.
    """
    environment = ONE_THREAD | KEPT_MEMORY | _compilation_cache()
    spawned = {f"distributed.nanny.pre-spawn-environ.{name}": value for name, value in environment.items()}
    limits = {"distributed.scheduler.allowed-failures": DEATHS, "distributed.comm.timeouts.connect": PATIENCE}
    return limits | LOOKED_AFTER | spawned


def _compilation_cache() -> dict[str, str]:
    """The folder in which JAX keeps what it compiled, so that later workers and later runs need not compile it again.

    One folder for each machine: machines may share a home folder, and code compiled for one processor need not run on
    another. The time is the shortest compilation [s] that is worth a file.
    """
    import socket

    import pooch

    folder = Path(pooch.os_cache("gonio")) / "compiled" / socket.gethostname()
    return {"JAX_COMPILATION_CACHE_DIR": str(folder), "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0.3"}


def _local_cluster(workers: int, preload: Sequence[str]) -> Any:
    """A scheduler and worker processes on this machine, of one thread each.

    It listens to this machine alone, and takes only clients with the key of this run: whoever can submit a task runs
    code as this user, and a machine may have many.
    """
    import logging

    from distributed import LocalCluster

    return LocalCluster(
        n_workers=workers,
        threads_per_worker=1,
        processes=True,
        security=True,  # TLS with keys that are made now and end with the run
        dashboard_address="127.0.0.1:0",  # any free port: several runs may be active at once
        silence_logs=logging.CRITICAL,  # a dead worker is replaced, and a failed block is reported once, by fit_blocks
        preload=[__name__, *preload],  # this module for its dask_setup
    )


@contextmanager
def _remote_client(scheduler: str) -> Iterator[Any]:
    """A client of the scheduler at an address; ValueError with the command to start what is missing."""
    from distributed import Client

    try:
        # Not the default of Dask: a client that cannot connect stays the default, and arrays could not be stored then.
        client = Client(scheduler, timeout=PATIENCE, set_as_default=False)
    except (OSError, TimeoutError, ValueError, TypeError) as error:  # TypeError: tls:// without certificates
        reason = " ".join(str(error).split())[:120]
        raise ValueError(f"no scheduler answers at {scheduler} ({reason}): start one by `dask scheduler`") from None
    with client:
        try:
            client.wait_for_workers(1, timeout=PATIENCE)
        except TimeoutError:
            raise ValueError(
                f"the scheduler at {scheduler} has no worker: start one by `dask worker {scheduler} --nthreads 1`"
            ) from None
        yield client


def _dashboard(client: Any) -> str:
    """The address of the dashboard; a client has one even without bokeh, but then there is no page behind it."""
    from importlib.util import find_spec

    return str(client.dashboard_link) if find_spec("bokeh") else ""


def fit_blocks(client: Any, run: Run) -> Iterator[Record]:
    """Fit every block that is not written yet, and yield the record of each as soon as it is written.

    At most TASKS_A_THREAD tasks for each thread of the workers are at the scheduler at a time. Where a block fails, the
    others go on. A block whose worker died is computed again, up to DEATHS times.
    Raises ValueError, which names the failed blocks, at the end, or as soon as MOST_FAILURES have failed. The blocks
    that were written by then stay, and another run of the same job goes on from there.
    """
    with run.held():  # only now, with workers there: with --force this replaces the old results
        yield from _fit_blocks(client, run)


def _fit_blocks(client: Any, run: Run) -> Iterator[Record]:
    """The loop of `fit_blocks`, with the store there and locked."""
    from distributed import as_completed

    pending, failed, resubmitted = iter(run.todo), dict[int, str](), Counter[int]()
    tasks: dict[Any, int] = {}
    completed = as_completed(loop=client.loop)

    def submit(block: int) -> None:
        # A pure task is named by its arguments: a block submitted again would be given its own failed task.
        future = client.submit(fit_block, run.job, block, pure=False)
        tasks[future] = block
        completed.add(future)

    def refill() -> None:
        # Threads are counted each time, as workers come and go. There may be none while a dead worker is replaced; one
        # task is submitted even then, because the loop below ends when no task is out.
        room = TASKS_A_THREAD * max(1, sum(client.nthreads().values()))
        while len(tasks) < room:
            block = next(pending, None)
            if block is None:
                return
            submit(block)

    try:
        refill()
        for future in completed:
            block = tasks.pop(future)
            if future.status == "finished":
                yield future.result()
            elif run.manifest.is_written(block):  # by a worker that died before it could report it
                yield run.manifest.record(block)
            elif resubmitted[block] < DEATHS and _is_innocent(future, run, block):
                resubmitted[block] += 1  # counted, because a block could otherwise come back for ever
                submit(block)
            else:
                failed[block] = _reason(future, run, block)
            if len(failed) >= MOST_FAILURES:
                break
            refill()
    finally:
        client.cancel(list(tasks))  # or a scheduler's workers would fit the queue after Ctrl-C or too many failures
    if failed:
        raise ValueError(_failure_message(failed, run))


def _is_innocent(future: Any, run: Run, block: int) -> bool:
    """Whether a task ended through no fault of its block: lost with a worker, or blamed for deaths of others.

    When a worker dies, Dask blames all tasks that were assigned to it, also those that only waited in its queue. The
    manifest knows better: a block that began at most DEATHS times has not caused more deaths than it may.
    """
    return future.status == "lost" or (_is_killed(future) and run.attempts(block) <= DEATHS)


def _is_killed(future: Any) -> bool:
    """Whether Dask gave a task up because too many workers died that it was assigned to."""
    from distributed import KilledWorker

    return future.status == "error" and isinstance(future.exception(), KilledWorker)


def _reason(future: Any, run: Run, block: int) -> str:
    """Why a block failed, in a sentence that names it."""
    name = run.job.blocks.words(block)
    if _is_killed(future):
        return (
            f"{name} ended its worker {max(run.attempts(block), DEATHS + 1)} times, perhaps for lack of memory: "
            "try a smaller --block, or look at its lanes"
        )
    if future.status != "error":
        return f"{name} was returned by the scheduler without a result ({future.status})"
    error = future.exception()
    # fit_block raises ValueError with the block's name in it; anything else comes from Dask and has no name.
    return str(error) if isinstance(error, ValueError) else f"{name}: {error!r}"


def _failure_message(failed: dict[int, str], run: Run) -> str:
    """What went wrong with each block, and how many are written, in one line."""
    written = len(run.manifest.written())
    blocks = f"{len(failed)} block{'s' * (len(failed) > 1)} failed"
    if len(failed) >= MOST_FAILURES:
        blocks += ", and the rest was not tried"
    return f"{'; '.join(failed.values())} ({blocks}; {written} of {len(run.job.blocks)} are there and are kept)"


def fit_stack(
    asked: StackFit,
    *,
    scheduler: str = "",
    workers: int = 0,
    force: bool = False,
    progress: Progress = silent,
) -> xr.Dataset:
    """Fit every lane of a stack, and return the opened store of the results, whose arrays are read when they are used.

    asked: the model, the stack, where the results go, and all options of the fits.
    Where `out` holds the same run, its blocks are kept and only the others are fitted. So a call that was interrupted
    is simply made again; `force` starts anew.
    scheduler, workers: as `connected` takes them. progress: called with the fraction of lanes that are fitted.
    A script that calls this needs the guard `if __name__ == "__main__"`, because a worker is a fresh process that
    imports the script.
    Raises what `prepare`, `connected` and `fit_blocks` raise.
    """
    run = prepare(asked, force)
    if run.todo:
        with connected(scheduler, workers, run.job.modules) as cluster:
            done = sum(run.job.blocks.size(block) for block in run.done)  # lanes, not blocks: border blocks are smaller
            for record in fit_blocks(cluster.client, run):
                done += record.lanes
                progress(done / run.job.blocks.lanes)
    return xr.open_zarr(asked.out)
