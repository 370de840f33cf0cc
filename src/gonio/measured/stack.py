"""Many scans of the same directions in one Dataset: lanes beside a scan's own dimensions.

A lane is one scan of the stack: a sample, a pixel, a ground cell, or a wavelength that is fitted on its own. Lanes
share their directions; each has its own values, uncertainties, mask and gaps.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.causes import CAUSE, SYSTEMATIC, TOTAL, WHOLE
from gonio.measured.coordinates import SYSTEMS
from gonio.measured.dataset import AXES, DIRECTIONS, HORIZON, SETS

NODE = "node"  # each node's place along the scan's dimensions
LANED = ("brdf", "uncertainty", TOTAL, "mask")  # what each lane may have of its own


def lane_dims(stack: xr.Dataset, each: Sequence[str] = ()) -> tuple[str, ...]:
    """The dimensions of `brdf` that tell scans apart, in their order: those that are of no scan, and those in `each`.

    Raises ValueError where there is none, or where `each` names no dimension.
    """
    dims = [str(d) for d in stack["brdf"].dims]
    if unknown := [name for name in each if name not in dims]:
        raise ValueError(f"brdf has no dimension {unknown[0]!r} to fit one at a time; it has {', '.join(dims)}")
    found = tuple(d for d in dims if d in (*foreign_dims(stack), *each))
    if not found:
        raise ValueError(
            f"this is one scan, over {', '.join(dims)}, and no stack of scans: give brdf a dimension such as `sample`, "
            "or name one whose values are fitted one at a time"
        )
    return found


def foreign_dims(scan: xr.Dataset) -> tuple[str, ...]:
    """The dimensions of `brdf` that are of no scan: neither directions nor sets of them."""
    own = {"direction", *SETS, *DIRECTIONS, *(axis for system in SYSTEMS.values() for axis in system.axes)}
    own |= set(str(scan.attrs.get(AXES, "")).split())
    return tuple(str(d) for d in scan["brdf"].dims if d not in own)


def one_scan(stack: xr.Dataset, lanes: Sequence[str]) -> xr.Dataset:
    """A scan of the stack's directions with a value at every one, and `node`, its place in the stack.

    Raises ValueError where directions differ from lane to lane.
    """
    for name in (*DIRECTIONS, *SETS):
        if name in stack.coords and name not in lanes and set(stack[name].dims) & set(lanes):
            raise ValueError(f"{name} differs from lane to lane, and lanes share their directions: fit them in groups")
    first = stack.isel(dict.fromkeys(lanes, 0), drop=True)
    first = first.drop_vars([SYSTEMATIC, CAUSE], errors="ignore")  # of values, which these are none
    first = first.drop_vars([n for n in LANED if n in first and n != "brdf" and set(stack[n].dims) & set(lanes)])
    below = (first["theta_i"] > HORIZON) | (first["theta_r"] > HORIZON)
    # By its shape alone: the values of the first lane stay in the store.
    ones = first["brdf"].copy(data=np.ones(first["brdf"].shape)).where(~below)
    nodes = np.arange(first["brdf"].size).reshape(first["brdf"].shape)
    filled = {"brdf": ones.assign_attrs(first["brdf"].attrs), NODE: (first["brdf"].dims, nodes)}
    if "uncertainty" in stack and "uncertainty" not in first:
        filled["uncertainty"] = ones.assign_attrs(stack["uncertainty"].attrs)
    return first.assign(filled)


class StackLanes:
    """The lanes of a stack, read so many at a time: a stack on disk is never held whole.

    Lanes are numbered along the flattened lane dimensions, the last running fastest.
    """

    def __init__(self, stack: xr.Dataset, dims: Sequence[str], nodes: npt.NDArray[np.intp]) -> None:
        self.dims = tuple(dims)
        self.shape = tuple(stack.sizes[d] for d in dims)
        self._rest = [d for d in stack["brdf"].dims if d not in dims]
        self._stack, self._nodes = stack, nodes

    def __len__(self) -> int:
        return math.prod(self.shape)

    @property
    def causes(self) -> tuple[str, ...]:
        """The causes of systematic uncertainty that the stack states, as `measured.causes` names them."""
        if SYSTEMATIC in self._stack:
            count = self._stack.sizes[CAUSE]
            return tuple(map(str, self._stack[CAUSE].values if CAUSE in self._stack.coords else range(count)))
        return (WHOLE,) if TOTAL in self._stack else ()

    def shifts(self, first: int, last: int) -> npt.NDArray[np.float64]:
        """The shift of every value of some lanes by each cause (causes, lanes, points)."""
        if SYSTEMATIC not in self._stack:
            return self.values(TOTAL, first, last)[None].astype(float)
        by_cause = (self._stack[SYSTEMATIC].isel({CAUSE: k}, drop=True) for k in range(self._stack.sizes[CAUSE]))
        return np.stack([self._of_lanes(one, first, last).astype(float) for one in by_cause])

    def values(self, name: str, first: int, last: int) -> npt.NDArray[Any]:
        """A variable of some lanes (lanes, points), as floats."""
        return self._of_lanes(self._stack[name], first, last)

    def _of_lanes(self, variable: xr.DataArray, first: int, last: int) -> npt.NDArray[Any]:
        whole = variable.transpose(*(d for d in self.dims if d in variable.dims), ...)
        if self.dims[0] not in whole.dims:
            whole = whole.expand_dims({self.dims[0]: self.shape[0]})
        inner = math.prod(self.shape[1:])
        begin, end = first // inner, -(-last // inner)  # rows of the first dimension that hold these lanes
        some = whole.isel({self.dims[0]: slice(begin, end)}).load()
        dims = [*self.dims, *self._rest]
        missing = {d: self._stack.sizes[d] for d in dims if d not in some.dims}
        flat = some.expand_dims(missing).transpose(*dims).values.reshape((end - begin) * inner, -1)
        return flat[first - begin * inner : last - begin * inner, self._nodes]

    def __contains__(self, name: str) -> bool:
        return name in self._stack

    def has_own(self, name: str) -> bool:
        """Whether the lanes differ in a variable."""
        return name in self._stack and bool(set(self._stack[name].dims) & set(self.dims))
