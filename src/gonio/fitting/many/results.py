"""What fits of many lanes found, put in as it is found, and the Dataset that it becomes."""

from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.many.layout import Layout
from gonio.fitting.many.reading import FITTED, Block
from gonio.fitting.objective.problem import Problem
from gonio.fitting.solution import STATUSES, Solution, Status, code
from gonio.measured import dataset
from gonio.measured.stack import Lanes

if TYPE_CHECKING:
    from gonio.fitting.many.projection import State

Values = npt.NDArray[Any]
MINIMA = (Status.CONVERGED, Status.AT_BOUND, Status.NOT_DETERMINED)  # of which the values are those of a minimum


class Results:
    """The values of every lane, put in as they are found."""

    def __init__(self, problem: Problem, count: int, covariance: str) -> None:
        size = len(problem.names)
        self.names = list(problem.names)
        self.n = problem.n_weights
        self.lower, self.upper = problem.lower, problem.upper
        self.value = np.full((count, size), np.nan)
        self.at_bound = np.zeros((count, size), dtype=bool)
        self.covariance = np.full((count, size, size), np.nan) if covariance else None
        self.cost = np.full(count, np.nan)
        self.steps = np.zeros(count, dtype=np.int32)
        self.points = np.zeros(count, dtype=np.int32)
        self.status = np.full(count, code(Status.NO_POINTS), dtype=np.int8)

    def put(
        self,
        layout: Layout,
        block: Block,
        axes: tuple[Any, ...],
        state: "State",
        spread: Any,
        kept: npt.NDArray[np.intp],
        done: npt.NDArray[np.bool_],
    ) -> None:
        """Values of the lanes `kept` of a block in their own units, and what became of them."""
        from gonio.fitting.many.projection import shape_values

        rows, n = block.rows[kept], layout.n
        unit, side = np.asarray(state.unit)[:, kept], np.asarray(state.side)[:, kept]
        shape = np.asarray(shape_values(state.unit, axes))[:, kept]
        scale = np.concatenate([np.tile(block.scale[kept], (n, 1)), np.ones_like(shape)]).T
        value = np.concatenate([np.asarray(state.weights)[:, kept], shape]).T * scale
        value = np.clip(value, self.lower, self.upper)  # the unit of a lane moves a bound by rounding
        bound = np.concatenate([side != 0, (unit <= 0) | (unit >= 1)]).T
        told, refused = block.told[kept], block.status[kept] != FITTED
        value[~told], bound[~told] = np.nan, False
        value[refused], bound[refused] = np.nan, False
        self.value[rows], self.at_bound[rows] = value, bound
        self.cost[rows] = np.where(refused, np.nan, np.asarray(state.cost)[kept])
        self.steps[rows], self.points[rows] = np.asarray(state.steps)[kept], block.points[kept]
        unknown = ~told
        if self.covariance is not None:
            full = np.moveaxis(np.asarray(spread)[..., kept], -1, 0) * scale[:, :, None] * scale[:, None, :]
            full[unknown[:, :, None] | unknown[:, None, :]] = 0.0
            lane, at = np.nonzero(unknown)
            full[lane, at, at] = np.inf
            unknown = np.isinf(np.diagonal(full, axis1=1, axis2=2))
            full[refused] = np.nan
            self.covariance[rows] = full
        status = np.full(len(rows), code(Status.CONVERGED), dtype=np.int8)
        status[bound.any(axis=1)] = code(Status.AT_BOUND)
        status[unknown.any(axis=1)] = code(Status.NOT_DETERMINED)
        status[~done[kept]] = code(Status.STEPS_EXHAUSTED)
        status[block.points[kept] <= told.sum(axis=1)] = code(Status.TOO_FEW_POINTS)
        self.status[rows] = np.where(refused, block.status[kept], status)

    def dataset(self, problem: Problem, stack: xr.Dataset, lanes: Lanes) -> xr.Dataset:
        entries = [(entry, label) for entry in problem.entries for label in entry.labels]
        free = np.flatnonzero([entry.held is None for entry, _ in entries])
        held = np.array([v for entry in problem.entries for v in entry.held or [np.nan] * entry.size])
        size, dims = len(entries), lanes.dims

        def laned(values: Values, fill: Any, extra: int = 0) -> Values:
            full = np.full((len(lanes), *(size,) * extra), fill, dtype=values.dtype)
            place: Any = (slice(None), *np.ix_(*(free,) * extra))
            full[place] = values
            return full.reshape(*lanes.shape, *full.shape[1:])

        value = laned(self.value, np.nan, 1)
        value[..., np.isfinite(held)] = held[np.isfinite(held)]
        per_lane = {"cost": self.cost, "status": self.status, "steps": self.steps, "points": self.points}
        per_lane["converged"] = np.isin(self.status, [code(status) for status in MINIMA])
        data: dict[str, Any] = {
            "value": ((*dims, "parameter"), value),
            "at_bound": ((*dims, "parameter"), laned(self.at_bound, False, 1)),
            "held": ("parameter", np.isfinite(held)),
        } | {name: (dims, values.reshape(lanes.shape)) for name, values in per_lane.items()}
        if self.covariance is not None:
            full = laned(self.covariance, np.nan, 2)
            data["covariance"] = ((*dims, "parameter", "parameter_b"), full)
            spread = np.sqrt(np.diagonal(full, axis1=-2, axis2=-1))
            data["uncertainty"] = ((*dims, "parameter"), spread)
        text = {
            "name": [entry.name for entry, _ in entries],
            "by": [",".join(entry.by) for entry, _ in entries],
            "group": [label for _, label in entries],
            "unit": [entry.unit for entry, _ in entries],
        }
        own = {str(n): c.variable for n, c in stack.coords.items() if c.dims and set(c.dims) <= set(dims)}
        found = xr.Dataset(
            data,
            coords=own
            | {"parameter": [name for entry in problem.entries for name in entry.names]}
            | {key: ("parameter", column) for key, column in text.items()},
            attrs={
                "model": problem.model.name,
                "cite": problem.model.cite,
                "weighting": problem.weighting,
                "noise_floor": problem.noise_floor,
                "unit": dataset.unit(problem.data),
                "data_history": stack.attrs.get("history", ""),
            },
        )
        found["status"].attrs = {
            "flag_values": np.arange(len(STATUSES), dtype=np.int8),
            "flag_meanings": " ".join(status.name.lower() for status in STATUSES),
        }
        return found


