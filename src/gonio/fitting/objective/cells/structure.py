"""Cells: parts of a scan that have most of their values to themselves.

A spectrum of 2000 wavelengths has weights of its own at each wavelength, and perhaps a shape value too. The derivative
of the residual by such a value is zero at the points of all other wavelengths. A matrix (points, values) would hold
little but zeros, and its size would grow with the square of the number of wavelengths. So points are sorted into cells,
here one a wavelength. Each value is either its cell's own, or joint: it touches points of several cells, or is smooth.
The derivative then has a dense block for each cell, and columns for the joint values, which are few (`plane`):

    | own 1              joint |
    |        own 2       joint |
    |               ..   joint |
"""

import weakref
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.blocks import in_blocks
from gonio.fitting.objective.entries import Entry, groups
from gonio.fitting.objective.problem import Problem

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Bucket:
    """Cells of like size, whose matrices NumPy takes all at once: k cells of at most r points.

    rows (k, r): the points of each cell. real (k, r): False where a cell has fewer points; its row there is zero.
    own (k, m): places in the vector of each cell's own values. joint (k, t): places among the joint values of those
    that it depends on. column (entries, k, r): in which of these m + t columns each point's value of an entry is.
    """

    rows: Places
    real: Mask
    own: Places
    joint: Places
    column: Places

    def gathered(self, of_points: Values) -> Values:
        """Numbers of points (points,) as (k, r), zero where a cell has fewer points."""
        out: Values = np.where(self.real, of_points[self.rows], 0.0)
        return out

    def scatter(self, values: Values, out: Values) -> None:
        """Write numbers (k, r) to their points in `out` (points,)."""
        out[self.rows[self.real]] = values[self.real]


@dataclass(frozen=True, eq=False)
class Cells:
    """The cells of a problem of n values.

    places (entries, points): the value of each free entry that each point depends on. joint (g,): places in the vector
    of the joint values. buckets: the cells by their size.
    """

    size: int
    places: Places
    joint: Places
    buckets: tuple[Bucket, ...]

    @property
    def points(self) -> int:
        return self.places.shape[1]


@dataclass(frozen=True)
class _Split:
    """One way to split a problem: the cell of every point (points,), and which values are joint (n,)."""

    cell: Places
    joint: Mask

    @property
    def size(self) -> int:
        """What elimination costs: the joint values, and the points of the largest cell's own values."""
        return int(self.joint.sum()) + len(self.joint) // max(int(self.cell.max()) + 1, 1)


_CELLS: "weakref.WeakKeyDictionary[Problem, Cells | None]" = weakref.WeakKeyDictionary()


def in_cells(problem: Problem) -> Cells | None:
    """The cells of a problem whose matrices of all points and values would be large (`Problem.is_large`); else None.

    None also where no coordinate splits it, and for very many points with few values, which `blocks` takes.
    They are found once, and kept as long as the problem itself.
    """
    if not problem.is_large or in_blocks(problem):
        return None
    if problem not in _CELLS:
        split = best_split(problem)
        _CELLS[problem] = cells(problem.free, split.cell, split.joint) if split else None
    return _CELLS[problem]


def best_split(problem: Problem) -> _Split | None:
    """The split by one of the groupings of the problem that leaves the smallest systems; None where none splits it."""
    by = {entry.by for entry in problem.free if entry.by}
    candidates = [*dict.fromkeys(sorted(by | {(name,) for names in by for name in names}))]
    splits = [_split(problem, names) for names in candidates]
    useful = [split for split in splits if split.joint.sum() < len(split.joint) and split.cell.max() > 0]
    return min(useful, key=lambda split: split.size, default=None)


def _split(problem: Problem, by: tuple[str, ...]) -> _Split:
    """Cells by some coordinates. A value is joint that has points in several, or that a penalty ties to others."""
    cell, joint = groups(problem.points, by)[1], []
    for entry in problem.free:
        first, last = np.full(entry.size, len(cell)), np.full(entry.size, -1)
        np.minimum.at(first, entry.group, cell)
        np.maximum.at(last, entry.group, cell)
        joint.append((first != last) | (entry.name in problem.smoothed))
    return _Split(cell, np.concatenate(joint))


def cells(entries: tuple[Entry, ...], cell: Places, joint: Mask) -> Cells:
    """The cells of some entries, whose values are a vector (n,), from the cell of every point and the joint values."""
    starts = np.cumsum([0, *(entry.size for entry in entries)])
    places = np.array([start + entry.group for start, entry in zip(starts, entries, strict=False)], dtype=np.intp)
    rank = np.cumsum(joint) - 1  # of each joint value among them
    # each value of each cell once, own values first, and its column in the cell
    pairs, pair = np.unique((cell * 2 + joint[places]) * len(joint) + places, return_inverse=True)
    of_cell, value = pairs // len(joint) // 2, pairs % len(joint)
    begins = np.searchsorted(of_cell, np.arange(int(cell.max()) + 2))
    column = (np.arange(len(pairs)) - begins[of_cell])[pair].reshape(places.shape)
    own_counts = np.bincount(of_cell[~joint[value]], minlength=len(begins) - 1)
    order = np.argsort(cell, kind="stable")
    ends = np.cumsum(np.bincount(cell))
    buckets = []
    for some in _alike(np.diff(ends, prepend=0), np.diff(begins), own_counts):
        counts, own = np.diff(ends, prepend=0)[some], int(own_counts[some[0]])
        at = np.arange(counts.max())
        real = at < counts[:, None]
        rows = order[np.where(real, (ends[some] - counts)[:, None] + at, (ends[some] - 1)[:, None])]
        values = value[begins[some][:, None] + np.arange(int(np.diff(begins)[some[0]]))]
        buckets.append(Bucket(rows, real, values[:, :own], rank[values[:, own:]], column[:, rows]))
    return Cells(len(joint), places, np.flatnonzero(joint), tuple(buckets))


def _alike(points: Places, columns: Places, own: Places) -> Iterator[Places]:
    """Cells with as many columns and own values, and numbers of points within a factor of two."""
    size = np.ceil(np.log2(np.maximum(points, 1))).astype(np.intp)
    _, kind = np.unique(np.column_stack([size, columns, own]), axis=0, return_inverse=True)
    for k in range(int(kind.max()) + 1):
        yield np.flatnonzero(kind.ravel() == k)
