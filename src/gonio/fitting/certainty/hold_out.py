"""What a fit predicts where it was not shown the measurement: folds of a scan, and the predictions of each.

This is cross-validation. Each fold of points is left out in turn, the rest is fitted, and the fit predicts the fold.
Errors of prediction compare models with different numbers of values, since a value that only follows the noise helps
nothing there. `comparison.assessment` makes metrics of them.

Folds are whole incidence angles, planes or blocks of neighbouring directions, not single points: a point between two
others that were measured is predicted by almost any smooth curve.
"""

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.reweighting import settle
from gonio.fitting.solution import Solution
from gonio.measured import dataset

Values = npt.NDArray[np.float64]
Fold = tuple[str, npt.NDArray[np.bool_]]

OUT_OF_PLANE = "out-of-plane"
SETTLED = 1e-8  # relative change of a cost that ends a search: far finer than errors of prediction
STEPS = 200  # a minimum that is near is found in a tenth; a search that takes more goes along a flat valley
BLOCK = 5.0  # deg: neighbouring directions of a k-fold stay together, because a smooth curve fills its own gaps


def folds(points: xr.Dataset, by: str) -> list[Fold]:
    """What is left out in turn from a flat scan: a name, and which points (points,).

    by: a coordinate, one fold for each of its values; `out-of-plane`, one fold of all that is out of plane; or a number
    k, as many folds of blocks of 5 deg in theta_r, dealt out in turn.
    Raises ValueError where that leaves nothing out or nothing in.
    """
    parts = list(_folds(points, by))
    if not parts or any(left_out.all() or not left_out.any() for _, left_out in parts):
        raise ValueError(f"leaving out by {by} needs at least two parts of the scan, and it has {max(len(parts), 1)}")
    return parts


def _folds(points: xr.Dataset, by: str) -> Iterator[Fold]:
    """The folds as they come; ValueError where `by` is none of the three things that `folds` knows."""
    if by.isdigit():
        count = int(by)
        # the blocks of all incidence angles, in order, go to the folds in turn, so that each fold spans the scan
        block = np.floor(dataset.signed_theta_r(points) / BLOCK).astype(int)
        key = np.unique(np.column_stack([points["theta_i"].values, block]), axis=0, return_inverse=True)[1].ravel()
        for k in range(count):
            yield f"block {k + 1}", key % count == k
    elif by == OUT_OF_PLANE:
        yield by, ~dataset.is_in_plane(points)
    elif by in points.coords:
        for value in np.unique(points[by].values):
            yield f"{by} {value:g}" if isinstance(value, float) else f"{by} {value}", points[by].values == value
    else:
        coordinates = ", ".join(str(c) for c in points.coords)
        raise ValueError(
            f"a scan is left out by a coordinate ({coordinates}), by {OUT_OF_PLANE}, or in k blocks, not by {by!r}"
        )


def predictions(problem: Problem, solution: Solution, by: str, settled: float = SETTLED) -> tuple[Values, list[Fold]]:
    """BRDF (points,) by fits that did not see the point's fold, NaN where no fold holds it; and the folds.

    Each fit starts from the values found with all points: leaving a part out moves the minimum, it makes no new one.
    That start has seen the fold, but is no part of the result: the search ends at the minimum of the rest. Fits are
    under the loss of the problem, and smooth parameters keep the strength that was found with all points. settled: the
    relative change of a cost that ends the search of each.
    Raises ValueError where a parameter has one value for each part that is left out, since no other point then
    determines it, and as `folds` does.
    """
    out = np.full(problem.points.sizes["direction"], np.nan)
    parts = []
    for name, fold, modelled in fits_of_folds(problem, solution, by, settled):
        out[fold] = modelled[fold]
        parts.append((name, fold))
    return out, parts


def fits_of_folds(
    problem: Problem, solution: Solution, by: str, settled: float = SETTLED
) -> Iterator[tuple[str, npt.NDArray[np.bool_], Values]]:
    """The name of each fold, its points (points,), and BRDF at all points (points,) by a fit that did not see them.

    As `predictions`, which is made of it.
    """
    parts = folds(problem.points, by)
    problem = solution.as_fitted(problem)
    vector = solution.vector(problem.names)
    for name, fold in parts:
        _refuse_unseen(problem, name, fold)
        shown = problem.part(np.flatnonzero(~fold))
        yield name, fold, problem.brdf(settle(shown, vector, settled, STEPS).vector)


def predictable(problem: Problem, by: str) -> bool:
    """Whether every part that is left out by `by` can be predicted from the others."""
    try:
        for name, fold in folds(problem.points, by):
            _refuse_unseen(problem, name, fold)
    except ValueError:
        return False
    return True


def _refuse_unseen(problem: Problem, name: str, fold: npt.NDArray[np.bool_]) -> None:
    """ValueError where a fold holds every point of some group: the rest has no value for it."""
    for entry in problem.free:
        if set(np.unique(entry.group[fold])) - set(np.unique(entry.group[~fold])):
            raise ValueError(
                f"{entry.name} has one value for each {', '.join(entry.by)}, so nothing predicts {name} when that is "
                f"left out: do not group {entry.name}, or leave out something else"
            )
