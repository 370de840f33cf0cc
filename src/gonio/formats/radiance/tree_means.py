"""Means of a tensor tree over Klems patches, exact: shares of areas, since a tree is constant in each of its cells.

In the square of shirley1997 areas stand for projected solid angle, so the mean of a tree over a pair of patches,
weighted by both cosines, is the sum over cells of value times share of the incident patch times share of the outgoing
one. In each quarter of the square a circle about the normal is a straight line X = const and an azimuth a line Y = m X
through the middle. A patch there is {r0 <= X <= r1, m0 X <= Y <= m1 X}, and its overlap with a cell has a closed form.

A tree of rank 3 depends on the difference of the azimuths. Its means are over rings and narrow sectors of that
difference first; `ring_means` returns these, and patch_means.py weighs them for each pair of patches.
"""

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from gonio.formats.radiance.klems import Basis
from gonio.formats.radiance.tensor_tree import Whole

if TYPE_CHECKING:
    from scipy.sparse import csr_array

Array = npt.NDArray[np.float64]
# Quarters of the square: which coordinate is the larger one, its sign, the azimuth [rad] of its middle, and whether
# azimuth grows with the ratio of the coordinates there (tensor_tree.to_disk).
_QUARTERS = ((0, 1.0, 0.0, 1.0), (0, -1.0, math.pi, 1.0), (1, 1.0, math.pi / 2, -1.0), (1, -1.0, 1.5 * math.pi, -1.0))


def pair_means(level: Whole, cell: Whole, values: Array, incident: Basis, outgoing: Basis) -> Array:
    """The means (incident.size, outgoing.size) of a tree of rank 4, as `tensor_tree.leaves` gives it."""
    from scipy.sparse import coo_array

    total = np.zeros((incident.size, outgoing.size))
    for n in np.unique(level):
        here = level == n
        of_incident, place_i = np.unique(cell[here, :2], axis=0, return_inverse=True)
        of_outgoing, place_o = np.unique(cell[here, 2:], axis=0, return_inverse=True)
        shape = (len(of_incident), len(of_outgoing))
        leaves = coo_array((values[here], (place_i.ravel(), place_o.ravel())), shape=shape).tocsr()
        total += (shares(incident, n, of_incident) @ leaves @ shares(outgoing, n, of_outgoing).T).toarray()
    return total


def ring_means(level: Whole, cell: Whole, values: Array, incident: Array, sectors: Basis) -> Array:
    """The means (rings, sectors.size) of a tree of rank 3 over incident rings and outgoing sectors.

    incident: the bounds [deg] of the rings. sectors: a basis whose azimuths are outgoing less incident ones.
    """
    from scipy.sparse import coo_array

    squared = np.sin(np.radians(incident)) ** 2
    total = np.zeros((len(incident) - 1, sectors.size))
    for n in np.unique(level):
        here = level == n
        # the first coordinate is 1/2 - r/2; of a tree of a single cell half is not used
        radius = np.clip(1 - 2 * np.stack([cell[here, 0] + 1, cell[here, 0]]) / 2.0**n, 0.0, 1.0) ** 2
        upper = np.minimum(radius[1], squared[1:, None])
        ring = np.maximum(upper - np.maximum(radius[0], squared[:-1, None]), 0.0) / np.diff(squared)[:, None]
        of_outgoing, place = np.unique(cell[here, 1:], axis=0, return_inverse=True)
        rows = np.arange(int(here.sum()))
        leaves = coo_array((values[here], (rows, place.ravel())), shape=(len(rows), len(of_outgoing))).tocsr()
        total += np.asarray((coo_array(ring).tocsr() @ leaves @ shares(sectors, n, of_outgoing).T).toarray())
    return total


