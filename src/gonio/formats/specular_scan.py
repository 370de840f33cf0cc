"""Scans of specular reflectance: the weight of a Dirac lobe in the mirror direction, which is not a BRDF.

The specular tables of Integra (.sdr, .sdt) and of SSDD files become such scans.
"""

import numpy as np
import xarray as xr

from gonio.measured.dataset import RELATIVE, add_history, make_scan

REFLECTANCE, TRANSMITTANCE = "specular reflectance", "specular transmittance"


def specular_scan(
    theta_i: np.ndarray,
    values: np.ndarray,
    set_values: dict[str, np.ndarray],
    is_transmitted: bool,
    provenance: str = "",
) -> xr.Dataset:
    """The scan of reflectances (set, theta_i) in the mirror direction, in a.u. and with the attribute `quantity`.

    `set_values` has, by coordinate (wavelength, channel), one value for each set.
    """
    count, per_set = values.shape
    coordinates = {name: np.repeat(v, per_set) for name, v in set_values.items()}
    if is_transmitted:
        coordinates["mode"] = np.full(values.size, "transmission")
    scan = make_scan(
        np.tile(theta_i, count),
        np.tile(theta_i, count),
        values.ravel(),
        np.full(values.size, 180.0),
        unit=RELATIVE,
        coordinates=coordinates,
        provenance=provenance,
    )
    stored = TRANSMITTANCE if is_transmitted else REFLECTANCE
    scan.attrs["quantity"] = stored
    return add_history(scan, f"the values are the {stored} of a Dirac lobe, no BRDF in 1/sr: kept in a.u.")
