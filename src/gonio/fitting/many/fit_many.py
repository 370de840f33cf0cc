"""Many scans of the same directions, fitted at once: the Problem of one scan, compiled and batched by JAX."""

import functools
import time
from dataclasses import replace
from importlib.metadata import version
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.certainty.covariance import ABSOLUTE, COVARIANCES, DEFAULT
from gonio.fitting.many.layout import Shared, laid_out
from gonio.fitting.many.reading import blocks
from gonio.fitting.many.results import Results, solution
from gonio.fitting.many.runner import FEW, LONG, Runner, Search
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.anneal import Anneal
from gonio.fitting.search.projection import Projection
from gonio.fitting.search.solver import Progress, silent
from gonio.measured.stack import NODE, Lanes, lane_dims, one_scan

__all__ = ["fit_many", "solution"]

Values = npt.NDArray[Any]
PRECISIONS = ("float64", "float32")


def fit_many(
    problem: Problem,
    stack: xr.Dataset,
    *,
    anneal: Anneal | None = None,
    starts: int = 0,
    grid: int = 13,
    max_steps: int = 500,
    line: int = 11,
    covariance: str = DEFAULT,
    precision: str = "float64",
    device: str = "",
    block: int = 0,
    progress: Progress = silent,
) -> xr.Dataset:
    """Fit every scan of a stack by the problem of one of them, as `fit` does for one.

    stack: a Dataset whose `brdf` has the dimensions of one scan and further ones, lanes: each is fitted on its own,
        with its own gaps, mask and uncertainties, over directions that all share. One on disk is read block by block.
        One of no lanes gives an empty Dataset at once, which says what one of many lanes would hold.
    problem: model, held, grouped, shared, weighting and bounds; its scan says which dimensions are no lanes.
    anneal: the paper's Appendix A in place of exact weights, for those who want it; its chains run side by side.
    starts: minima that are followed for each lane, from the best of a common grid of so many shapes a dimension (of 64
        quasi-random ones a dimension where there are three and more); 0 takes 2, and 4 from three shape values on.
    max_steps: steps of each search. line: from a minimum at a bound, and from any of three shape values and more, so
        many points along each coordinate look for a better one; 0 for none.
    covariance: of `fit.covariance`, or "" for none. precision: float64 or float32, in which rounding moves E by some
        1e-6 and values that the data hardly tell by more. device: "cpu", "gpu", or what JAX prefers.
    block: lanes that are searched side by side; 0 takes what suits the device. Results do not depend on other lanes of
        a block but for rounding.
    Returns a Dataset over the lane dimensions and `parameter`: value, uncertainty, at_bound, covariance (and
    `parameter_b`), and of each lane cost (E, eq 11), status (an index of its flag_meanings), converged, steps, points;
    `solution` makes a Solution of one lane. Raises ValueError where the stack is none, for settings that are none,
    without JAX, and for what only a fit of one scan can do: instruments, smooth values, robust losses, logarithms.
    """
    started = time.perf_counter()
    dims = _lanes_of(problem, stack)
    _refuse(problem, covariance, precision)
    jax = _jax_or_remedy()
    if all(stack.sizes[d] for d in dims):
        problem = replace(problem, data=one_scan(stack, dims))
        lanes = Lanes(stack, dims, problem.points[NODE].values)
    else:
        lanes = Lanes(stack, dims, np.empty(0, dtype=np.intp))
    search = Search(anneal, starts, grid, max_steps, line, covariance, np.dtype(precision), block)
    found = Results(problem, len(lanes), covariance)
    if len(lanes):
        with jax.enable_x64(precision == "float64"), jax.default_device(_device(device)):
            found = _searched(problem, lanes, search, progress)
    return found.dataset(problem, stack, lanes).assign_attrs(
        solver=f"{anneal.name if anneal else Projection.name}, batched",
        settings=repr(anneal) if anneal else f"{starts=}, {grid=}, {max_steps=}, {line=}",
        precision=precision,
        device=device or "default",
        covariance=covariance,
        seconds=time.perf_counter() - started,
        versions=", ".join(f"{name} {version(name)}" for name in ("gonio", "numpy", "jax", "jaxlib")),
    )


def _searched(problem: Problem, lanes: Lanes, search: Search, progress: Progress) -> Results:
    """What the search of every lane found; that of long scans begins where one of some of their points ended."""
    shared, start = laid_out(problem), None
    if shared.order.size > LONG and len(problem.free_shape) and not search.anneal:
        few = replace(search, covariance="", thorough=False)
        some = _run(problem, shared.thinned(FEW), lanes, few, None, lambda done: progress(done / 2))
        shape = some.value[:, problem.n_weights :]
        start = problem.axes().unit(np.where(np.isfinite(shape), shape, problem.shape_start)).T
        progress = functools.partial(_second_half, progress)
    return _run(problem, shared, lanes, search, start, progress)


def _second_half(progress: Progress, done: float) -> None:
    progress((1 + done) / 2)


def _run(
    problem: Problem, shared: Shared, lanes: Lanes, search: Search, start: Values | None, progress: Progress
) -> Results:
    """Every lane, block after block; from `start` (d, lanes) where that is known."""
    found = Results(problem, len(lanes), search.covariance)
    runner = Runner(problem, shared, len(lanes), search, start, found)
    for block in blocks(problem, shared, lanes, runner.width, search.covariance == ABSOLUTE):
        runner.take(block)
        progress(0.95 * block.rows[-1] / len(lanes))
    runner.flush()
    progress(1.0)
    return found


def _lanes_of(problem: Problem, stack: xr.Dataset) -> tuple[str, ...]:
    """The dimensions of the stack that the problem's scan lacks."""
    own = set(map(str, problem.data["brdf"].dims))
    dims = tuple(str(d) for d in stack["brdf"].dims if d not in own)
    if not dims or not own <= set(map(str, stack["brdf"].dims)):
        have = ", ".join(map(str, stack["brdf"].dims))
        lane_dims(stack)  # says what is missing where the stack is one scan
        raise ValueError(
            f"the problem's scan has the dimensions {', '.join(sorted(own))} and the stack {have}: "
            "make the problem of one scan of the stack (gonio.measured.stack.one_scan)"
        )
    return dims


def _refuse(problem: Problem, covariance: str, precision: str) -> None:
    """ValueError for what only a fit of one scan can do."""
    if covariance and covariance not in COVARIANCES:
        raise ValueError(f"no covariance {covariance!r}: choose one of {', '.join(COVARIANCES)}, or none")
    if precision not in PRECISIONS:
        raise ValueError(f"no precision {precision!r}: choose {' or '.join(PRECISIONS)}")
    alone = {
        "an instrument's acceptance": bool(problem.instrument),
        "smooth values": bool(problem.smoothed),
        f"a {problem.loss} loss": problem.loss != "squared",
        "log weighting": problem.logarithmic,
        "point_weights": problem.point_weights is not None,
    }
    for what, asked in alone.items():
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
