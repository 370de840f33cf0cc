"""The fits of many lanes: put in as they end, the Dataset that they become, and the Solution of one of them.

Lanes end in no particular order, and one can end twice, when a search begins again from a better shape. Results are
therefore arrays over all lanes, whose rows are filled or replaced. A search measures weights in units of each lane's
data; here they, and their covariances, get the unit of the data again.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.many.layout import Layout
from gonio.fitting.many.reading import FITTED, LaneBlock
from gonio.fitting.objective.problem import Problem
from gonio.fitting.schema import ATTRIBUTES, COORDINATES, Parameters, assembled, shared_attributes
from gonio.fitting.solution import Solution
from gonio.fitting.status import MINIMA, STATUSES, Status, code
from gonio.measured.causes import CAUSE, total
from gonio.measured.stack import StackLanes
from gonio.model import Model

if TYPE_CHECKING:
    from gonio.fitting.many.descent import State

Values = npt.NDArray[Any]
Places = npt.NDArray[np.intp]
Mask = npt.NDArray[np.bool_]


class Ended(NamedTuple):
    """Where the searches of a block's lanes are."""

    state: "State"
    covariance: Any  # (n, n, lanes) in units of each lane's data, or None; may hold lanes that only fill up the block
    done: Mask  # which lanes have ended by themselves, and not by running out of steps


class Results:
    """The values of every lane, put in as their searches end.

    value, at_bound (lanes, n); covariance (lanes, n, n), None where it is not asked for; shift (lanes, causes, n), by
    each of the causes that the stack states; cost, steps, points, status (lanes,), with n free values. A lane that
    nothing was put in for has no values (NaN) and says NO_POINTS.
    """

    def __init__(self, problem: Problem, count: int, covariance: str, causes: tuple[str, ...] = ()) -> None:
        size = len(problem.names)
        self.causes, self.shift = causes, np.full((count, len(causes), size), np.nan)
        self.lower, self.upper = problem.lower, problem.upper
        self.value = np.full((count, size), np.nan)
        self.at_bound = np.zeros((count, size), dtype=bool)
        self.covariance = np.full((count, size, size), np.nan) if covariance else None
        self.cost = np.full(count, np.nan)
        self.steps = np.zeros(count, dtype=np.int32)
        self.points = np.zeros(count, dtype=np.int32)
        self.status = np.full(count, code(Status.NO_POINTS), dtype=np.int8)

    def put(self, layout: Layout, block: LaneBlock, axes: tuple[Any, ...], ended: Ended, which: Places) -> None:
        """Values of the lanes at places `which` of a block in the units of their data, and what became of them.

        They replace what was put in before: a search that begins again does so from a lower E, and only lowers it.
        A value that no point of the lane says anything of is NaN with infinite variance; a lane that could not be
        fitted is NaN throughout.
        """
        from gonio.fitting.many.projection import shape_values

        state, rows, n = ended.state, block.rows[which], layout.n
        unit, side = np.asarray(state.unit)[:, which], np.asarray(state.side)[:, which]
        shape = np.asarray(shape_values(state.unit, axes))[:, which]
        scale = np.concatenate([np.tile(block.scale[which], (n, 1)), np.ones_like(shape)]).T
        value = np.concatenate([np.asarray(state.weights)[:, which], shape]).T * scale
        value = np.clip(value, self.lower, self.upper)  # the unit of a lane moves a bound by rounding
        bound = np.concatenate([side != 0, (unit <= 0) | (unit >= 1)]).T
        seen, refused = block.seen[which], block.status[which] != FITTED
        value[~seen], bound[~seen] = np.nan, False
        value[refused], bound[refused] = np.nan, False
        self.value[rows], self.at_bound[rows] = value, bound
        self.cost[rows] = np.where(refused, np.nan, np.asarray(state.cost)[which])
        self.steps[rows], self.points[rows] = np.asarray(state.steps)[which], block.points[which]
        undetermined = ~seen
        if self.covariance is not None:
            covariance = np.moveaxis(np.asarray(ended.covariance)[..., which], -1, 0)
            covariance = covariance * scale[:, :, None] * scale[:, None, :]
            undetermined = _marked(covariance, undetermined)
            covariance[refused] = np.nan
            self.covariance[rows] = covariance
        # Several can be true of a lane. The last one that is set stays: the reason to trust its values least.
        status = np.full(len(rows), code(Status.CONVERGED), dtype=np.int8)
        status[bound.any(axis=1)] = code(Status.AT_BOUND)
        status[undetermined.any(axis=1)] = code(Status.NOT_DETERMINED)
        status[~ended.done[which]] = code(Status.STEPS_EXHAUSTED)
        status[block.points[which] <= seen.sum(axis=1)] = code(Status.TOO_FEW_POINTS)
        self.status[rows] = np.where(refused, block.status[which], status)

    def dataset(self, problem: Problem, stack: xr.Dataset, lanes: StackLanes) -> xr.Dataset:
        """All lanes as a Dataset over the lane dimensions of the stack and `parameter`.

        Variables: value, at_bound, uncertainty, covariance of each lane, held, as in a Solution; cost, status (an index
        of its flag_meanings), steps, points and converged of each lane. Coordinates of the stack along its lane
        dimensions come along. Where the stack states systematic uncertainties: shift_by_cause, over `cause` too, and
        uncertainty_systematic, as in a Solution. If no covariance was asked for, covariance and uncertainties are left
        out, and a value counts as not determined only where it has no point.
        """
        parameters, dims = Parameters.of(problem), lanes.dims

        def of_lanes(values: Values) -> Values:
            return values.reshape(*lanes.shape, *values.shape[1:])

        data: dict[str, Any] = {
            "value": ((*dims, "parameter"), of_lanes(parameters.values(self.value))),
            "at_bound": ((*dims, "parameter"), of_lanes(parameters.spread(self.at_bound, False))),
            "held": ("parameter", ~parameters.free),
        }
        per_lane = {"cost": self.cost, "status": self.status, "steps": self.steps, "points": self.points}
        per_lane["converged"] = np.isin(self.status, [code(status) for status in MINIMA])
        data |= {name: (dims, values.reshape(lanes.shape)) for name, values in per_lane.items()}
        if self.covariance is not None:
            covariance = of_lanes(parameters.spread(self.covariance, np.nan, axes=2))
            data["covariance"] = ((*dims, "parameter", "parameter_b"), covariance)
            uncertainty = np.sqrt(np.diagonal(covariance, axis1=-2, axis2=-1))
            data["uncertainty"] = ((*dims, "parameter"), uncertainty)
        if self.causes:
            shift = of_lanes(parameters.spread(self.shift, np.nan))
            data["shift_by_cause"] = ((*dims, CAUSE, "parameter"), shift)
            data["uncertainty_systematic"] = ((*dims, "parameter"), total(np.moveaxis(shift, -2, 0)))
        of_stack = {str(n): c.variable for n, c in stack.coords.items() if c.dims and set(c.dims) <= set(dims)}
        coords = {name: (COORDINATES[name].dims, column) for name, column in parameters.coords.items()}
        attrs = shared_attributes(problem) | {"data_history": stack.attrs.get("history", "")}
        fits = xr.Dataset(data, coords=of_stack | coords, attrs=attrs)
        fits = fits.assign_coords({CAUSE: (CAUSE, np.array(self.causes, dtype=str))}) if self.causes else fits
        fits["status"].attrs = {  # the CF convention for a variable of numbers that stand for words
            "flag_values": np.arange(len(STATUSES), dtype=np.int8),
            "flag_meanings": " ".join(status.name.lower() for status in STATUSES),
        }
        return fits


