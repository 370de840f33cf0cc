"""Two scans of a page at common directions: the second at those of the first."""

import itertools
from typing import Any

import numpy as np
import xarray as xr

from gonio.measured.sound import is_stated
from gonio.resampling.difference import difference
from gonio.viewing.session import Opened, Session

FEW = 3  # scans of which a page holds every pair
ROW = "row_of_page"  # a coordinate that remembers the order


def pair(first: Opened, second: Opened) -> dict[str, Any]:
    """The second scan at the directions of the first, in the rows of its columns.

    `value` and `uncertainty` are lists, None where the second scan has nothing; `exact` says where it was measured and
    not interpolated. Raises ValueError where the two cannot be compared: units, sets, or modes differ.
    """
    points = first.columns.points
    count = points.sizes["direction"]
    rows = points.assign({ROW: ("direction", np.arange(count))})
    found = difference(second.scan, rows)
    place = found.points[ROW].values.astype(int)
    value = np.full(count, np.nan)
    value[place] = found.points["other"].values
    exact = np.zeros(count, dtype=bool)
    exact[place] = found.points["exact"].values
    return {
        "name": second.name,
        "value": _listed(value),
        "uncertainty": _listed(_uncertainty(second.scan, rows, count)),
        "exact": exact.tolist(),
        "missing": int(found.missing),
        "rms": found.rms if np.isfinite(found.rms) else None,
        "bias": found.bias if np.isfinite(found.bias) else None,
    }


def _uncertainty(scan: xr.Dataset, rows: xr.Dataset, count: int) -> np.ndarray:
    """The standard uncertainty of the second scan, interpolated as its values are: errors of neighbours as one."""
    uncertainty = np.full(count, np.nan)
    if "uncertainty" not in scan:
        return uncertainty
    stated = scan["uncertainty"].where(is_stated(scan["uncertainty"].values))
    if not bool(stated.notnull().any()):
        return uncertainty
    instead = scan.assign(brdf=scan["brdf"].copy(data=stated.values)).drop_vars("uncertainty")
    found = difference(instead, rows)
    uncertainty[found.points[ROW].values.astype(int)] = found.points["other"].values
    return uncertainty


def _listed(values: np.ndarray) -> list[float | None]:
    return [float(v) if np.isfinite(v) else None for v in values]


def every_pair(session: Session) -> dict[str, dict[str, Any]]:
    """What a page holds that cannot ask: every pair of at most FEW scans, else the one that it begins with.

    By the places of both; where two scans cannot be compared, why not.
    """
    places = range(len(session.opened)) if len(session.opened) <= FEW else tuple(session.pair)
    found = {}
    for first, second in itertools.permutations(places, 2):
        try:
            found[f"{first} {second}"] = pair(session.opened[first], session.opened[second])
        except ValueError as error:
            found[f"{first} {second}"] = {"error": str(error)}
    return found
