"""The two sides of an opaque sample in a file of matrices.

Radiance's z axis points to the side that files call the back: what a file calls `Reflection Front` is seen on the back
of a polygon, and its front is black where the file has nothing for the back. A sample that is opaque has one surface,
so a scan that names no side is written for both, as if the sample were turned over about its x axis. Azimuths in the
file are about the front's normal, and so change sign for the back.
"""

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.formats.radiance.klems import Basis
from gonio.measured.dataset import add_history, modes

Array = npt.NDArray[np.float64]

BOTH = (
    "written for both sides: Radiance shows Reflection Front on the back of a polygon, for its z axis points the other "
    "way"
)
ONE = (
    "Radiance shows Reflection Front on the back of a polygon, whose front is black with this file: leave the side out "
    "of the data, and both sides are written"
)


def is_for_both(scan: xr.Dataset) -> bool:
    """Whether a scan is of reflection alone and names no side."""
    return "side" not in scan.coords and modes(scan) == {"reflection"}


def remark(scan: xr.Dataset) -> str:
    """What a user of the written file has to know of its sides; empty where it has both."""
    if is_for_both(scan):
        return BOTH
    sides = set(np.unique(scan["side"].values).tolist()) if "side" in scan.coords else {"front"}
    return ONE if sides == {"front"} else ""


def turned_over(matrix: Array, incident: Basis, outgoing: Basis) -> Array:
    """The matrix (.., incident, outgoing) of the other side of a sample that was turned over about its x axis."""
    theta_i, column = incident.centres()
    theta_r, row = outgoing.centres()
    columns, rows = incident.index(theta_i, -column), outgoing.index(theta_r, -row)
    turned: Array = matrix[..., columns[:, None], rows]
    return turned


def kept_once(scan: xr.Dataset, incident: Basis, outgoing: Basis) -> xr.Dataset:
    """A scan of matrices over sides, incident and outgoing patches, without its side, where both are one surface."""
    if list(scan["side"].values) != ["front", "back"] or list(scan["mode"].values) != ["reflection"]:
        return scan
    front, back = (
        scan["brdf"].sel(side=name).transpose(..., "incident", "outgoing").values for name in scan["side"].values
    )
    if not np.array_equal(turned_over(front, incident, outgoing), back):
        return scan
    return add_history(scan.isel(side=0, drop=True), "front and back are one surface, turned over: kept once")
