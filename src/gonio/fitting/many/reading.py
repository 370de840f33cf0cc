"""Lanes of a stack as a compiled search takes them: weighted, scaled, laid out; and why a lane cannot be fitted.

Each lane gets the weights of the problem's weighting from its own values and uncertainties. Its weighted values are
divided by their length, so that they have a squared sum of 1; of logarithms, the weights have that sum. E (guo2023,
eq 11) is then the squared residual, and one tolerance suits lanes of any brightness.

Gaps, masked values and padding stay in the arrays as zeros with zero weight: sums are then the same for every lane,
which a compiled search needs, and such points add nothing to them.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.many.layout import Shared
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.weighting import WEIGHTINGS
from gonio.fitting.status import Status, code
from gonio.measured.causes import WHOLE
from gonio.measured.sound import LEAST_PEAK, MOST_PEAK, is_stated
from gonio.measured.stack import StackLanes

Values = npt.NDArray[Any]
READ = 2**20  # values that are read at once
LANED = ("rows", "scale", "seen", "points", "status", "crossed")  # fields of a LaneBlock whose first axis is of lanes
FITTED = -1  # status of a lane that a search decides about


@dataclass(frozen=True, eq=False)
class LaneBlock:
    """Lanes that are searched side by side; points are (cells, rows, lanes), with the last axis of the others."""

    one_root: bool  # whether the points of all lanes have the same weights, so that one root does for all
    rows: npt.NDArray[np.intp]  # which lanes of the stack they are
    root: Values  # roots of the weights of points (cells, rows, lanes, or 1 where `one_root`)
    target: Values  # weighted values (cells, rows, lanes), over `scale`
    error: Values  # stated uncertainties of the target (cells, rows, lanes); no lanes where they are not asked for
    scale: Values  # (lanes,): length of the weighted values, in which a lane's weights are measured
    seen: npt.NDArray[np.bool_]  # (lanes, n + d): which values have a point in use
    points: npt.NDArray[np.int32]  # points in use of each lane
    status: npt.NDArray[np.int8]  # why a lane cannot be fitted, or FITTED
    crossed: npt.NDArray[np.int8]  # how often better shapes were looked for on lines through a minimum
    shifts: Values = field(
        default_factory=lambda: np.zeros(0)
    )  # (causes, cells, rows, lanes) of the target; see blocks

    def __len__(self) -> int:
        return len(self.rows)

    def part(self, which: npt.NDArray[np.intp]) -> "LaneBlock":
        """The lanes at some places of the block; a place may be named several times."""
        laned = {n: getattr(self, n)[which] for n in LANED}
        root = self.root if self.one_root else self.root[..., which]
        error = self.error[..., which] if self.error.shape[-1] else self.error
        return LaneBlock(self.one_root, root=root, target=self.target[..., which], error=error, **laned)


def joined(blocks: list[LaneBlock]) -> LaneBlock:
    """Several blocks as one: either all with one root, which is then that of the first, or all without."""
    first = blocks[0]
    laned = {n: np.concatenate([getattr(b, n) for b in blocks]) for n in LANED}
    target, error, root = (
        np.concatenate([getattr(b, n) for b in blocks], axis=-1) for n in ("target", "error", "root")
    )
    return LaneBlock(first.one_root, root=first.root if first.one_root else root, target=target, error=error, **laned)


def blocks(
    problem: Problem, shared: Shared, lanes: StackLanes, width: int, absolute: bool, *, shifted: bool = False
) -> Iterator[LaneBlock]:
    """All lanes of a stack, at most `width` at a time; with `absolute`, their stated uncertainties too.

    shifted: whether to read by how much each cause of systematic uncertainty shifts the targets. In a lane that does
    not state it for every value in use the shifts are NaN.
    Lanes with gaps go by themselves. The others then have the same weights whatever neighbours they have, so their
    results do not depend on gaps elsewhere in the stack, and one root for a block takes less time.
    Lanes without a value in use are among those with gaps; their status says so.
    """
    # A multiple of the width: in a stack without gaps every block but the last is then full.
    lanes_read = max(READ // len(shared.order) // width, 1) * width
    for first in range(0, len(lanes), lanes_read):
        last = min(first + lanes_read, len(lanes))
        values = np.array(lanes.values("brdf", first, last), dtype=float)
        used = np.isfinite(values)
        if lanes.has_own("mask"):  # a mask that lanes have in common has taken its points out of the problem
            used &= lanes.values("mask", first, last) == 0
        values[~used] = 0.0  # a weight of zero does not remove a NaN from a sum
        stated = np.array(lanes.values("uncertainty", first, last), dtype=float) if "uncertainty" in lanes else None
        shifts = _known(lanes.shifts(first, last), used, lanes.causes) if shifted else None
        complete = used.all(axis=1)
        for rows in (np.flatnonzero(complete), np.flatnonzero(~complete)):
            for begin in range(0, len(rows), width):
                chosen = rows[begin : begin + width]
                uncertainty = None if stated is None else stated[chosen]
                block = _block(problem, shared, first + chosen, values[chosen], used[chosen], uncertainty, absolute)
                yield (
                    block if shifts is None else _with_shifts(problem, shared, block, values[chosen], shifts[:, chosen])
                )


def _known(shifts: Values, used: npt.NDArray[np.bool_], causes: tuple[str, ...]) -> Values:
    """Shifts (causes, lanes, points), zero for what is not in use, NaN in lanes where one of any cause is unknown."""
    good: npt.NDArray[np.bool_] = np.isfinite(shifts)
    if causes == (WHOLE,):  # a total is no shift, and has no sign
        good &= shifts >= 0
    unknown = np.asarray((~good & used).any(axis=(0, 2)))
    return np.where(unknown[None, :, None], np.nan, np.where(used & good, shifts, 0.0))


def _with_shifts(problem: Problem, shared: Shared, block: LaneBlock, values: Values, shifts: Values) -> LaneBlock:
    """The block with the shifts of its targets, from those of the values (causes, lanes, points)."""
    placed = np.stack([shared.placed(one) for one in shifts])
    over = shared.placed(np.where(values > 0, values, 1.0)) if problem.logarithmic else block.scale
    return replace(block, shifts=placed * block.root / over)


def _block(
    problem: Problem,
    shared: Shared,
    rows: npt.NDArray[np.intp],
    values: Values,
    used: npt.NDArray[np.bool_],
    stated: Values | None,
    absolute: bool,
) -> LaneBlock:
    """The block of some lanes (rows,), from their values, which are in use, and stated uncertainties (rows, points).

    With `absolute` every value in use needs a stated uncertainty, finite and above zero, or its lane is not fitted.
    """
    weights, weighed, of_directions = _weights(problem, values, used, stated)
    peak = np.abs(values * used).max(axis=1, initial=0.0)
    weighed &= (peak == 0) | ((peak >= LEAST_PEAK) & (peak <= MOST_PEAK))
    values = np.where(weighed[:, None], values, 0.0)  # whose squares would be no numbers
    if absolute and stated is not None:
        weighed &= (is_stated(stated) | ~used).all(axis=1)
    one_root = of_directions and bool(used.all())
    root = np.sqrt(weights) if one_root else np.sqrt(weights) * used
    root, target, scale, by_error = (_logarithms if problem.logarithmic else _shares)(root, values)
    status = _statuses(scale, weighed, peak, used)
    # Lanes that are not fitted stay in the block. Their targets of zero keep NaN and infinity out of the search.
    scale[status != FITTED] = 1.0
    target = np.where((status == FITTED)[:, None], target, 0.0)
    error = np.zeros((0, values.shape[1]))
    if absolute and stated is not None:
        error = np.where(used & is_stated(stated), stated, 0.0) * by_error
    counts = ~shared.filled.reshape(shared.layout.cells, shared.layout.rows, 1)  # padding repeats points
    return LaneBlock(
        one_root=one_root,
        rows=rows,
        root=shared.placed(root) * counts,
        target=shared.placed(target) * counts,
        error=shared.placed(error) * counts,
        scale=scale,
        seen=_seen(shared, used),
        points=used.sum(axis=1).astype(np.int32),
        status=status,
        crossed=np.zeros(len(values), dtype=np.int8),
    )


def _statuses(
    scale: Values, weighed: npt.NDArray[np.bool_], peak: Values, used: npt.NDArray[np.bool_]
) -> npt.NDArray[np.int8]:
    """Why each lane cannot be fitted, or FITTED."""
    # Several can be true of a lane, and the last one that is set stays: an empty lane has a peak of zero too.
    status = np.full(len(scale), FITTED, dtype=np.int8)
    status[scale == 0] = code(Status.ALL_ZERO)
    status[~weighed] = code(Status.NOT_WEIGHED)
    status[peak == 0] = code(Status.ALL_ZERO)
    status[~used.any(axis=1)] = code(Status.NO_POINTS)
    return status


def _shares(root: Values, values: Values) -> tuple[Values, Values, Values, Values]:
    """Roots, targets, scales (lanes,), and the factor of an uncertainty: weighted values over their length."""
    scale = np.sqrt(np.sum((root * values) ** 2, axis=1))
    divisor = np.where(scale > 0, scale, 1.0)[:, None]
    return root, values * root / divisor, scale, root / divisor


def _logarithms(root: Values, values: Values) -> tuple[Values, Values, Values, Values]:
    """The same for logarithms: roots have a squared sum of 1, and the scale is the geometric mean of the values.

    An error of a value is one of its logarithm over the value. Values without a logarithm get that of 1: their points
    have no weight, or their lane is not fitted.
    """
    length = np.sqrt(np.sum(root**2, axis=1, keepdims=True))
    root = root / np.where(length > 0, length, 1.0)
    positive = np.where(values > 0, values, 1.0)
    level = np.sum(root**2 * np.log(positive), axis=1, keepdims=True)
    return root, root * (np.log(positive) - level), np.exp(level[:, 0]), root / positive


def _weights(
    problem: Problem, values: Values, used: npt.NDArray[np.bool_], stated: Values | None
) -> tuple[Values, npt.NDArray[np.bool_], bool]:
    """The weights of the points, (lanes or 1, points), which lanes have them all, and whether they are of directions.

    Weights that follow from directions alone are one row, and the same for every block. A weighting raises ValueError
    for a value without a weight. Here that is the matter of one lane, so such values, and those not in use, are
    replaced by 1 before it is asked.
    """
    weighting, points = WEIGHTINGS[problem.weighting], problem.points
    variables = {"brdf": values}
    if stated is not None:
        variables["uncertainty"] = stated
    scans = xr.Dataset({n: (("lane", "direction"), v) for n, v in variables.items()}, coords=points.coords)
    suits: npt.NDArray[np.bool_] = weighting.suits(scans, problem.noise_floor) | ~used
    for name, value in variables.items():
        scans[name] = (("lane", "direction"), np.where(suits & used, value, 1.0))
    of_points = weighting.weights(scans, problem.noise_floor)
    weights = np.atleast_2d(of_points)
    for name, g in (("theta_i", problem.g1), ("theta_r", problem.g2)):
        if g is not None:
            weights = weights * np.asarray(g(points[name].values))
    return weights, np.all(suits, axis=1), of_points.ndim == 1


def _seen(shared: Shared, used: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Which values of each lane (lanes, n + d) have a point in use.

    With one weight a group, a lane can lack all points of a group: its value is then NaN, and the others are fitted.
    """
    layout = shared.layout
    places = used[:, shared.order] & ~shared.filled
    cells = np.any(places.reshape(len(used), layout.cells, layout.rows), axis=2)
    seen = np.zeros((len(used), layout.n + layout.d), dtype=bool)
    for start, columns in ((0, layout.weights), (layout.n, layout.shape)):
        for _, index in columns:
            for cell, column in enumerate(index):
                seen[:, start + column] |= cells[:, cell]
    return seen
