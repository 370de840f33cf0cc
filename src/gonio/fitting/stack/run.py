"""The fit of a stack in a store, block by block: what a run is, and what fitting one of its blocks is."""

import functools
import hashlib
import json
import os
import socket
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import xarray as xr

from gonio.files import refuse_existing, replacing
from gonio.fitting.objective.from_scan import HALF_WIDTH
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.objective.problem import Problem
from gonio.fitting.stack import store as lane_store
from gonio.fitting.stack.manifest import BlockGrid, Manifest, Record, difference, plain
from gonio.measured.stack import lane_dims, one_scan
from gonio.measured.stack_store import identity, open_stack
from gonio.model import Model
from gonio.portable import peak_megabytes

FitMany = Callable[..., xr.Dataset]
LANES_OF_BLOCK = 2048
_MATTERS = ("gonio", "numpy", "scipy", "jax", "jaxlib")  # the versions on which the last digits depend


@dataclass(frozen=True)
class StackFit:
    """What is to be fitted: a model to every lane of the stack in the store `stack`, into the store `out`.

    each: coordinates of sets, such as wavelength, of which each value is fitted for itself.
    problem: the options of each lane's Problem; settings: what `fit_many` takes besides, solver and covariance among
    it.
    block: the most lanes of a block, which is what one task fits and what a crash loses.
    fit_many: another function than `fitting.fit_many`, which needs JAX.
    Raises ValueError for an option that reads one scan, of which a stack has many.
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


@dataclass(frozen=True)
class Job:
    """What a process needs to fit any block; small, since it travels with every task: all data come from the store.

    `digest` tells one job from another, so that a process prepares the problem once.
    """

    digest: str
    asked: StackFit = field(compare=False)
    blocks: BlockGrid = field(compare=False)

    @property
    def out(self) -> Path:
        """The store of the results."""
        return self.asked.out

    def search(self) -> FitMany:
        """`fit_many`, which needs JAX, unless the job brings another."""
        if self.asked.fit_many is not None:
            return self.asked.fit_many
        from gonio.fitting.many.fit_many import fit_many

        return fit_many

    @property
    def modules(self) -> tuple[str, ...]:
        """What a process loads for its first block; JAX, which takes a second, is among it."""
        return () if self.asked.fit_many else ("gonio.fitting.many.starts", "gonio.fitting.many.covariance", "zarr")

    def prepared(self) -> tuple[Problem, xr.Dataset]:
        """The problem of one lane, and the stack, whose values are still in the store."""
        stack = open_stack(self.asked.stack)
        scan = one_scan(stack, lane_dims(stack, self.asked.each))
        return Problem(self.asked.model, scan, **self.asked.problem.given()), stack


@functools.lru_cache(maxsize=2)
def _prepared(job: Job) -> tuple[Problem, xr.Dataset]:
    return job.prepared()


@dataclass(frozen=True)
class Run:
    """A job, the blocks that were written when it began, and how often computations of the others had begun by then.

    `fresh` makes the store where there is none to go on with.
    """

    job: Job
    done: frozenset[int]
    begun: Mapping[int, int]
    fresh: Callable[[], None] | None = None

    @property
    def resumed(self) -> bool:
        """Whether the store was there already."""
        return self.fresh is None

    def begin(self) -> None:
        """Make the store, of which nothing is there before: what --force puts aside stays until all else is ready."""
        if self.fresh:
            self.fresh()

    @property
    def manifest(self) -> Manifest:
        """The manifest of the store of the results."""
        return Manifest(self.job.out)

    def attempts(self, block: int) -> int:
        """How many computations of a block that is not written have begun in this run."""
        return len(self.manifest.starts(block)) - self.begun.get(block, 0)

    @property
    def todo(self) -> list[int]:
        """The blocks that were not written when the run began."""
        return [block for block in range(len(self.job.blocks)) if block not in self.done]


def prepare(asked: StackFit, force: bool = False) -> Run:
    """Begin a fit of a stack, or take up the same fit where it stopped.

    Raises ValueError where the stack is none, or `out` holds another run and `force` is False; FileExistsError where
    `out` is something else.
    """
    opened = open_stack(asked.stack)
    lanes = lane_dims(opened, asked.each)
    blocks = BlockGrid.of({dim: opened.sizes[dim] for dim in lanes}, asked.block)
    if not blocks.lanes:
        empty = " and ".join(d for d in lanes if not opened.sizes[d])
        raise ValueError(f"{asked.stack} holds no scan: its {empty} is empty")
    declared = _declared(asked, opened, blocks)
    digest = hashlib.sha256(json.dumps(declared).encode()).hexdigest()
    job = Job(digest, asked, blocks)
    before = Manifest(asked.out).run()
    if before is None:
        refuse_existing(asked.out, force)
    if before is None or force:
        return Run(job, frozenset(), {}, _fresh(job, opened, declared, force))
    if change := difference(before, declared):
        raise ValueError(
            f"{asked.out} holds the fit of another run: {change}; choose another --out, or --force to start anew"
        )
    job.search()
    manifest = Manifest(asked.out)
    done = frozenset(manifest.written())
    return Run(job, done, {block: len(manifest.starts(block)) for block in manifest.begun() - done})


def _declared(asked: StackFit, opened: xr.Dataset, blocks: BlockGrid) -> Any:
    """Everything on which the results depend, as the manifest keeps it."""
    return plain(
        {
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
    """What makes the store without a lane fitted; a problem that cannot be fitted is refused here."""
    problem, _ = job.prepared()
    empty = job.search()(problem, stack.isel(dict.fromkeys(job.blocks.dims, slice(0, 0))), **job.asked.settings)
    empty = empty.transpose(*job.blocks.dims, ...)
    coords = {n: c for n, c in stack.coords.items() if c.dims and set(c.dims) <= set(job.blocks.dims)}

    def make() -> None:
        with replacing(job.out, force) as temporary:
            temporary.unlink()
            lane_store.create(temporary, empty, coords, job.blocks, declared)

    return make


def fit_block(job: Job, block: int) -> Record:
    """Fit the lanes of one block, write them, and mark the block as written; one that is marked is left alone.

    Raises ValueError, which names the block, for whatever goes wrong.
    """
    manifest = Manifest(job.out)
    if manifest.is_written(block):
        return manifest.record(block)
    try:
        return _fit_block(job, block, manifest)
    except Exception as error:
        kind = "" if isinstance(error, ValueError | OSError) else f"{type(error).__name__}: "
        raise ValueError(f"{job.blocks.words(block)}: {kind}{error}") from error


def _fit_block(job: Job, block: int, manifest: Manifest) -> Record:
    started = manifest.start(block)
    problem, stack = _prepared(job)
    region = job.blocks.region(block)
    part = stack.isel(region).load()
    result = job.search()(problem, part, **job.asked.settings).transpose(*job.blocks.dims, ...)
    seconds = time.time() - started
    lane_store.write(job.out, result, job.blocks, block)
    record = Record(
        block=block,
        lanes=job.blocks.size(block),
        host=socket.gethostname(),
        process=os.getpid(),
        started=started,
        written=time.time(),
        seconds=seconds,
        peak_megabytes=peak_megabytes(),
        statuses=lane_store.statuses(result),
        worst=lane_store.worst(result, part, region),
    )
    manifest.mark(record)
    return record


def _declaration(model: Model) -> dict[str, Any]:
    weights: dict[str, Any] = dict.fromkeys(model.weights, "weight")
    return weights | {n: [p.default, p.lower, p.upper, p.unit] for n, p in model.shape.items()}


def _versions() -> dict[str, str]:
    known = {}
    for name in _MATTERS:
        try:
            known[name] = version(name)
        except PackageNotFoundError:
            known[name] = "none"
    return known
