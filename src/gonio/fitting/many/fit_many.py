"""Many scans of the same directions, fitted at once: the Problem of one scan, compiled and batched by JAX."""

import functools
import time
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.covariance_kinds import ABSOLUTE, COVARIANCES, DEFAULT
from gonio.fitting.many.layout import Shared, laid_out
from gonio.fitting.many.reading import blocks
from gonio.fitting.many.results import Results
from gonio.fitting.many.runner import FEW, LONG, Runner, Search
from gonio.fitting.objective.problem import Problem
from gonio.fitting.schema import versions
from gonio.fitting.search.anneal import Anneal
from gonio.fitting.search.projection import FOR_MANY, Projection
from gonio.fitting.search.solver import Progress, silent
from gonio.measured.stack import NODE, StackLanes, lane_dims, one_scan

Values = npt.NDArray[Any]
PRECISIONS = ("float64", "float32")
SEARCHING = 0.95  # of the progress: the rest is for the lanes that are slowest


def fit_many(
    problem: Problem,
    stack: xr.Dataset,
    solver: Projection | Anneal = FOR_MANY,
    *,
    covariance: str = DEFAULT,
    precision: str = "float64",
    device: str = "",
    block: int = 0,
    progress: Progress = silent,
) -> xr.Dataset:
    """Fit every scan of a stack by the problem of one of them, as `fit` does for one.

    problem: model, held, grouped, shared, weighting and bounds; its scan says which dimensions are no lanes.
    stack: a Dataset whose `brdf` has the dimensions of one scan and further ones, lanes: each is fitted on its own,
        with its own gaps, mask and uncertainties, over directions that all share. One on disk is read block by block.
        One of no lanes gives an empty Dataset at once, which says what one of many lanes would hold.
    solver: a Projection, by default one with fewer trials than for a single scan, or an Anneal, whose chains run side
        by side.
    covariance: a kind of COVARIANCES, or "" for none. precision: float64 or float32, in which rounding moves E by some
        1e-6 and values that the data hardly determine by more. device: "cpu", "gpu", or what JAX prefers.
    block: lanes that are searched side by side; 0 takes what suits the device. Results do not depend on other lanes of
        a block but for rounding.
    Returns a Dataset over the lane dimensions and `parameter`, as `Results.dataset` says; `solution_of` makes a
    Solution of one lane. Raises ValueError where the stack is none, for settings that are none, without JAX, and for
    what only a fit of one scan can do: instruments, smooth values, robust losses, logarithms.
    """
    started = time.perf_counter()
    dims = _lanes_of(problem, stack)
    _refuse(problem, covariance, precision)
    jax = _jax_or_remedy()
    if all(stack.sizes[d] for d in dims):
        problem = replace(problem, data=one_scan(stack, dims))
        lanes = StackLanes(stack, dims, problem.points[NODE].values)
    else:
        lanes = StackLanes(stack, dims, np.empty(0, dtype=np.intp))
    search = Search(solver, covariance, np.dtype(precision), block)
    results = Results(problem, len(lanes), covariance)
    if len(lanes):
        with jax.enable_x64(precision == "float64"), jax.default_device(_device(device)):
            results = _searched(problem, lanes, search, progress)
    return results.dataset(problem, stack, lanes).assign_attrs(
        solver=f"{solver.name}, batched",
        settings=repr(solver),
        precision=precision,
        device=device or "default",
        covariance=covariance,
        seconds=time.perf_counter() - started,
        versions=versions("gonio", "numpy", "jax", "jaxlib"),
    )


def _searched(problem: Problem, lanes: StackLanes, search: Search, progress: Progress) -> Results:
    """What became of every lane; the search of long scans begins where one of some of their points ended."""
    shared, start = laid_out(problem), None
    if shared.order.size > LONG and len(problem.free_shape) and isinstance(search.solver, Projection):
        few = replace(search, covariance="", thorough=False)
        some = _run(problem, shared.thinned(FEW), lanes, few, None, lambda done: progress(done / 2))
        shape = some.value[:, problem.n_weights :]
        start = problem.axes().unit(np.where(np.isfinite(shape), shape, problem.shape_start)).T
        progress = functools.partial(_second_half, progress)
    return _run(problem, shared, lanes, search, start, progress)


def _second_half(progress: Progress, done: float) -> None:
    progress((1 + done) / 2)


def _run(
    problem: Problem, shared: Shared, lanes: StackLanes, search: Search, start: Values | None, progress: Progress
) -> Results:
    """Every lane, block after block; from `start` (d, lanes) where that is known."""
    results = Results(problem, len(lanes), search.covariance)
    runner = Runner(problem, shared, len(lanes), search, start, results)
    for block in blocks(problem, shared, lanes, runner.width, search.covariance == ABSOLUTE):
        runner.take(block)
        progress(SEARCHING * block.rows[-1] / len(lanes))
    runner.flush()
    progress(1.0)
    return results


def _lanes_of(problem: Problem, stack: xr.Dataset) -> tuple[str, ...]:
    """The dimensions of the stack that the problem's scan lacks."""
    of_scan = set(map(str, problem.data["brdf"].dims))
    dims = tuple(str(d) for d in stack["brdf"].dims if d not in of_scan)
    if not dims or not of_scan <= set(map(str, stack["brdf"].dims)):
        have = ", ".join(map(str, stack["brdf"].dims))
        lane_dims(stack)  # says what is missing where the stack is one scan
        raise ValueError(
            f"the problem's scan has the dimensions {', '.join(sorted(of_scan))} and the stack {have}: "
            "make the problem of one scan of the stack (gonio.measured.stack.one_scan)"
        )
    return dims


def _refuse(problem: Problem, covariance: str, precision: str) -> None:
    """ValueError for what only a fit of one scan can do."""
    if covariance and covariance not in COVARIANCES:
        raise ValueError(f"no covariance {covariance!r}: choose one of {', '.join(COVARIANCES)}, or none")
    if precision not in PRECISIONS:
        raise ValueError(f"no precision {precision!r}: choose {' or '.join(PRECISIONS)}")
    for_one = {
        "an instrument's acceptance": bool(problem.instrument),
        "smooth values": bool(problem.smoothed),
        f"a {problem.loss} loss": problem.loss != "squared",
        "log weighting": problem.logarithmic,
        "point_weights": problem.point_weights is not None,
    }
    for what, asked in for_one.items():
        if asked:
            raise ValueError(f"{what} is for fits of one scan, and these are many: leave it out, or fit one by one")


def _jax_or_remedy() -> Any:
    try:
        import jax
    except ImportError:
        raise ValueError("fits of many scans need JAX: pip install 'gonio[batch]'") from None
    return jax


def _device(name: str) -> Any:
    import jax

    if not name:
        return jax.devices()[0]
    try:
        return jax.devices(name)[0]
    except RuntimeError:
        have = ", ".join(sorted({d.platform for d in jax.devices()}))
        raise ValueError(
            f"JAX sees no device {name!r}, only {have}: for an NVIDIA GPU, pip install 'gonio[batch]' 'jax[cuda13]'"
        ) from None
