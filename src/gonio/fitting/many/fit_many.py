"""Many scans of the same directions, fitted at once: the Problem of one scan, compiled and batched by JAX.

Every lane of a stack is a fit of its own by variable projection (golub1973): for given shape parameters the weights are
the exact optimum of bounded linear least squares, and damped Gauss-Newton steps search the shape alone. Lanes share
their directions, so one compiled program steps all lanes of a block together.

What is done here is to check the arguments and to put the parts together: `layout` (what lanes share), `reading`
(blocks of lanes from the stack), `runner` (the order of work), `projection`, `starts`, `annealing`, `covariance` and
`sweep` (compiled), and `results`. JAX is an optional dependency, so functions import it where they need it.
"""

import functools
import time
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.choosing import choice_for
from gonio.fitting.covariance_kinds import ABSOLUTE, COVARIANCES, DEFAULT
from gonio.fitting.many.layout import Shared, laid_out
from gonio.fitting.many.reading import blocks
from gonio.fitting.many.results import Results
from gonio.fitting.many.runner import FEW, LONG, Runner, Search
from gonio.fitting.objective.from_scan import given_floor
from gonio.fitting.objective.problem import Problem
from gonio.fitting.schema import versions
from gonio.fitting.search.anneal import Anneal
from gonio.fitting.search.projection import FOR_MANY, Projection
from gonio.fitting.search.solver import Progress, silent
from gonio.measured.polarimetry.ratio import whole
from gonio.measured.polarisers import POLARISATION, is_polarised
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
    """Fit every scan of a stack by the problem of one of them, as `gonio.fit` does for one.

    Parameters
    ----------
    problem : Problem
        Model, held, grouped, shared, weighting and bounds. Dimensions of its scan's `brdf` are dimensions of each scan
        of the stack; its values are not fitted unless it is a scan of the stack itself. A weighting that
        was left to the data (`auto`) is chosen anew for all scans of the stack together.
    stack : xarray.Dataset
        Its `brdf` has the dimensions of one scan and further ones. Each place along the further ones is a lane, which
        is fitted on its own, with its own gaps, mask and uncertainties, over directions that all share. A stack on
        disk is read block by block. One without lanes gives an empty Dataset at once, with the variables and
        attributes that one of many lanes would have.
    solver : Projection or Anneal
        By default a Projection with fewer trials than for a single scan. The chains of an Anneal run side by side.
    covariance : str
        `robust`, `scaled` or `absolute`, or "" for none, and then for no systematic uncertainty either.
    precision : str
        "float64" or "float32". In float32 rounding moves E by some 1e-6 of itself, and values that the data hardly
        determine by more.
    device : str
        "cpu", "gpu", or "" for what JAX prefers.
    block : int
        Lanes that are searched side by side; 0 takes what suits the device. The other lanes of a block change the
        results of a lane by rounding at most.
    progress : callable
        Called with the part that is done, 0 to 1.

    Returns
    -------
    xarray.Dataset
        Values and uncertainties over the lanes and `parameter`, and `status` over the lanes; `solution_of` makes a
        Solution of one lane. Where the stack states systematic uncertainties, by cause or in all, each value has its
        shift by every cause, NaN in a lane that does not state them at every point. A lane that cannot be fitted raises
        nothing: its status says why, and its values are NaN.

    Raises
    ------
    ValueError
        The stack is a single scan, a setting is not known, JAX is missing, or the problem has what only a fit of one
        scan can do: an instrument's acceptance, smooth values, robust losses, point_weights.

    """
    started = time.perf_counter()
    dims = _lanes_of(problem, stack)
    _refuse(problem, covariance, precision)
    _refuse_polarised(problem, stack)
    problem = _weighted_for_all(problem, stack, dims)
    jax = _jax_or_remedy()
    # The problem gets a scan of ones in place of its own. Its points are then all directions of the stack, also those
    # at which its own scan has a gap: gaps are a matter of each lane.
    if all(stack.sizes[d] for d in dims):
        problem = replace(problem, data=one_scan(stack, dims))
        lanes = StackLanes(stack, dims, problem.points[NODE].values)
    else:
        lanes = StackLanes(stack, dims, np.empty(0, dtype=np.intp))
    search = Search(solver, covariance, np.dtype(precision), block)
    results = Results(problem, len(lanes), covariance, lanes.causes if covariance else ())
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
    """What became of every lane; the search of long scans begins where one on part of their points ended.

    Most steps of a search then look at few points. Only the shape is taken from the first search: weights, E and
    covariances are those of all points. An annealing has all points in every step.
    """
    shared, start = laid_out(problem), None
    if shared.order.size > LONG and len(problem.free_shape) and isinstance(search.solver, Projection):
        rough = replace(search, covariance="", thorough=False)
        preliminary = _run(problem, shared.thinned(FEW), lanes, rough, None, lambda done: progress(done / 2))
        shape = preliminary.value[:, problem.n_weights :]
        # Lanes or groups without a point among the part have no shape yet, and start from the declared defaults.
        start = problem.axes().unit(np.where(np.isfinite(shape), shape, problem.shape_start)).T
        progress = functools.partial(_second_half, progress)
    return _run(problem, shared, lanes, search, start, progress)


