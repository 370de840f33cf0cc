"""A simulated coating that its model does not explain: ggx with a smooth, reciprocal bump."""

import numpy as np
import xarray as xr

from gonio import catalogue
from gonio.measured import dataset
from gonio.measured.dataset import make_scan

ANGLES = [20.0, 40.0, 60.0]
THETA_R = np.arange(-75, 76, 5.0)
VALUES = {"rho_s": 0.2, "rho_d": 0.1, "width": 0.3}
HELD = {"index": 1.5, "extinction": 0.0}
NOISE = 0.01


def directions(theta_i, theta_r, phi):
    columns = [np.ravel(column).astype(float) for column in np.broadcast_arrays(theta_i, theta_r, phi)]
    return xr.Dataset(coords=dict(zip(dataset.ANGLES, [("direction", c) for c in columns], strict=True)))


def surface(places):
    """A coating with a smooth, reciprocal bump that its model lacks: 30 % more where both are near the normal."""
    plain = catalogue["ggx"](dataset.geometry(places), VALUES | HELD)
    cosines = np.cos(np.radians(places["theta_i"].values)) * np.cos(np.radians(places["theta_r"].values))
    return np.asarray(plain) * (1 + 0.3 * np.exp(-((cosines - 0.8) ** 2) / 0.1))


def measured(angles=ANGLES, seed=1):
    places = directions(*np.meshgrid(angles, np.abs(THETA_R)), np.where(THETA_R >= 0, 180.0, 0.0)[:, None])
    noise = 1 + NOISE * np.random.default_rng(seed).standard_normal(places.sizes["direction"])
    return make_scan(
        *(places[name].values for name in ("theta_i", "theta_r")), surface(places) * noise, places["phi"].values
    )


def some(count, seed=3, most=80.0):
    rng = np.random.default_rng(seed)
    return directions(rng.uniform(0, most, count), rng.uniform(0, most, count), rng.uniform(0, 360, count))


def exchanged(places):
    return directions(places["theta_r"].values, places["theta_i"].values, -places["phi"].values % 360)
