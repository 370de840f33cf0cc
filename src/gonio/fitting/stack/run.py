"""The fit of a stack in a store, block by block: what a run is, and what fitting one of its blocks is."""

import functools
import hashlib
import json
import os
import socket
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import xarray as xr

from gonio.files import refuse_existing, replacing
from gonio.fitting.objective.problem import Problem
from gonio.fitting.stack import store as lane_store
from gonio.fitting.stack.manifest import Blocks, Manifest, Record, difference, plain
from gonio.measured.stack import lane_dims, one_scan
from gonio.measured.stack_store import identity, open_stack
from gonio.model import Model

FitMany = Callable[..., xr.Dataset]
LANES_OF_BLOCK = 2048
_MATTERS = ("gonio", "numpy", "scipy", "jax", "jaxlib")  # the versions on which the last digits depend


@dataclass(frozen=True)
class Job:
    """What a process needs to fit any block; small, since it travels with every task: all data come from the store.

    `digest` tells one job from another, so that a process prepares the problem once.
    """

    digest: str
    stack: Path = field(compare=False)
    out: Path = field(compare=False)
    each: tuple[str, ...] = field(compare=False)
    model: Model = field(compare=False)
    problem: Mapping[str, Any] = field(compare=False)
    settings: Mapping[str, Any] = field(compare=False)
    blocks: Blocks = field(compare=False)
    fit_many: FitMany | None = field(compare=False, default=None)

    def search(self) -> FitMany:
        """`fit_many`, which needs JAX, unless the job brings another."""
        if self.fit_many is not None:
            return self.fit_many
        from gonio.fitting.many.fit_many import fit_many

        return fit_many

    @property
    def modules(self) -> tuple[str, ...]:
        """What a process loads for its first block; JAX, which takes a second, is among it."""
        return () if self.fit_many else ("gonio.fitting.many.starts", "gonio.fitting.many.covariance", "zarr")

    def prepared(self) -> tuple[Problem, xr.Dataset]:
        """The problem of one lane, and the stack, whose values are still in the store."""
        stack = open_stack(self.stack)
        return Problem(self.model, one_scan(stack, lane_dims(stack, self.each)), **self.problem), stack


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
        return Manifest(self.job.out)

    def attempts(self, block: int) -> int:
        """How many computations of a block that is not written have begun in this run."""
        return len(self.manifest.starts(block)) - self.begun.get(block, 0)

    @property
    def todo(self) -> list[int]:
        return [block for block in range(len(self.job.blocks)) if block not in self.done]


def prepare(
    model: Model,
    stack: str | Path,
    out: str | Path,
    *,
    each: Sequence[str] = (),
    problem: Mapping[str, Any] | None = None,
    settings: Mapping[str, Any] | None = None,
    block: int = LANES_OF_BLOCK,
    force: bool = False,
    fit_many: FitMany | None = None,
) -> Run:
    """Begin the fit of `model` to every lane of the stack, or take up the same fit where it stopped.

    each: coordinates of sets, such as wavelength, of which each value is fitted for itself.
    problem: what a Problem is declared by, beside model and data; settings: what `fit_many` takes.
    block: the most lanes of a block, which is what one task fits and what a crash loses.
    Raises ValueError where the stack is none, or `out` holds another run and `force` is False; FileExistsError where
    `out` is something else.
    """
    stack, out = Path(stack).absolute(), Path(out).absolute()
    opened = open_stack(stack)
    lanes = lane_dims(opened, each)
    blocks = Blocks.of({dim: opened.sizes[dim] for dim in lanes}, block)
    if not blocks.lanes:
        raise ValueError(f"{stack} holds no scan: its {' and '.join(d for d in lanes if not opened.sizes[d])} is empty")
    declared = plain(
        {
            "stack": identity(stack, opened),
            "model": {"name": model.name, "parameters": _declaration(model)},
            "problem": dict(problem or {}),
            "each": list(each),
            "fit": dict(settings or {}),
            "block": dict(zip(blocks.dims, blocks.chunk, strict=True)),
            "versions": _versions(),
        }
    )
    digest = hashlib.sha256(json.dumps(declared).encode()).hexdigest()
    job = Job(digest, stack, out, tuple(each), model, problem or {}, settings or {}, blocks, fit_many)
    before = Manifest(out).run()
    if before is None:
        refuse_existing(out, force)
    if before is None or force:
        return Run(job, frozenset(), {}, _fresh(job, opened, declared, force))
    if found := difference(before, declared):
        raise ValueError(f"{out} holds the fit of another run: {found}; choose another --out, or --force to start anew")
    job.search()
    manifest = Manifest(out)
    done = frozenset(manifest.written())
    return Run(job, done, {block: len(manifest.starts(block)) for block in manifest.begun() - done})


def _fresh(job: Job, stack: xr.Dataset, declared: Any, force: bool) -> Callable[[], None]:
    """What makes the store without a lane fitted; a problem that cannot be fitted is refused here."""
    problem, _ = job.prepared()
    empty = job.search()(problem, stack.isel(dict.fromkeys(job.blocks.dims, slice(0, 0))), **job.settings)
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
    result = job.search()(problem, part, **job.settings).transpose(*job.blocks.dims, ...)
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
        peak_megabytes=_peak(),
        statuses=lane_store.statuses(result),
        worst=lane_store.worst(result, part, region),
    )
    manifest.mark(record)
    return record


def _peak() -> float:
    """The most memory [MB] that this process has taken; 0 where the system does not tell."""
    try:
        import resource
    except ImportError:  # on Windows
        return 0.0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)


def _declaration(model: Model) -> dict[str, Any]:
    weights: dict[str, Any] = dict.fromkeys(model.weights, "weight")
    return weights | {n: [p.default, p.lower, p.upper, p.unit] for n, p in model.shape.items()}


def _versions() -> dict[str, str]:
    found = {}
    for name in _MATTERS:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "none"
    return found