def _marked(covariance: Values, unseen: Mask) -> Mask:
    """Mark in covariances (lanes, n, n), in place, the values without a point: infinite variance, no correlation.

    Returns which values (lanes, n) are not determined, for this reason or by the data that are in use.
    """
    covariance[unseen[:, :, None] | unseen[:, None, :]] = 0.0
    lane, column = np.nonzero(unseen)
    covariance[lane, column, column] = np.inf
    return np.isinf(np.diagonal(covariance, axis1=1, axis2=2))


def solution_of(lane: xr.Dataset, model: Model | None = None) -> Solution:
    """The Solution of one lane of what `fit_many` gave: `solution_of(fits.isel(sample=3))`.

    Its history holds the final E alone, because a search of many lanes records none.

    Parameters
    ----------
    lane : xarray.Dataset
        One place along all lanes.
    model : Model, optional
        The model; without it the one of that name in the catalogue.

    Returns
    -------
    Solution
        As `gonio.fit` gives it.

    Raises
    ------
    ValueError
        Lanes are left, or the catalogue does not have the model.

    """
    if remaining := [str(d) for d in lane["value"].dims if d != "parameter"]:
        raise ValueError(f"there are many lanes along {', '.join(remaining)}: choose one, as by isel({remaining[0]}=0)")
    columns = {name: lane[name].values for name in ("value", "at_bound", "held")}
    if "covariance" in lane:
        columns["covariance"] = lane["covariance"].values
    if "shift_by_cause" in lane:
        columns["shift_by_cause"] = lane["shift_by_cause"].transpose(CAUSE, "parameter").values
    columns["history"] = np.array([[float(lane["cost"])]])
    attributes = {name: value for name, value in lane.attrs.items() if name in ATTRIBUTES} | {
        "status": STATUSES[int(lane["status"])],
        "cost": float(lane["cost"]),
        "evaluations": int(lane["steps"]),
        "points": int(lane["points"]),
        "points_searched": int(lane["points"]),
        "effective_values": int((~lane["held"].values & np.isfinite(lane["value"].values)).sum()),
    }
    coords = {name: lane[name].values for name in (*COORDINATES, *[CAUSE] * ("shift_by_cause" in lane))}
    return Solution(assembled(coords, columns, attributes), model or _of_catalogue(str(lane.attrs["model"])))


def _of_catalogue(name: str) -> Model:
    """The model of a name: a Dataset of fits holds no more of its model. ValueError where the catalogue has none."""
    from gonio.models import catalogue

    if name not in catalogue:
        raise ValueError(
            f"the model of these fits, {name!r}, is not in the catalogue: pass the model, solution_of(lane, model)"
        )
    return catalogue[name]
