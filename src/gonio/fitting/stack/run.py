"""The fit of a stack in a store, block by block: what a run is, and how one of its blocks is fitted.

`prepare` compares what is asked with the manifest of the store of results. It gives a Run: either a new one, or the
continuation of the same run, with the blocks that are still to be fitted. `fit_block` fits one block in the process
that calls it, and `cluster` spreads these calls over many. All that a process needs is in the Job and in the stores.

Two runs are the same if everything is the same on which the results depend, down to the versions of the libraries whose
rounding shows in the last digits. So all blocks of a store come from the same computation, to the last bit on like
processors. The measured values of the stack are the exception: they may be terabytes, and are not compared.
"""

import functools
import os
import socket
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import xarray as xr

from gonio.files import FormatError, naming, refuse_existing, refuse_overlap, replacing
from gonio.fitting.choosing import choice_for
from gonio.fitting.objective.automatic import AUTO
from gonio.fitting.objective.from_scan import HALF_WIDTH
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.objective.problem import Problem
from gonio.fitting.stack import lock
from gonio.fitting.stack import store as lane_store
from gonio.fitting.stack.manifest import BlockGrid, Manifest, Record, difference, digest_of, plain
from gonio.measured.stack import lane_dims, one_scan
from gonio.measured.stack_store import identity, open_stack
from gonio.model import Model
from gonio.processes.portable import peak_megabytes

FitMany = Callable[..., xr.Dataset]
LANES_OF_BLOCK = 2048  # tasks then take half a second and more
_VERSIONED = ("gonio", "numpy", "scipy", "jax", "jaxlib")  # packages whose versions the last digits depend on


@dataclass(frozen=True)
class StackFit:
    """What is to be fitted: a model to every lane of the stack in the store `stack`, with results in the store `out`.

    each: dimensions of sets, such as wavelength, whose values are fitted one at a time and not jointly.
    problem: the options of every lane's Problem. settings: the other arguments of `fit_many`, such as solver and
        covariance.
    block: the largest number of lanes in a block. A block is what one task fits, and what is lost in a crash.
    fit_many: a function to use in place of `fitting.fit_many`, which needs JAX. Workers import it by its name.
    Paths become absolute, because a worker may run in another folder.
    Raises ValueError where a parameter is held at the half width of a scan, as each scan of a stack has its own, and
    where `out` is the stack, or lies inside or around it.
    """

    model: Model
    stack: Path
    out: Path
    each: tuple[str, ...] = ()
    problem: ProblemOptions = field(default_factory=ProblemOptions)
    settings: Mapping[str, Any] = field(default_factory=dict)
    block: int = LANES_OF_BLOCK
    fit_many: FitMany | None = None

    def __post_init__(self) -> None:
        for name in [name for name, value in self.problem.held.items() if value == HALF_WIDTH]:
            raise ValueError(
                f"--hold {name}={HALF_WIDTH} reads one scan, and a stack has many: hold {name} at a number"
            )
        for name in ("stack", "out"):
            object.__setattr__(self, name, Path(getattr(self, name)).absolute())
        refuse_overlap(self.out, [self.stack])


@dataclass(frozen=True)
class Job:
    """What a process needs to fit any block. It is sent with every task, so it is small: all data stay in the stores.

    digest: the SHA-256 of the declaration. Jobs are compared and hashed by it alone, so that `_prepared` can find a job
        that was sent again: the other fields are copies each time, and may not be hashable.
    """

    digest: str
    asked: StackFit = field(compare=False)
    blocks: BlockGrid = field(compare=False)

    @property
    def out(self) -> Path:
        """The store of the results."""
        return self.asked.out

    def search(self) -> FitMany:
        """The function that fits a block: the job's own, or `fit_many`, which needs JAX."""
        if self.asked.fit_many is not None:
            return self.asked.fit_many
        from gonio.fitting.many.fit_many import fit_many

        return fit_many

    @property
    def modules(self) -> tuple[str, ...]:
        """The modules that a process needs for its first block, for `connected` to load ahead.

        The first two load JAX, which takes a second.
        """
        return () if self.asked.fit_many else ("gonio.fitting.many.starts", "gonio.fitting.many.covariance", "zarr")

    def prepared(self) -> tuple[Problem, xr.Dataset]:
        """The Problem that stands for every lane, and the opened stack, whose values are still in the store.

        Lanes share their directions, so one Problem is enough: `fit_many` puts each lane's values in place.
        """
        stack = open_stack(self.asked.stack)
        with _naming(self.asked.stack):
            scan = one_scan(stack, lane_dims(stack, self.asked.each))
            # without the reason of a weighting, which says to `fit_many` that it may choose: it would for each block
            options = replace(self.asked.problem, weighting_reason="")
            return Problem(self.asked.model, scan, **options.given()), stack


