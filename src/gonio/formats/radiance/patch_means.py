"""Means of a BRDF over pairs of Klems patches, which is what a matrix stores: a patch has one value for all directions.

The mean over an incident patch i and an outgoing patch o is weighted by both cosines, so that energy is kept:

    F = integral of f cos(theta_i) cos(theta_r) dw_i dw_r / (L_i L_o),   L the projected solid angle of a patch.

With u = sin^2(theta) the measure cos dw is du dphi/2, so nodes are equal in u and in azimuth. A surface that was not
turned depends on the difference of the azimuths alone, which leaves three integrals: over both rings, with
Gauss-Legendre nodes in u, and over sectors of the difference, weighed by the trapezoid that two box-shaped patches make
of it. Else there are four, with Gauss-Legendre nodes in u and in azimuth in each patch. Nodes are added where values
are steep, and where two steps differ by more than a tolerance. Trees are exact (tree_means.py).

Where some nodes have no value the mean is over those that have, if they stand for LEAST of the pair, else it is a gap.
"""

import functools
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.formats.format import Evaluate, Means
from gonio.formats.radiance import tensor_tree, tree_means
from gonio.formats.radiance.klems import Basis

Array = npt.NDArray[np.float64]
RingPair = tuple[int, int, slice, slice]  # incident and outgoing band, and the patches of each
Rows = npt.NDArray[np.intp]

TOLERANCE = 5e-3  # of the largest mean of a pair of rings: less than any goniometer can tell
COVERED = 0.02  # by which two steps may differ in the part of a pair that has values
LEAST = 0.5  # of a pair of patches that must have values
RING_STEPS = ((3, 90), (6, 180), (12, 360), (24, 720))  # nodes in u of each ring, and sectors
PAIR_STEPS = (4, 8, 16)  # nodes in u and in azimuth of each patch
PAIR_TOLERANCE = 5e-3  # of a mean
AROUND = 4  # times as many azimuths in a patch about the pole, which has the whole circle
STEEP = 10.0  # largest over least value of a pair; with less the first nodes are enough
MOST = 2_000_000  # directions that a step may take, but for the first
CHUNK = 1_000_000  # directions that are evaluated at once
SECTORS = 960  # of a tree: the bounds of all the patches of klems.BASES are bounds of these


def of_function(incident: Basis, outgoing: Basis, evaluate: Evaluate, turned: bool) -> Means:
    """The means of a function of directions, which is NaN where there is no value; `turned` if it depends on phi_i."""
    count = _Counted(evaluate)
    integrate = _turned if turned else _unturned
    values, covered = integrate(incident, outgoing, count)
    reached = covered >= LEAST
    partial = int((reached & (covered < 1 - 1e-9)).sum())
    return Means(np.where(reached, values, np.nan), partial, f"quadrature over {count.directions} directions")


def of_tree(scan: xr.Dataset, level: str, incident: Basis, outgoing: Basis) -> Array:
    """The exact means (incident, outgoing) of the tree of one set; variable `level` has the level of each cell."""
    theta_i, theta_r, phi = (scan[n].values for n in ("theta_i", "theta_r", "phi"))
    rank = 4 if "phi_i" in scan.coords else 3
    phi_i = scan["phi_i"].values if rank == 4 else np.zeros(len(theta_i))
    levels, values = scan[level].values.astype(np.int64), scan["brdf"].values
    cell = tensor_tree.cell_of(levels, rank, theta_i, 180.0 - phi_i, theta_r, -(phi_i + phi))
    if rank == 4:
        return tree_means.pair_means(levels, cell, values, incident, outgoing)
    sectors = Basis("sectors", outgoing.lower, (SECTORS,) * len(outgoing.counts), outgoing.upper)
    rings = tree_means.ring_means(levels, cell, values, incident.bounds, sectors).reshape(
        -1, len(outgoing.counts), SECTORS
    )
    out = np.empty((incident.size, outgoing.size))
    for i, o, rows, columns in _ring_pairs(incident, outgoing):
        out[rows, columns] = _weighed(rings[i, o], incident.counts[i], outgoing.counts[o])
    return out


class _Counted:
    """The function in chunks, and how many directions it was asked for."""

    def __init__(self, evaluate: Evaluate) -> None:
        self.evaluate, self.directions = evaluate, 0

    def __call__(self, theta_i: Array, column: Array, theta_r: Array, row: Array) -> Array:
        """Values (n,); azimuths are those of the file, of incident and of outgoing light."""
        phi_i = (180.0 - column) % 360.0
        arrays = theta_i, theta_r, (-row - phi_i) % 360.0, phi_i
        self.directions += len(theta_i)
        starts = range(0, len(theta_i), CHUNK)
        return np.concatenate([self.evaluate(*(a[at : at + CHUNK] for a in arrays)) for at in starts])