def _second_half(progress: Progress, done: float) -> None:
    """The progress of the second of two searches that count for half each."""
    progress((1 + done) / 2)


def _run(
    problem: Problem, shared: Shared, lanes: StackLanes, search: Search, start: Values | None, progress: Progress
) -> Results:
    """Every lane, block after block; from `start` (d, lanes) where that is known."""
    results = Results(problem, len(lanes), search.covariance, lanes.causes if search.covariance else ())
    runner = Runner(problem, shared, len(lanes), search, start, results)
    for block in blocks(problem, shared, lanes, runner.width, search.covariance == ABSOLUTE):
        runner.take(block)
        progress(SEARCHING * block.rows[-1] / len(lanes))
    runner.flush()
    # The stack is read once more: shifts by cause are many numbers, and searches that go on need none of them.
    for block in blocks(problem, shared, lanes, runner.width, False, shifted=True) if results.causes else ():
        runner.shift(block)
    progress(1.0)
    return results


def _lanes_of(problem: Problem, stack: xr.Dataset) -> tuple[str, ...]:
    """The dimensions of the stack that the problem's scan lacks; ValueError where there are none, or the scan has more.

    So the problem decides what is fitted jointly: of a stack over sample and wavelength, a scan over wavelength makes
    lanes of the samples alone.
    """
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


def _weighted_for_all(problem: Problem, stack: xr.Dataset, dims: tuple[str, ...]) -> Problem:
    """The problem with the weighting that all scans ask for, where its own was chosen from its own scan."""
    if not problem.weighting_reason or problem.weighting_reason == given_floor(problem.noise_floor):
        return problem
    weighting, floor, reason = choice_for(stack, dims)
    # Its own scan may not allow this weighting; ones do, and only the directions of that scan are used.
    scan = one_scan(stack, dims) if all(stack.sizes[d] for d in dims) else problem.data
    return replace(problem, data=scan, weighting=weighting, noise_floor=floor, weighting_reason=reason)


def _refuse_polarised(problem: Problem, stack: xr.Dataset) -> None:
    """ValueError for readings through polarisers that are no lanes of a model without polarisation."""
    if POLARISATION in stack.coords and is_polarised(stack):
        of_scan = set(problem.data["brdf"].dims) & set(stack[POLARISATION].dims)
        if whole(problem.model).polarised or of_scan:
            raise ValueError(
                "readings through polarisers are for fits of one scan, and these are many: fit one by one, or take the "
                "mean of each scan first (gonio.measured.polarisers.unpolarised)"
            )


def _refuse(problem: Problem, covariance: str, precision: str) -> None:
    """ValueError for settings that are unknown, and for what only a fit of one scan can do."""
    if covariance and covariance not in COVARIANCES:
        raise ValueError(f"no covariance {covariance!r}: choose one of {', '.join(COVARIANCES)}, or none")
    if precision not in PRECISIONS:
        raise ValueError(f"no precision {precision!r}: choose {' or '.join(PRECISIONS)}")
    unsupported = {
        "an instrument's acceptance": bool(problem.instrument),
        "smooth values": bool(problem.smoothed),
        f"a {problem.loss} loss": problem.loss != "squared",
        "point_weights": problem.point_weights is not None,
    }
    for feature, requested in unsupported.items():
        if requested:
            raise ValueError(f"{feature} is for fits of one scan, and these are many: leave it out, or fit one by one")


def _jax_or_remedy() -> Any:
    """JAX, which is an optional dependency; ValueError that says how to install it."""
    try:
        import jax
    except ImportError:
        raise ValueError("fits of many scans need JAX: pip install 'gonio[batch]'") from None
    return jax


def _device(name: str) -> Any:
    """The first device of a platform, or the one that JAX prefers; ValueError with those that JAX sees."""
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