def solution(lane: xr.Dataset) -> Solution:
    """The Solution of one lane of what `fit_many` gave: `solution(found.isel(sample=3))`.

    Its history has no step; a systematic uncertainty is not known. Raises ValueError where lanes are left.
    """
    if left := [str(d) for d in lane["value"].dims if d != "parameter"]:
        raise ValueError(f"there are many lanes along {', '.join(left)}: choose one, as by isel({left[0]}=0)")
    size = lane.sizes["parameter"]
    none = ("parameter", np.full(size, np.nan))
    spread = lane.get("covariance", xr.DataArray(np.full((size, size), np.nan), dims=("parameter", "parameter_b")))
    status = STATUSES[int(lane["status"])]
    free = int((~lane["held"].values & np.isfinite(lane["value"].values)).sum())
    kept = lane[["value", "at_bound", "held"]].assign(
        covariance=spread,
        uncertainty=lane.get("uncertainty", xr.DataArray(none[1], dims="parameter")),
        uncertainty_systematic=none,
        systematic_shift=none,
        history=(("step", "chain"), np.array([[float(lane["cost"])]])),
    )
    return Solution(
        kept.assign_attrs(
            lane.attrs,
            status=status.value,
            cost=float(lane["cost"]),
            evaluations=int(lane["steps"]),
            points=int(lane["points"]),
            points_searched=int(lane["points"]),
            effective_values=free,
            loss="squared",
            loss_scale=0.0,
            points_discounted=0,
            smooth="",
            instrument_error=0.0,
        )
    )