@contextmanager
def _naming(stack: Path) -> Iterator[None]:
    """Put the name of the store before any ValueError about the scans in it, which does not say where they are from."""
    try:
        yield
    except ValueError as error:
        raise ValueError(f"{stack}: {error}") from error


@functools.lru_cache(maxsize=2)
def _prepared(job: Job) -> tuple[Problem, xr.Dataset]:
    """`Job.prepared`, once in a process: the stack is opened and the problem made for its first block alone."""
    return job.prepared()


@dataclass(frozen=True)
class Run:
    """One call's work on a job.

    done: the blocks that were written before. begun: how often a computation of each of the others had begun before, so
        that deaths of workers are counted from here on.
    fresh: makes the store of results; None where there is one to go on with.
    """

    job: Job
    done: frozenset[int]
    begun: Mapping[int, int]
    fresh: Callable[[], None] | None = None

    @property
    def resumed(self) -> bool:
        """Whether this continues a run whose store was there already."""
        return self.fresh is None

    @contextmanager
    def held(self) -> Iterator[None]:
        """The store of results begun and locked while the blocks are fitted; ValueError where another run holds it."""
        lock.refuse_held(self.manifest.folder)  # before `begin` replaces a store
        self.begin()
        with lock.held(self.manifest.folder):
            _refuse_other_run(self.job, self.manifest)  # which may have begun and ended before the workers were there
            yield

    def begin(self) -> None:
        """Make the store of results if there is none to go on with.

        Called only when workers are ready, so that old results, which `force` replaces, stay if anything fails before.
        """
        if self.fresh:
            self.fresh()

    @property
    def manifest(self) -> Manifest:
        """The manifest of the store of the results."""
        return Manifest(self.job.out)

    def attempts(self, block: int) -> int:
        """How many computations of a block that is not written have begun in this run, on any worker."""
        return len(self.manifest.starts(block)) - self.begun.get(block, 0)

    @property
    def todo(self) -> list[int]:
        """The blocks that were not written when the run began."""
        return [block for block in range(len(self.job.blocks)) if block not in self.done]


def prepare(asked: StackFit, force: bool = False) -> Run:
    """Begin a fit of a stack, or continue the same fit where it stopped. Nothing is written yet.

    As much as possible is refused here, before workers are started and before old results are touched.
    Raises FormatError where the stack cannot be opened; ValueError where it has no lanes, for options that the model or
    `fit_many` refuses, or where `out` holds another run and `force` is False; FileExistsError where `out` is something
    else than a store of results and `force` is False.
    """
    opened = open_stack(asked.stack)
    with _naming(asked.stack):
        lanes = lane_dims(opened, asked.each)
    blocks = BlockGrid.of({dim: opened.sizes[dim] for dim in lanes}, asked.block)
    if not blocks.lanes:
        empty = " and ".join(d for d in lanes if not opened.sizes[d])
        raise ValueError(f"{asked.stack} holds no scan: its {empty} is empty")
    with _naming(asked.stack):
        asked = _weighted(asked, opened, lanes)
    declared = _declared(asked, opened, blocks)
    job = Job(digest_of(declared), asked, blocks)
    manifest = Manifest(asked.out)
    existing = manifest.run()
    lock.refuse_held(manifest.folder)
    if existing is None:
        refuse_existing(asked.out, force)
    if existing is None or force:
        return Run(job, frozenset(), {}, _fresh(job, opened, declared, force))
    if change := difference(existing, declared):
        raise ValueError(
            f"{asked.out} holds the fit of another run: {change}; choose another --out, or --force to start anew"
        )
    job.search()
    # A mark of another run vouches for nothing here, however it came into this store.
    done = frozenset(record.block for record in manifest.records() if record.run == job.digest)
    return Run(job, done, {block: len(manifest.starts(block)) for block in manifest.begun() - done})


def _weighted(asked: StackFit, opened: xr.Dataset, lanes: tuple[str, ...]) -> StackFit:
    """The same with a weighting: where that is left to the scans, one for all of them, chosen once for all blocks."""
    if asked.problem.weighting != AUTO:
        return asked
    try:
        weighting, floor, reason = choice_for(opened, lanes, asked.problem.noise_floor)
    except RuntimeError as error:  # of a codec
        raise FormatError(asked.stack, f"a chunk of its values is damaged: {error}; write the stack again") from error
    chosen = replace(asked.problem, weighting=weighting, noise_floor=floor, weighting_reason=reason)
    return replace(asked, problem=chosen)


