"""Stacks: many scans in one Dataset, told apart by dimensions that a single scan has not, the lanes."""

from collections.abc import Sequence

import numpy as np
import xarray as xr

from gonio.measured.dataset import ANGLES, DIRECTIONS, SETS


def lane_dims(stack: xr.Dataset, each: Sequence[str] = ()) -> tuple[str, ...]:
    """The dimensions of `brdf` along which every scan is fitted for itself: no directions, no SETS but those of each.

    Raises ValueError where there is none.
    """
    if "brdf" not in stack or any(angle not in stack.variables for angle in ANGLES):
        raise ValueError(f"a stack needs a variable brdf and coordinates {', '.join(ANGLES)}")
    dims = [str(d) for d in stack["brdf"].dims]
    if unknown := [name for name in each if name not in dims]:
        raise ValueError(f"the stack has no dimension {unknown[0]!r} to fit each of; it has {', '.join(dims)}")
    axes = {d for name in DIRECTIONS if name in stack.variables for d in stack[name].dims}
    lanes = tuple(d for d in dims if d in each or (d not in axes and d not in SETS))
    if not lanes:
        raise ValueError(f"this is one scan, over {', '.join(dims)}, and no stack: gonio fit takes it")
    return lanes


def one_scan(stack: xr.Dataset, lanes: Sequence[str]) -> xr.Dataset:
    """A scan with the directions and sets of every lane, all ones."""
    kept = stack.drop_vars([n for n in stack.variables if set(stack[n].dims) & set(lanes)])
    dims = [d for d in stack["brdf"].dims if d not in lanes]
    names = [n for n in ("brdf", "uncertainty") if n in stack]
    ones = np.ones([stack.sizes[d] for d in dims])
    return kept.assign({n: (dims, ones.copy(), stack[n].attrs) for n in names})
