"""Whether the lobe of a table lies on the side of the source, as where a table counts theta_r the other way."""

import numpy as np
import xarray as xr

from gonio.measured.dataset import in_use, is_in_plane, sets, signed_theta_r
from gonio.tables.request import Asker

STEEP, NEAR = 5.0, 5.0  # deg: incidence at which the two sides are apart, and how near to a direction a lobe lies


def source_side(scan: xr.Dataset, asker: Asker) -> list[str]:
    """A warning with the remedy where the largest values lie towards the source at every incidence angle; else none.

    Where both sides were measured they are compared; where only one was, it is this one.
    """
    if asker.request.flip:
        return []
    rows = np.flatnonzero(in_use(scan) & is_in_plane(scan) & (scan["theta_i"].values >= STEEP))
    part = scan.isel(direction=rows)
    theta_i, signed, values = part["theta_i"].values, signed_theta_r(part), part["brdf"].values
    if several := sets(part):
        first = part[several[0]].values[0] if len(rows) else None
        chosen = part[several[0]].values == first
        theta_i, signed, values = theta_i[chosen], signed[chosen], values[chosen]
    peaks = []
    for angle in np.unique(theta_i):
        here = theta_i == angle
        if signed[here].size > 2 and signed[here].min() <= NEAR - angle:  # the direction of the source was measured
            peak = float(signed[here][int(np.argmax(values[here]))])
            peaks.append(
                abs(peak + angle) < min(abs(peak - angle), NEAR + 1e-9) or (peak < 0 and abs(peak + angle) <= NEAR)
            )
    if not peaks or not all(peaks):
        return []
    what = f"the largest values lie on the side of the source, theta_r = -theta_i, at all {len(peaks)} incidence angles"
    return [f"{what}: if the table counts theta_r the other way, --flip turns it; a retroreflector looks the same"]
