"""Source and detector exchanged: which direction, and which set of values, Helmholtz reciprocity compares with which.

The exchange of (theta_i, phi_i; theta_r, phi) is (theta_r, phi_i + phi; theta_i, -phi): the detector's azimuth becomes
the source's. Light that went through the surface comes, exchanged, to the other side: transmission from the front is
compared with transmission from the back, and a scan of one side alone says nothing about it.
"""

from collections.abc import Hashable, Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.measured.dataset import SETS

Values = npt.NDArray[np.float64]
Rows = npt.NDArray[np.intp]

SAME = 6  # decimals of a degree to which exchanged directions agree
_OTHER_SIDE = {"front": "back", "back": "front"}


def exchanged(theta_i: Values, theta_r: Values, phi: Values, phi_i: Values) -> tuple[Values, Values, Values, Values]:
    """theta_i, theta_r, phi and phi_i [deg] of the directions with source and detector exchanged."""
    return theta_r, theta_i, -phi % 360.0, (phi_i + phi) % 360.0


def partner(labels: Mapping[str, Any]) -> dict[str, Any] | None:
    """The labels of the set in which light goes the other way; None where no labels can name it.

    labels: the coordinates of SETS of one set, single ones too. Reflection is its own partner.
    """
    if labels.get("mode") != "transmission":
        return dict(labels)
    other = _OTHER_SIDE.get(str(labels.get("side")))
    return None if other is None else {**labels, "side": other}


def partners(labels: Sequence[Mapping[str, Any]]) -> list[int | None]:
    """For each of several sets the place of its partner among them, or None."""
    places = {_key(one): k for k, one in enumerate(labels)}
    return [None if (other := partner(one)) is None else places.get(_key(other)) for one in labels]


def _key(labels: Mapping[str, Any]) -> Hashable:
    return tuple(sorted((name, str(value)) for name, value in labels.items()))


def pairs(flat: xr.Dataset) -> tuple[Rows, Rows]:
    """The rows (m,) of a flat scan whose exchanged direction is measured too, and the rows (m,) of these.

    Each pair occurs once. Where the surface was not turned, and so is isotropic, phi counts up to its sign.
    """
    group, other = _groups(flat)
    theta_i, theta_r, phi = (flat[name].values.astype(float) for name in dataset.ANGLES)
    is_turned = "phi_i" in flat.coords
    phi_i = flat["phi_i"].values.astype(float) if is_turned else np.zeros_like(phi)
    if not is_turned:
        at_normal = (np.round(theta_i, SAME) == 0) | (np.round(theta_r, SAME) == 0)
        phi = np.where(at_normal, 0.0, np.abs((phi + 180.0) % 360.0 - 180.0))
    here = _keys(group, theta_i, theta_r, phi, phi_i)
    angles = exchanged(theta_i, theta_r, phi, phi_i)
    if not is_turned:
        angles = (*angles[:2], phi, phi_i)
    there = _keys(other, *angles)
    codes = np.unique(np.concatenate([here, there]), axis=0, return_inverse=True)[1].ravel()
    own, wanted = codes[: len(here)], codes[len(here) :]
    row_of = np.full(codes.max(initial=-1) + 1, -1)
    row_of[own] = np.arange(len(own))
    found = np.where(other >= 0, row_of[wanted], -1)
    # The last of several repeats stands for its direction. A direction that is its own exchange proves nothing.
    rows = np.flatnonzero((found >= 0) & (own < wanted) & (row_of[own] == np.arange(len(own))))
    return rows, found[rows]


def _groups(flat: xr.Dataset) -> tuple[Rows, Rows]:
    """The number of each row's set, and that of its partner or -1."""
    names = [name for name in SETS if name in flat.coords]
    if not names:
        none = np.zeros(flat.sizes["direction"], dtype=np.intp)
        return none, none
    columns = np.column_stack([np.unique(flat[n].values, return_inverse=True)[1].ravel() for n in names])
    _, first, group = np.unique(columns, axis=0, return_index=True, return_inverse=True)
    labels = [{name: flat[name].values[row] for name in names} for row in first]
    other = np.array([-1 if place is None else place for place in partners(labels)])
    group = group.ravel()
    return group, other[group]


def _keys(group: Rows, theta_i: Values, theta_r: Values, phi: Values, phi_i: Values) -> Values:
    """One comparable row a direction: polar angles and absolute azimuths, which the normal does not have."""
    phi_r = phi_i + phi
    flat_i, flat_r = (np.round(theta, SAME) == 0 for theta in (theta_i, theta_r))
    turned_i = np.where(flat_i, 0.0, phi_i)
    turned_r = np.where(flat_r, 0.0, phi_r)
    azimuths = [np.round(turned % 360.0, SAME) % 360.0 for turned in (turned_i, turned_r)]
    return np.column_stack([group, np.round(theta_i, SAME), np.round(theta_r, SAME), *azimuths])