def _ring_pairs(incident: Basis, outgoing: Basis) -> Iterator[RingPair]:
    first_i, first_o = (np.cumsum([0, *basis.counts]) for basis in (incident, outgoing))
    for i in range(len(incident.counts)):
        for o in range(len(outgoing.counts)):
            yield i, o, slice(first_i[i], first_i[i + 1]), slice(first_o[o], first_o[o + 1])


def _nodes(basis: Basis, band: int, count: int) -> tuple[Array, Array]:
    """Polar angles [deg] and weights (sum 1) of Gauss-Legendre nodes in u over a band."""
    x, w = np.polynomial.legendre.leggauss(count)
    low, high = np.sin(np.radians(basis.bounds[band : band + 2])) ** 2
    return np.degrees(np.arcsin(np.sqrt(low + (high - low) * (x + 1) / 2))), w / 2


def _weighed(by_sector: Array, columns: int, rows: int) -> Array:
    """Means (.., columns, rows) of pairs of patches from those over sectors (.., n) of row less column azimuth.

    Sector k is centred at 360 k/n deg. Over two patches of widths a and b the difference has the density of two boxes
    one after the other, a trapezoid; its integral up to x is the second difference of max(x, 0)^2/2 over a b.
    """
    return np.einsum("...k,crk->...cr", by_sector, _sector_shares(by_sector.shape[-1], columns, rows))


@functools.lru_cache(maxsize=256)
def _sector_shares(n: int, columns: int, rows: int) -> Array:
    """The share (columns, rows, n) of each sector in a pair of patches."""
    a, b = 360.0 / columns, 360.0 / rows
    bounds = (np.arange(-n, 2 * n + 1) - 0.5) * 360.0 / n
    offsets = 360.0 * np.arange(rows) / rows - 360.0 * np.arange(columns)[:, None] / columns  # (columns, rows)

    x = bounds - (offsets % 360.0)[..., None]
    below = np.zeros_like(x)
    for sign, corner in ((1, a + b), (-1, a - b), (-1, b - a), (1, -a - b)):
        below += sign * np.maximum(x + corner / 2, 0.0) ** 2 / (2 * a * b)
    share = np.diff(below, axis=-1)
    share = share.reshape(*offsets.shape, 3, n).sum(axis=-2)
    whole: Array = share / share.sum(axis=-1, keepdims=True)
    return whole


