"""Problems whose shape parameters have one value a group: where a search of so many values starts, and what splits.

A spectrum with one slope a wavelength has as many shape values as wavelengths, too many for a grid of starts. If no
parameter is shared between wavelengths, the problem splits into `parts`, each with its own search from many starts. If
it does not split, the search starts from the optimum with one value for all groups (`common`), and then moves each
group to where its own points fit best (`side_by_side`).
"""

from dataclasses import replace
from typing import Protocol

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.entries import Entry, labelled
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.solver import Optimum

Values = npt.NDArray[np.float64]
Rows = npt.NDArray[np.intp]


class Reduced(Protocol):
    """A problem of the shape alone, in unit coordinates, as a projection searches it."""

    problem: Problem

    def residual(self, unit: Values) -> Values: ...


def is_grouped(problem: Problem) -> bool:
    """Whether any shape parameter has one value a group."""
    return any(entry.size > 1 for entry in problem.free_shape)


def weights_couple(problem: Problem) -> bool:
    """Whether points of more than one group of a shape parameter determine one free weight."""
    grouped = [set(entry.by) for entry in problem.free_shape if entry.size > 1]
    return any(not by <= set(weight.by) for weight in problem.free_weights for by in grouped)


def common(problem: Problem) -> Problem:
    """The same problem with one value for all groups of each free shape parameter, and nothing smooth."""
    free = {entry.name for entry in problem.free_shape}
    grouped = {name: by for name, by in problem.grouped.items() if name not in free}
    return replace(problem, grouped=grouped, smooth={}, bounds=_bounds(problem))


def _bounds(problem: Problem) -> dict[str, tuple[float, float]]:
    """The bounds of every free shape parameter.

    One that is held until an option names it stays free by them, where neither groups nor smoothness name it any more.
    """
    free = {entry.name: problem.model.shape[entry.name] for entry in problem.free_shape}
    return {name: (parameter.lower, parameter.upper) for name, parameter in free.items()} | dict(problem.bounds)


def carried(vector: Values, source: Problem, problem: Problem, rows: Rows | slice = slice(None)) -> Values:
    """The values of a coarser or smaller problem where they belong in a vector of `problem`, the others NaN.

    `rows` are the points of `problem` that `source` holds, in its order. They link both: a point's group in `source`
    says which value it has, its group in `problem` where that value belongs.
    """
    out, start, source_start = np.full(len(problem.names), np.nan), 0, 0
    for entry, source_entry in zip(problem.free, source.free, strict=True):
        out[start + entry.group[rows]] = vector[source_start + source_entry.group]
        start, source_start = start + entry.size, source_start + source_entry.size
    return out


def parts(problem: Problem) -> list[tuple[Rows, Problem]]:
    """Problems, each with its points, whose optima together are the optimum of the whole; none where it does not split.

    It splits where one coordinate groups every free parameter and nothing is smooth: the points of one of its values
    then determine values that no other point has a part in.
    """
    shared_by = set.intersection(*(set(entry.by) for entry in problem.free))
    if not shared_by or len(problem.penalty):
        return []
    # of several, the first in the order of the parameters: a set has no order of its own
    by = next(c for entry in problem.free for c in entry.by if c in shared_by)
    labels, place = labelled(problem.points[by].values)
    rows_of_parts = [np.flatnonzero(place == k) for k in range(len(labels))]
    signal = problem.root_weights * problem.measured
    # a part of zeros, or without weight, has no E of its own
    if len(rows_of_parts) < 2 or not all(signal[rows].any() for rows in rows_of_parts):
        return []
    # strengths of zero penalise nothing, but a part may hold too few values of a coordinate to be declared smooth
    free = replace(problem, smooth={}, bounds=_bounds(problem))
    return [(rows, free.part(rows)) for rows in rows_of_parts]


def assembled(problem: Problem, optima: list[tuple[Rows, Problem, Optimum]]) -> Optimum:
    """The optimum of a problem from those of its parts.

    E of a part is relative to its own points. Multiplied by its scale it is a sum of squares, which adds up.
    """
    vector = np.full(len(problem.names), np.nan)
    for rows, part, optimum in optima:
        values = carried(optimum.vector, part, problem, rows)
        vector = np.where(np.isnan(values), vector, values)
    cost = float(sum(part.scale * optimum.cost for _, part, optimum in optima) / problem.scale)
    exhausted = any(optimum.exhausted for *_, optimum in optima)
    return Optimum(vector, cost, exhausted, sum(optimum.evaluations for *_, optimum in optima), np.array([cost]))


def side_by_side(reduced: Reduced, point: Values, k: int, line: int) -> Values:
    """`point` with each group of the k-th free shape parameter moved to where that group's own points fit best.

    One fine line serves all its groups at once: exactly so where nothing else couples them. Where shared weights do,
    they follow what all groups try together, so that the moved point can be worse than `point`.
    """
    entries = reduced.problem.free_shape
    start = sum(entry.size for entry in entries[:k])
    places = slice(start, start + entries[k].size)
    # the first trial is where each group is now, so that a group on which no other improves stays
    trials = np.vstack([point[places], np.tile(np.linspace(0.0, 1.0, line)[:, None], entries[k].size)])
    points = np.tile(point, (len(trials), 1))
    points[:, places] = trials
    errors = [_errors_by_group(entries[k], residual) for residual in reduced.residual(points)]
    best = point.copy()
    best[places] = trials[np.argmin(errors, axis=0), np.arange(entries[k].size)]
    return best


def _errors_by_group(entry: Entry, residual: Values) -> Values:
    """The squared error of the points of each group (groups,); rows of a penalty belong to none."""
    squared = residual[: len(entry.group)] ** 2
    return np.bincount(entry.group, weights=squared, minlength=entry.size).astype(float)
