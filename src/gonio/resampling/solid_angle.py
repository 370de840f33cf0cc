"""How much of the hemisphere each direction of a scan stands for: the weights of every mean over directions."""

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.dataset import SETS, flatten, is_in_plane, signed_theta_r

Values = npt.NDArray[np.float64]

MOST_INCIDENCES = 1_000  # more are no slices of one incidence each, and every direction counts alike


def solid_angles(scan: xr.Dataset) -> Values:
    """Solid angle [sr] of every direction of a flat scan, by set and incidence angle.

    In plane each stands for its part of a ring about the normal, which is what the same surface shows out of plane if
    it is told by theta_r alone; elsewhere for its cell of the hemisphere (Voronoi). Of scans with more than
    MOST_INCIDENCES incidence angles every direction counts alike, as a share of the hemisphere.
    """
    flat = flatten(scan)
    count = flat.sizes["direction"]
    alike = np.full(count, 2 * np.pi / max(count, 1))
    if len(np.unique(flat["theta_i"].values)) > MOST_INCIDENCES:
        return alike
    names = [n for n in ("theta_i", "phi_i", *SETS) if n in flat.coords]
    codes = [np.unique(np.asarray(flat[n].values), return_inverse=True)[1].ravel() for n in names]
    _, group = np.unique(np.column_stack(codes), axis=0, return_inverse=True)
    group = group.ravel()
    out = alike
    theta_r, phi, in_plane = np.radians(flat["theta_r"].values), np.radians(flat["phi"].values), is_in_plane(flat)
    signed = np.radians(np.where(in_plane, signed_theta_r(flat), 0.0))
    order = np.argsort(group, kind="stable")
    known: dict[bytes, Values] = {}  # on a grid every incidence has the same reflected directions
    for rows in np.split(order, np.cumsum(np.bincount(group))[:-1]):
        if in_plane[rows].all():
            out[rows] = _rings(signed[rows])
            continue
        key = theta_r[rows].tobytes() + phi[rows].tobytes()
        if key not in known:
            known[key] = _cells(theta_r[rows], phi[rows])
        out[rows] = known[key]
    return out


def _rings(signed: Values) -> Values:
    """Half rings about the normal: each side of the plane stands for its half of the hemisphere."""
    nodes, inverse, counts = np.unique(signed, return_inverse=True, return_counts=True)
    middle = (nodes[1:] + nodes[:-1]) / 2
    edges = np.concatenate([nodes[:1], middle, nodes[-1:]])
    edges[0], edges[-1] = (2 * nodes[0] - middle[0], 2 * nodes[-1] - middle[-1]) if len(middle) else (-0.01, 0.01)
    low, high = edges[:-1], edges[1:]
    across = (low < 0) & (high > 0)
    area = np.where(across, 2 - np.cos(low) - np.cos(high), np.abs(np.cos(low) - np.cos(high))) * np.pi
    return area[inverse] / counts[inverse]


def _cells(theta_r: Values, phi: Values) -> Values:
    """Voronoi cells bounded by the mirror image below the horizon; equal shares where there are none."""
    from scipy.spatial import SphericalVoronoi

    ray = np.column_stack([np.sin(theta_r) * np.cos(phi), np.sin(theta_r) * np.sin(phi), np.cos(theta_r)])
    distinct, inverse, counts = np.unique(ray.round(9), axis=0, return_inverse=True, return_counts=True)
    inverse = inverse.ravel()
    distinct /= np.linalg.norm(distinct, axis=1, keepdims=True)
    inner = distinct[:, 2] > 1e-6
    below = distinct[inner] * (1, 1, -1)
    try:
        areas = SphericalVoronoi(np.concatenate([distinct, below])).calculate_areas()[: len(distinct)]
    except ValueError:  # fewer than four, or all on one circle
        areas = np.full(len(distinct), 2 * np.pi / len(distinct))
    areas = np.where(inner, areas, areas / 2)
    return areas[inverse] / counts[inverse]