def _declared(asked: StackFit, opened: xr.Dataset, blocks: BlockGrid) -> Any:
    """Everything on which the results depend, as the manifest keeps it; what is not here may differ between calls.

    The model's parameters are part of it beside its name, since a name says nothing of bounds and defaults.
    """
    own = {"fit_many": asked.fit_many} if asked.fit_many else {}
    return plain(
        own
        | {
            "stack": identity(asked.stack, opened),
            "model": {"name": asked.model.name, "parameters": _declaration(asked.model)},
            "problem": asked.problem.given(),
            "each": list(asked.each),
            "fit": dict(asked.settings),
            "block": dict(zip(blocks.dims, blocks.chunk, strict=True)),
            "versions": _versions(),
        }
    )


def _fresh(job: Job, stack: xr.Dataset, declared: Any, force: bool) -> Callable[[], None]:
    """The function that makes the store of results, for `Run.begin`.

    A fit of no lanes shows which variables there will be. It is done now, so that a problem that cannot be fitted is
    refused now.
    """
    problem, _ = job.prepared()
    empty = job.search()(problem, stack.isel(dict.fromkeys(job.blocks.dims, slice(0, 0))), **job.asked.settings)
    empty = empty.transpose(*job.blocks.dims, ...)
    empty = empty.assign_attrs(weighting_reason=job.asked.problem.weighting_reason)
    coords = {n: c for n, c in stack.coords.items() if c.dims and set(c.dims) <= set(job.blocks.dims)}

    def make() -> None:
        with replacing(job.out, force) as temporary:  # the store appears under its name when it is complete
            temporary.unlink()  # `replacing` makes an empty file, and a store is a folder
            lane_store.create(temporary, empty, coords, job.blocks, declared)

    return make


def fit_block(job: Job, block: int) -> Record:
    """Fit the lanes of one block, write the results, and mark the block as written.

    A block that is marked already is not computed again: its record is returned. Dask computes a task again when the
    worker that finished it dies, and the marked results must not change.
    Raises ValueError for any error, with a message that names the block.
    """
    manifest = Manifest(job.out)
    if manifest.is_written(block) and (record := manifest.record(block)).run == job.digest:
        return record
    try:
        with naming(job.out):
            return _fit_block(job, block, manifest)
    except Exception as error:
        # The messages of these two are sentences; others, such as a KeyError's, mean nothing without their kind.
        kind = "" if isinstance(error, ValueError | OSError) else f"{type(error).__name__}: "
        raise ValueError(f"{job.blocks.words(block)}: {kind}{error}") from error


def _fit_block(job: Job, block: int, manifest: Manifest) -> Record:
    """The steps of `fit_block` for a block that is not marked; the mark comes last, when the chunks are on the disk."""
    _refuse_other_run(job, manifest)
    started = manifest.start(block)
    problem, stack = _prepared(job)
    region = job.blocks.region(block)
    part = stack.isel(region).load()
    result = job.search()(problem, part, **job.asked.settings).transpose(*job.blocks.dims, ...)
    seconds = time.time() - started
    _refuse_other_run(job, manifest)  # which may have begun meanwhile
    lane_store.write(job.out, result, job.blocks, block)
    if len(manifest.starts(block)) > 1:
        lane_store.remove_leftovers(job.out, result, job.blocks, block, started)
    record = Record(
        block=block,
        lanes=job.blocks.size(block),
        host=socket.gethostname(),
        process=os.getpid(),
        started=started,
        written=time.time(),
        seconds=seconds,
        peak_megabytes=peak_megabytes(),
        run=job.digest,
        statuses=lane_store.statuses(result),
        worst=lane_store.worst(result, part, region),
        undetermined=lane_store.undetermined(result),
    )
    _refuse_other_run(job, manifest)
    manifest.mark(record)
    return record


def _refuse_other_run(job: Job, manifest: Manifest) -> None:
    """ValueError where the store is no longer that of this job: another run replaced it."""
    if manifest.digest() != job.digest:
        raise ValueError(f"{job.out} is now the store of another run: nothing more of this one is written")


def _declaration(model: Model) -> dict[str, Any]:
    """The parameters of a model: the weights, and default, bounds and unit of every shape parameter."""
    weights: dict[str, Any] = dict.fromkeys(model.weights, "weight")
    return weights | {n: [p.default, p.lower, p.upper, p.unit] for n, p in model.shape.items()}


def _versions() -> dict[str, str]:
    """The versions of the packages in _VERSIONED, `none` for one that is not installed."""
    versions = {}
    for name in _VERSIONED:
        try:
            versions[name] = version(name)
        except PackageNotFoundError:
            versions[name] = "none"
    return versions
