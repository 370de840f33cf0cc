"""What a good model misses of public materials: how residuals of a fit go together.

The table has for each of 48 materials the residual of `gonio-best`, lg of the material over the fit, at the nodes of a
grid of half vector and difference vector. Its rows are made by `make prior` from networks (Neural-BRDF, MIT) that stand
for the materials of the RGL database (CC0; dupuy2018). The covariance of two directions is the mean over materials of
the product of the residuals there: positive semi-definite by construction, and reciprocal because the grid is.
"""

import csv
import functools
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.completion.coordinates import half_angles

Values = npt.NDArray[np.float64]

TABLE = Path(__file__).with_name("rgl_residuals.csv")
HALVES = (0.0, 0.7, 1.5, 2.5, 4.0, 6.0, 9.0, 12.0, 16.0, 21.0, 27.0, 34.0, 42.0, 52.0, 64.0, 78.0)  # deg, theta_h
DIFFERENCES = (0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 68.0, 75.0, 80.0, 84.0, 87.0)  # deg, theta_d
AZIMUTHS = (0.0, 30.0, 60.0, 90.0)  # deg, of the difference vector
THOUSANDTHS = 1e-3


@functools.cache
def _table() -> tuple[tuple[str, ...], Values]:
    """Names of the materials, and their residuals over the grid (half, difference, azimuth, material) in lg.

    Nodes below the horizon, or where a material has no value, have that of the nearest node.
    """
    with TABLE.open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    numbers = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows]) * THOUSANDTHS
    shape = (len(HALVES), len(DIFFERENCES), len(AZIMUTHS))
    return tuple(head), np.stack([_filled(column.reshape(shape)) for column in numbers.T], axis=-1)


def _filled(grid: Values) -> Values:
    from scipy.ndimage import distance_transform_edt

    nearest = distance_transform_edt(np.isnan(grid), return_distances=False, return_indices=True)
    return np.asarray(grid[tuple(nearest)])


def materials() -> tuple[str, ...]:
    """The names of the materials."""
    return _table()[0]


def refuse_unknown(without: Sequence[str]) -> None:
    """ValueError with all names where one of a material is not known."""
    if unknown := sorted(set(without) - set(materials() if without else ())):
        raise ValueError(f"{unknown[0]}: the prior has no such material; it has {', '.join(materials())}")


def residuals(points: xr.Dataset, without: Sequence[str] = ()) -> Values:
    """Residuals of the materials at the directions of a flat scan (points, materials) over the root of their number.

    So the product of two rows is the covariance of two directions. `without` names materials that are left out, as a
    scan of one of them must be judged without it.
    Raises ValueError where there is no such material.
    """
    from scipy.interpolate import RegularGridInterpolator

    refuse_unknown(without)
    names, grid = _table()
    kept = [k for k, name in enumerate(names) if name not in without]
    axes = (np.array(HALVES), np.array(DIFFERENCES), np.array(AZIMUTHS))
    angles = half_angles(points)
    for k, axis in enumerate(axes):
        angles[:, k] = np.clip(angles[:, k], axis[0], axis[-1])
    found: Values = RegularGridInterpolator(axes, grid[..., kept])(angles) / np.sqrt(len(kept))
    return found
