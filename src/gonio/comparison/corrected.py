"""What fits and their corrections predict where they were not shown the measurement."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gonio.completion import Correction
from gonio.completion.correction import holds
from gonio.fitting.certainty.hold_out import Fold, fits_of_folds
from gonio.fitting.objective.problem import Problem
from gonio.fitting.solution import Solution

Values = npt.NDArray[np.float64]

STEEPEST = "theta_i"  # what must be left out in turn so that the steepest is told apart


@dataclass(frozen=True)
class Intervals:
    """How many positive values were left out, and of how many the 95 % interval holds the measured one.

    The steepest incidence angle is extrapolated, so it is counted apart; interior are all others.
    """

    interior: int
    interior_held: int
    steepest: int = 0
    steepest_held: int = 0


@dataclass(frozen=True)
class Predicted:
    """BRDF (points,) of corrected fits and of the fits alone, NaN where nothing holds the point; what was left out."""

    values: Values
    plain: Values
    parts: list[Fold]
    intervals: Intervals | None = None


def predicted(
    problem: Problem, solution: Solution, by: str, settled: float, correction: Correction | None
) -> Predicted:
    """The predictions of every part that is left out in turn, each corrected by the others alone."""
    points, count = problem.points, problem.points.sizes["direction"]
    plain, shift, held = np.full(count, np.nan), np.zeros(count), np.zeros(count, dtype=bool)
    parts = []
    for name, fold, modelled in fits_of_folds(problem, solution, by, settled):
        plain[fold] = modelled[fold]
        parts.append((name, fold))
        if correction is None:
            continue
        inside, outside = np.flatnonzero(fold), np.flatnonzero(~fold)
        learned = correction.learned(points.isel(direction=outside), modelled[outside])
        left_out = points.isel(direction=inside)
        shift[inside], uncertainty, _ = learned.at(left_out)
        with np.errstate(divide="ignore", invalid="ignore"):  # a value of zero has no logarithm, and is not held
            held[inside] = holds(left_out, np.log10(modelled[inside]) + shift[inside], uncertainty)
    if correction is None:
        return Predicted(plain, plain, parts)
    return Predicted(plain * 10**shift, plain, parts, _counted(problem, by, np.isfinite(plain), held))


def _counted(problem: Problem, by: str, left_out: npt.NDArray[np.bool_], held: npt.NDArray[np.bool_]) -> Intervals:
    angle = problem.points["theta_i"].values
    used = left_out & (problem.measured > 0)
    steep = used & (angle == angle.max()) if by == STEEPEST else np.zeros_like(used)
    inner = used & ~steep
    return Intervals(*(int(np.count_nonzero(mask)) for mask in (inner, inner & held, steep, steep & held)))