def _unturned(incident: Basis, outgoing: Basis, evaluate: _Counted) -> tuple[Array, Array]:
    """Means and covered shares (incident, outgoing) of a function of the difference of the azimuths."""
    pending: list[RingPair] = list(_ring_pairs(incident, outgoing))
    values, covered = (np.full((incident.size, outgoing.size), np.nan) for _ in range(2))
    for step, (polar, sectors) in enumerate(RING_STEPS):
        pending = pending[: MOST // (polar**2 * sectors)] if step else pending
        batches = [_of_rings(incident, outgoing, pair, polar, sectors) for pair in pending]
        found = evaluate(*(np.concatenate(parts) for parts in zip(*(b[0] for b in batches), strict=True)))
        rough: list[tuple[float, RingPair]] = []
        start = 0
        for pair, (arrays, weights) in zip(pending, batches, strict=True):
            part = found[start : start + len(arrays[0])].reshape(sectors, -1)
            start += len(arrays[0])
            has = np.isfinite(part)
            share = _weighed(has @ weights, incident.counts[pair[0]], outgoing.counts[pair[1]])
            total = _weighed(np.where(has, part, 0.0) @ weights, incident.counts[pair[0]], outgoing.counts[pair[1]])
            mean, place = _ratio(total, share), pair[2:]
            moved, largest = (np.nan_to_num(np.abs(v)).max() for v in (mean - values[place], mean))
            seen = np.abs(share - covered[place]).max()  # NaN at first
            if step == 0 or moved > TOLERANCE * largest or seen > COVERED:
                rough.append((float(largest if step == 0 else moved), pair))
            values[place], covered[place] = mean, share
        # those that moved most, or at first the largest, as far as time allows
        pending = [pair for _, pair in sorted(rough, key=lambda one: -one[0])]
        if not pending:
            break
    return values, covered


def _of_rings(
    incident: Basis, outgoing: Basis, pair: RingPair, polar: int, sectors: int
) -> tuple[tuple[Array, Array, Array, Array], Array]:
    """Directions of a pair of rings, by sector and then by polar nodes, and the weights of the polar nodes."""
    theta_i, w_i = _nodes(incident, pair[0], polar)
    theta_r, w_o = _nodes(outgoing, pair[1], polar)
    azimuth = 360.0 * np.arange(sectors) / sectors
    row, t_i, t_r = (v.ravel() for v in np.meshgrid(azimuth, theta_i, theta_r, indexing="ij"))
    return (t_i, np.zeros(len(row)), t_r, row), np.outer(w_i, w_o).ravel()


def _turned(incident: Basis, outgoing: Basis, evaluate: _Counted) -> tuple[Array, Array]:
    """Means and covered shares (incident, outgoing) of a function of both azimuths."""
    i, o = (v.ravel() for v in np.meshgrid(np.arange(incident.size), np.arange(outgoing.size), indexing="ij"))
    values, covered = (np.full((incident.size, outgoing.size), np.nan) for _ in range(2))
    for step, count in enumerate(PAIR_STEPS):
        kept, change = [], []
        for rows in _alike(incident, outgoing, i, o):
            mean, share, steep = _of_pairs(incident, outgoing, (i[rows], o[rows]), count, evaluate)
            with np.errstate(invalid="ignore"):
                moved = np.abs(mean - values[i[rows], o[rows]]) / np.abs(mean)
            values[i[rows], o[rows]], covered[i[rows], o[rows]] = mean, share
            kept.append(rows[steep if step == 0 else moved > PAIR_TOLERANCE])
            change.append((mean if step == 0 else moved)[steep if step == 0 else moved > PAIR_TOLERANCE])
        # those that changed most, or at first the largest, as far as time allows
        rest = np.concatenate(kept)[np.argsort(-np.concatenate(change), kind="stable")]
        rest = rest[: MOST // PAIR_STEPS[step + 1] ** 4] if step + 1 < len(PAIR_STEPS) else rest[:0]
        i, o = i[rest], o[rest]
        if not len(i):
            break
    return values, covered


def _alike(incident: Basis, outgoing: Basis, i: Rows, o: Rows) -> Iterator[Rows]:
    """The pairs in groups with nodes alike: a patch about the pole, or not, on either side."""
    about = [np.repeat(np.array(b.counts) == 1, b.counts)[k] for b, k in ((incident, i), (outgoing, o))]
    kinds = 2 * about[0] + about[1]
    return (np.flatnonzero(kinds == kind) for kind in np.unique(kinds))


def _of_pairs(
    incident: Basis, outgoing: Basis, pairs: tuple[Rows, Rows], count: int, evaluate: _Counted
) -> tuple[Array, Array, npt.NDArray[np.bool_]]:
    """Means and covered shares (pairs,) with so many nodes in u and in azimuth, and which pairs are steep."""
    (theta_i, column, w_i), (theta_r, row, w_o) = (
        _in_patches(basis, indices, count) for basis, indices in zip((incident, outgoing), pairs, strict=True)
    )
    weights = np.outer(w_i, w_o).ravel()
    mean, share, steep = [], [], []
    at_once = max(CHUNK // len(weights), 1)
    for at in range(0, len(pairs[0]), at_once):
        some = slice(at, at + at_once)
        arrays = theta_i[some, :, None], column[some, :, None], theta_r[some, None], row[some, None]
        full = np.broadcast_shapes(*(v.shape for v in arrays))
        found = evaluate(*(np.broadcast_to(v, full).ravel() for v in arrays))
        part = found.reshape(full[0], -1)
        has = np.isfinite(part)
        share.append(has @ weights)
        mean.append(_ratio(np.where(has, part, 0.0) @ weights, share[-1]))
        low, high = np.where(has, part, np.inf).min(axis=-1), np.where(has, part, -np.inf).max(axis=-1)
        steep.append(high > STEEP * low)
    return np.concatenate(mean), np.concatenate(share), np.concatenate(steep)


def _in_patches(basis: Basis, indices: Rows, count: int) -> tuple[Array, Array, Array]:
    """Polar angles and azimuths [deg] (indices, nodes) of nodes in patches, and their weights (nodes,) of sum 1.

    The patches are all about the pole, with AROUND times as many azimuths, or all not.
    """
    bands = np.repeat(np.arange(len(basis.counts)), basis.counts)[indices]
    counts = np.array(basis.counts)[bands]
    around = count * AROUND if counts[0] == 1 else count
    x, w = np.polynomial.legendre.leggauss(around)
    polar = np.array([_nodes(basis, band, count)[0] for band in range(len(basis.counts))])[bands]
    azimuth = basis.centres()[1][indices, None] + 180.0 / counts[:, None] * x
    weights = np.outer(_nodes(basis, 0, count)[1], w / 2).ravel()
    return np.repeat(polar, around, axis=1), np.tile(azimuth, (1, count)), weights


def _ratio(total: Array, share: Array) -> Array:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(share > 0, total / share, np.nan)
