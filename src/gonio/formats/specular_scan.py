"""Reflectances of the mirror direction alone, which are the weight of a Dirac lobe and no BRDF."""

import numpy as np
import xarray as xr

from gonio.measured.dataset import RELATIVE, add_history, make_scan

REFLECTANCE, TRANSMITTANCE = "specular reflectance", "specular transmittance"


def specular_scan(
    theta_i: np.ndarray, values: np.ndarray, told: dict[str, np.ndarray], is_transmitted: bool, provenance: str = ""
) -> xr.Dataset:
    """The scan of reflectances (set, theta_i) in the mirror direction; `told` has one value of a coordinate a set."""
    count, each = values.shape
    coordinates = {name: np.repeat(v, each) for name, v in told.items()}
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