def shares(basis: Basis, level: int, cells: Whole) -> "csr_array":
    """Which share of each patch lies in each of the cells (m, 2) of a level: sparse, (basis.size, m)."""
    from scipy.sparse import coo_array

    low, high = 2 * cells / 2.0**level - 1, 2 * (cells + 1) / 2.0**level - 1
    radii, first = np.sin(np.radians(basis.bounds)), np.cumsum([0, *basis.counts])
    rows, columns, areas = [], [], []
    for major, sign, middle, sense in _QUARTERS:
        # turned so that the larger coordinate is positive; the ratio of both keeps its sign
        ends = sign * low[:, major], sign * high[:, major]
        x = np.maximum(np.minimum(*ends), 0.0), np.maximum(*ends)
        ends = sign * low[:, 1 - major], sign * high[:, 1 - major]
        y = np.minimum(*ends), np.maximum(*ends)
        for band, count in enumerate(basis.counts):
            from_x, to_x = np.maximum(x[0], radii[band]), np.minimum(x[1], radii[band + 1])
            met = np.flatnonzero((to_x > from_x) & (y[0] < to_x) & (y[1] > -to_x))
            box = from_x[met], to_x[met], y[0][met], y[1][met]
            which, patch, m0, m1 = _candidates(box, count, middle, sense)
            area = _below(m1, *(v[which] for v in box)) - _below(m0, *(v[which] for v in box))
            rows.append(first[band] + patch % count)
            columns.append(met[which])
            areas.append(area / (4 * (radii[band + 1] ** 2 - radii[band] ** 2) / count))
    entries = np.concatenate(areas), (np.concatenate(rows), np.concatenate(columns))
    return coo_array(entries, shape=(basis.size, len(cells))).tocsr()


def _candidates(
    box: tuple[Array, Array, Array, Array], count: int, middle: float, sense: float
) -> tuple[Whole, Whole, Array, Array]:
    """Pairs of a box and a patch that may overlap in a quarter, and the bounds m0, m1 of the patch there.

    box: bounds of X, then of Y. A patch number k stands for azimuths (k - 1/2 .. k + 1/2) 2 pi/count, k of any sign.
    """
    x0, x1, y0, y1 = box
    with np.errstate(divide="ignore", invalid="ignore"):
        least = np.where(y0 < 0, y0 / x0, y0 / x1)
        most = np.where(y1 > 0, y1 / x0, y1 / x1)
    least, most = np.clip(np.nan_to_num(least, nan=-1.0), -1, 1), np.clip(np.nan_to_num(most, nan=1.0), -1, 1)
    ends = middle + sense * math.pi / 4 * least, middle + sense * math.pi / 4 * most
    width = 2 * math.pi / count
    start = np.floor(np.minimum(*ends) / width + 0.5).astype(np.int64)
    number = np.floor(np.maximum(*ends) / width + 0.5).astype(np.int64) - start + 1
    which = np.repeat(np.arange(len(start)), number)
    patch = np.arange(len(which)) - np.repeat(np.cumsum(number) - number, number) + start[which]
    bounds = [sense * ((patch + half) * width - middle) / (math.pi / 4) for half in (-0.5, 0.5)]
    return which, patch, np.clip(np.minimum(*bounds), -1, 1), np.clip(np.maximum(*bounds), -1, 1)


def _below(m: Array, x0: Array, x1: Array, y0: Array, y1: Array) -> Array:
    """The area of a box under the line Y = m X: the integral of m x, held between y0 and y1, less y0."""
    return _ramp(m, y0, x0, x1) - _ramp(m, y1, x0, x1)


def _ramp(m: Array, c: Array, x0: Array, x1: Array) -> Array:
    """The integral of max(m x - c, 0) from x0 to x1; its closed form for one kink, without the loss of digits."""
    first, last = np.maximum(m * x0 - c, 0.0), np.maximum(m * x1 - c, 0.0)
    linear = (x1 - x0) * (first + last) / 2  # no kink between the ends
    with np.errstate(divide="ignore", invalid="ignore"):
        kinked = (last**2 - first**2) / (2 * m)
    return np.where((first > 0) == (last > 0), linear, kinked)
