"""Values that must not be fitted: masked with a reason, and kept."""

import numpy as np
import xarray as xr

from gonio.measured.dataset import MASK_MEANINGS, add_history, flatten, is_in_plane, signed_theta_r


def mask(
    scan: xr.Dataset,
    *,
    blocked: float = 0.0,
    floor: float | None = None,
    exclude: "xr.DataArray | None" = None,
    why: str = "excluded by the user",
) -> xr.Dataset:
    """Mark values that take no part in fits and comparisons; nothing is deleted.

    Parameters
    ----------
    scan : xarray.Dataset
        The scan.
    blocked : float
        In-plane directions nearer than this [deg] to the incident beam, `|theta_r + theta_i| < blocked` on the
        backscatter side, where the detector's arm stands in the beam.
    floor : float, optional
        Values below it [unit of the BRDF] are the noise of the instrument.
    exclude : xarray.DataArray, optional
        Booleans over the flat directions, for what only the user knows.
    why : str
        What the history says of `exclude`.

    Returns
    -------
    xarray.Dataset
        The flat scan with `mask`.

    Raises
    ------
    ValueError
        The angle is outside 0 to 180 deg, or the floor is no finite number.

    """
    if not 0 <= blocked <= 180:
        raise ValueError(f"blocked is {blocked:g}: give an angle from 0 to 180 deg")
    if floor is not None and not np.isfinite(floor):
        raise ValueError(f"the floor is {floor:g}: give a finite number in the unit of the BRDF")
    flat = flatten(scan)
    flags = flat["mask"].values.copy() if "mask" in flat else np.zeros(flat.sizes["direction"], dtype=np.int8)
    reasons = []
    if blocked > 0:
        near = is_in_plane(flat) & (np.abs(signed_theta_r(flat) + flat["theta_i"].values) < blocked)
        reasons.append(_mark(flags, near, 1, f"within {blocked:g} deg of the incident beam"))
    if floor is not None:
        reasons.append(_mark(flags, flat["brdf"].values < floor, 2, f"below the noise floor {floor:g}"))
    if exclude is not None:
        reasons.append(_mark(flags, np.asarray(exclude), 3, why))
    described = {
        "flag_values": np.arange(len(MASK_MEANINGS), dtype=np.int8),
        "flag_meanings": " ".join(MASK_MEANINGS),
        "units": "1",
    }
    flat = flat.assign(mask=("direction", flags, described))
    for reason in reasons:
        flat = add_history(flat, reason)
    return flat


def _mark(flags: np.ndarray, where: np.ndarray, flag: int, reason: str) -> str:
    new = where & (flags == 0)
    flags[new] = flag
    return f"masked {int(new.sum())} values {reason}"
