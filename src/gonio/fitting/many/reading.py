"""Lanes of a stack as a compiled search takes them: weighted, scaled, laid out; and why a lane cannot be fitted."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.many.layout import Shared
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.weighting import WEIGHTINGS
from gonio.fitting.status import Status, code
from gonio.measured.stack import StackLanes

Values = npt.NDArray[Any]
READ = 2**20  # values that are read at once
LANED = ("rows", "scale", "seen", "points", "status", "crossed")
FITTED = -1  # status of a lane that a search decides about


@dataclass(frozen=True, eq=False)
class LaneBlock:
    """Lanes that are searched side by side.

    alike: whether points are weighed alike in all lanes, so that one root does for all. rows: which lanes of the stack
    they are. root (cells, rows, lanes, or 1 where alike), target, error (cells, rows, lanes; error none where it is not
    asked for): roots of weights, values and stated uncertainties. scale (lanes): the unit of each lane's weights. seen
    (lanes, n + d): which values have any point. points: of each lane in use. status: why a lane cannot be fitted, or
    FITTED. crossed: how often better shapes were looked for across a minimum.
    """

    alike: bool
    rows: npt.NDArray[np.intp]
    root: Values
    target: Values
    error: Values
    scale: Values
    seen: npt.NDArray[np.bool_]
    points: npt.NDArray[np.int32]
    status: npt.NDArray[np.int8]
    crossed: npt.NDArray[np.int8]

    def __len__(self) -> int:
        return len(self.rows)

    def part(self, which: npt.NDArray[np.intp]) -> "LaneBlock":
        """Some of the lanes."""
        laned = {n: getattr(self, n)[which] for n in LANED}
        root = self.root if self.alike else self.root[..., which]
        error = self.error[..., which] if self.error.shape[-1] else self.error
        return LaneBlock(self.alike, root=root, target=self.target[..., which], error=error, **laned)


def joined(blocks: list[LaneBlock]) -> LaneBlock:
    """Several blocks, all of lanes that are weighed alike or all of lanes that are not, as one."""
    first = blocks[0]
    laned = {n: np.concatenate([getattr(b, n) for b in blocks]) for n in LANED}
    target, error, root = (
        np.concatenate([getattr(b, n) for b in blocks], axis=-1) for n in ("target", "error", "root")
    )
    return LaneBlock(first.alike, root=first.root if first.alike else root, target=target, error=error, **laned)


def blocks(problem: Problem, shared: Shared, lanes: StackLanes, width: int, absolute: bool) -> Iterator[LaneBlock]:
    """All lanes of a stack, at most `width` at a time; with `absolute`, their stated uncertainties too.

    Lanes with gaps go by themselves: the others are then weighed alike, whatever neighbours they have, and quicker.
    """
    many = max(READ // len(shared.order) // width, 1) * width
    for first in range(0, len(lanes), many):
        last = min(first + many, len(lanes))
        values = np.array(lanes.values("brdf", first, last), dtype=float)
        used = np.isfinite(values)
        if lanes.has_own("mask"):
            used &= lanes.values("mask", first, last) == 0
        values[~used] = 0.0
        stated = np.array(lanes.values("uncertainty", first, last), dtype=float) if "uncertainty" in lanes else None
        whole = used.all(axis=1)
        for rows in (np.flatnonzero(whole), np.flatnonzero(~whole)):
            for begin in range(0, len(rows), width):
                some = rows[begin : begin + width]
                own = None if stated is None else stated[some]
                yield _block(problem, shared, first + some, values[some], used[some], own, absolute)


def _block(
    problem: Problem,
    shared: Shared,
    rows: npt.NDArray[np.intp],
    values: Values,
    used: npt.NDArray[np.bool_],
    stated: Values | None,
    absolute: bool,
) -> LaneBlock:
    weights, weighed = _weights(problem, values, used, stated)
    if absolute and stated is not None:
        weighed &= ((stated > 0) | ~used).all(axis=1)
    alike = len(weights) == 1 and bool(used.all())
    root = np.sqrt(weights) if alike else np.sqrt(weights) * used
    scale = np.sqrt(np.sum((root * values) ** 2, axis=1))
    status = np.full(len(values), FITTED, dtype=np.int8)
    status[scale == 0] = code(Status.ALL_ZERO)
    status[~weighed] = code(Status.NOT_WEIGHED)
    status[~used.any(axis=1)] = code(Status.NO_POINTS)
    scale[status != FITTED] = 1.0
    values = np.where((status == FITTED)[:, None], values, 0.0) * root / scale[:, None]
    error = np.zeros((0, values.shape[1]))
    if absolute and stated is not None:
        error = np.where(used & (stated > 0), stated, 0.0) * root / scale[:, None]
    counts = ~shared.filled.reshape(shared.layout.cells, shared.layout.rows, 1)
    return LaneBlock(
        alike=alike,
        rows=rows,
        root=shared.placed(root) * counts,
        target=shared.placed(values) * counts,
        error=shared.placed(error) * counts,
        scale=scale,
        seen=_seen(shared, used),
        points=used.sum(axis=1).astype(np.int32),
        status=status,
        crossed=np.zeros(len(values), dtype=np.int8),
    )


def _weights(
    problem: Problem, values: Values, used: npt.NDArray[np.bool_], stated: Values | None
) -> tuple[Values, npt.NDArray[np.bool_]]:
    """The weights of the points, (lanes or 1, points), and which lanes have them all."""
    weighting, points = WEIGHTINGS[problem.weighting], problem.points
    own = {"brdf": values}
    if stated is not None:
        own["uncertainty"] = stated
    many = xr.Dataset({n: (("lane", "direction"), v) for n, v in own.items()}, coords=points.coords)
    suits: npt.NDArray[np.bool_] = weighting.suits(many, problem.noise_floor) | ~used
    for name, value in own.items():
        many[name] = (("lane", "direction"), np.where(suits & used, value, 1.0))
    weights = np.atleast_2d(weighting.weights(many, problem.noise_floor))
    for name, g in (("theta_i", problem.g1), ("theta_r", problem.g2)):
        if g is not None:
            weights = weights * np.asarray(g(points[name].values))
    return weights, np.all(suits, axis=1)


def _seen(shared: Shared, used: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Which values of each lane (lanes, n + d) have a point in use."""
    layout = shared.layout
    places = used[:, shared.order] & ~shared.filled
    cells = np.any(places.reshape(len(used), layout.cells, layout.rows), axis=2)
    seen = np.zeros((len(used), layout.n + layout.d), dtype=bool)
    for start, columns in ((0, layout.weights), (layout.n, layout.shape)):
        for _, of in columns:
            for cell, column in enumerate(of):
                seen[:, start + column] |= cells[:, cell]
    return seen
