"""The adaptive parameterisation of RGL's measurements (dupuy2018): directions warped by the density of visible normals.

The half vector's polar angle and azimuth become u = sqrt(2 theta/pi) and (phi + pi)/(2 pi), both 0 to 1. A warp by the
density `vndf` maps these to the unit square on which the values were measured; slices of `vndf` are normalised before
they are interpolated. The stored value is f cos(theta_r) / (ndf/(4 sigma)). Arrays (.., y, x) have the azimuth along y
and the polar angle along x. Angles are in radians here. The public readers are powitacq.inl, Mitsuba's measured.cpp and
pbrt's bxdfs.cpp.
"""

import functools
import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Whole = npt.NDArray[np.intp]
Stored = npt.NDArray[np.floating]


@dataclass(frozen=True)
class Slices:
    """For n directions, the k slices of a tensor (phi_i, theta_i, ..) to mix: flat indices and weights, each (k, n)."""

    index: Whole
    weight: Array

    def take(self, table: Array, *at: Whole) -> Array:
        """The weighted mean over the slices of a table (slices, ..) at the indices `at`, each (n,)."""
        mixed: Array = np.einsum("kn,kn->n", self.weight, table[(self.index, *at)])
        return mixed


def slices(phi_nodes: Array, theta_nodes: Array, phi: Array, theta: Array) -> Slices:
    """The slices for linear interpolation between nodes; beyond the first and the last node that slice is used."""
    p0, p1, pw = _between(phi_nodes, phi)
    t0, t1, tw = _between(theta_nodes, theta)
    count = len(theta_nodes)
    near = [(t0, 1 - tw)] if count == 1 else [(t0, 1 - tw), (t1, tw)]
    turns = [(p0, 1 - pw)] if len(phi_nodes) == 1 else [(p0, 1 - pw), (p1, pw)]
    pairs = [(p * count + t, a * b) for p, a in turns for t, b in near]
    return Slices(np.array([i for i, _ in pairs]), np.array([w for _, w in pairs]))


def _between(nodes: Array, at: Array) -> tuple[Whole, Whole, Array]:
    """The nodes on both sides, and the weight of the upper one."""
    if len(nodes) == 1:
        zero = np.zeros(at.shape, dtype=np.intp)
        return zero, zero, np.zeros(at.shape)
    low = np.clip(np.searchsorted(nodes, at, side="left") - 1, 0, len(nodes) - 2)
    share = (at - nodes[low]) / (nodes[low + 1] - nodes[low])
    return low, low + 1, np.clip(share, 0.0, 1.0)


def cell(u: Array, size: int) -> tuple[Whole, Array]:
    """The lower node of the cell that holds u (0 to 1) among `size` even nodes, and the position in it, 0 to 1."""
    scaled = np.clip(u, 0.0, 1.0) * (size - 1)
    low = np.minimum(scaled.astype(np.intp), size - 2)
    return low, scaled - low


def bilinear(table: Array, x: Array, y: Array) -> Array:
    """Bilinear interpolation of a table (y, x) over the unit square."""
    (j, b), (i, a) = cell(y, table.shape[0]), cell(x, table.shape[1])
    value: Array = (1 - b) * ((1 - a) * table[j, i] + a * table[j, i + 1]) + b * (
        (1 - a) * table[j + 1, i] + a * table[j + 1, i + 1]
    )
    return value


class Warp:
    """The warp of the unit square by a density (slices, y, x); each slice is normalised before slices are mixed."""

    def __init__(self, density: Stored) -> None:
        heights = density.astype(np.float64)
        rows = _cumulated(heights)
        marginal = _cumulated(rows[..., -1])
        total = marginal[:, -1]
        self.density: Array = heights / total[:, None, None]
        self.rows = rows / total[:, None, None]
        self.marginal = marginal / total[:, None]

    def invert(self, at: Slices, x: Array, y: Array) -> tuple[Array, Array]:
        """The sample (x, y) in the unit square that the warp maps to the point (x, y)."""
        (j, b), (i, a) = cell(y, self.density.shape[1]), cell(x, self.density.shape[2])
        take, last = at.take, np.full(j.shape, self.density.shape[2] - 1)
        c0 = (1 - b) * take(self.density, j, i) + b * take(self.density, j + 1, i)
        c1 = (1 - b) * take(self.density, j, i + 1) + b * take(self.density, j + 1, i + 1)
        r0, r1 = take(self.rows, j, last), take(self.rows, j + 1, last)
        below = (1 - b) * take(self.rows, j, i) + b * take(self.rows, j + 1, i)
        row = (1 - b) * r0 + b * r1
        inside = below + a * (c0 + 0.5 * a * (c1 - c0))
        along_x = np.divide(inside, row, out=np.zeros_like(row), where=row > 0)
        return along_x, take(self.marginal, j) + b * (r0 + 0.5 * b * (r1 - r0))

    def nodes(self, size: tuple[int, int]) -> tuple[Array, Array]:
        """The points x and y (slices, y, x) to which each slice maps an even grid of samples of `size` (y, x)."""
        wanted_y, wanted_x = (np.linspace(0.0, 1.0, n) for n in size)
        slice_of = np.arange(len(self.density))[:, None]
        j = _intervals(self.marginal, np.broadcast_to(wanted_y, (len(self.density), size[0])))
        rest = wanted_y - np.take_along_axis(self.marginal, j, axis=1)
        b = _solve(self.rows[slice_of, j, -1], self.rows[slice_of, j + 1, -1], rest)
        low, high = (1 - b)[..., None], b[..., None]
        line = (low * self.rows[slice_of, j] + high * self.rows[slice_of, j + 1]).reshape(-1, self.rows.shape[-1])
        height = (low * self.density[slice_of, j] + high * self.density[slice_of, j + 1]).reshape(line.shape)
        wanted = wanted_x * line[:, -1:]
        i = _intervals(line, wanted)
        first, second, before = (np.take_along_axis(v, k, axis=1) for v, k in ((height, i), (height, i + 1), (line, i)))
        x = (i + _solve(first, second, wanted - before)) / (line.shape[1] - 1)
        y = (j + b) / (self.rows.shape[1] - 1)
        full = (len(self.density), *size)
        return np.clip(x, 0.0, 1.0).reshape(full), np.clip(np.broadcast_to(y[..., None], full), 0.0, 1.0)


def _cumulated(values: Array) -> Array:
    """The cumulative integral along the last axis by trapezoids of unit width, beginning with 0."""
    sums = np.cumsum(0.5 * (values[..., 1:] + values[..., :-1]), axis=-1)
    return np.concatenate([np.zeros((*values.shape[:-1], 1)), sums], axis=-1)


def _intervals(cumulated: Array, wanted: Array) -> Whole:
    """The interval (rows, n) among each row's ascending values (rows, m) that holds the wanted values (rows, n)."""
    total = np.where(cumulated[:, -1:] > 0, cumulated[:, -1:], 1.0)
    offset = 2.0 * np.arange(len(cumulated))[:, None]  # makes all rows one ascending list, for one searchsorted
    place = np.searchsorted((cumulated / total + offset).ravel(), (wanted / total + offset).ravel(), side="left")
    within = place.reshape(wanted.shape) - cumulated.shape[1] * np.arange(len(cumulated))[:, None]
    interval: Whole = np.clip(within - 1, 0, cumulated.shape[1] - 2)
    return interval


def _solve(first: Array, second: Array, area: Array) -> Array:
    """The position b in 0 to 1 up to which a linear density from `first` to `second` has the integral `area`."""
    area = np.maximum(area, 0.0)
    divisor = first + np.sqrt(np.maximum(first**2 + 2 * area * (second - first), 0.0))
    return np.clip(np.divide(2 * area, divisor, out=np.zeros_like(area), where=divisor > 0), 0.0, 1.0)


@dataclass(frozen=True)
class RglMeasurement:
    """The tensors of one measurement.

    theta_i, phi_i: the directions of incidence of the slices. ndf, the distribution of normals, and sigma, the
    projected area of the microfacets: (y, x). vndf, the distribution of visible normals: (phi_i, theta_i, y, x).
    values: (sets, phi_i, theta_i, y, x). with_jacobian: whether to multiply the values by ndf/(4 sigma).
    """

    theta_i: Array
    phi_i: Array
    ndf: Array
    sigma: Array
    vndf: Stored
    values: Stored
    with_jacobian: bool = True

    @property
    def isotropic(self) -> bool:
        """Whether the surface is isotropic: such files have at most two azimuths of incidence."""
        return len(self.phi_i) <= 2

    @functools.cached_property
    def warp(self) -> Warp:
        """The warp by vndf."""
        return Warp(self.vndf.reshape(-1, *self.vndf.shape[2:]))

    @functools.cached_property
    def nodes(self) -> tuple[Array, Array, Array, Array]:
        """theta_r, phi = phi_r - phi_i, cos(theta_r) and ndf/(4 sigma) of every node, each (phi_i, theta_i, y, x)."""
        full = (len(self.phi_i), len(self.theta_i), *self.values.shape[-2:])
        x, y = (v.reshape(full) for v in self.warp.nodes((full[2], full[3])))
        phi_i, theta_i = self.phi_i[:, None, None, None], self.theta_i[:, None, None]
        azimuth = (2 * y - 1) * math.pi - (0.0 if self.isotropic else phi_i)
        theta_r, phi, cosine = reflected(theta_i, x**2 * math.pi / 2, azimuth)
        return theta_r, phi, cosine, self._scale(x, y, np.broadcast_to(theta_i, full), np.broadcast_to(phi_i, full))

    def solid_angles(self) -> Array:
        """The solid angle of w_r per unit of area of the warped square (phi_i, theta_i, y, x); 0 below the horizon."""
        theta_r, phi, cosine, _ = self.nodes
        theta_i = np.broadcast_to(self.theta_i[:, None, None], theta_r.shape)
        theta_h, azimuth = _half(theta_i, theta_r, phi)
        facing = np.cos(theta_i) * np.cos(theta_h) + np.sin(theta_i) * np.sin(theta_h) * np.cos(azimuth)
        area = 2 * math.pi**2 * np.sqrt(2 * theta_h / math.pi) * np.sin(theta_h)
        return np.where(cosine > 0, 4 * facing * area, 0.0)

    def _scale(self, x: Array, y: Array, theta_i: Array, phi_i: Array) -> Array:
        if not self.with_jacobian:
            return np.ones(x.shape)
        sigma = bilinear(self.sigma, np.sqrt(2 * theta_i / math.pi), (phi_i + math.pi) / (2 * math.pi))
        ndf = bilinear(self.ndf, x, y)
        return np.divide(ndf, 4 * sigma, out=np.zeros_like(ndf), where=sigma > 0)

    def evaluate(self, theta_i: Array, theta_r: Array, phi: Array, phi_i: Array) -> Array:
        """The BRDF (sets, n) at directions (n,); NaN at and below the horizon."""
        phi_i, phi = self._reduced(phi_i, phi)
        theta_h, azimuth = _half(theta_i, theta_r, phi)
        x = np.sqrt(2 * theta_h / math.pi)
        y = ((azimuth + (0.0 if self.isotropic else phi_i)) / (2 * math.pi) + 0.5) % 1.0
        at = slices(self.phi_i, self.theta_i, phi_i, theta_i)
        sx, sy = self.warp.invert(at, x, y)
        (j, b), (i, a) = cell(sy, self.values.shape[-2]), cell(sx, self.values.shape[-1])
        with np.errstate(divide="ignore", invalid="ignore"):
            factor = np.where((theta_r < math.pi / 2) & (theta_i <= math.pi / 2), 1 / np.cos(theta_r), np.nan)
        factor *= self._scale(x, y, theta_i, phi_i)
        out = np.empty((len(self.values), len(theta_i)))
        for row, values in zip(out, self.values, strict=True):
            table = values.reshape(-1, *values.shape[2:])
            low = (1 - a) * at.take(table, j, i) + a * at.take(table, j, i + 1)
            high = (1 - a) * at.take(table, j + 1, i) + a * at.take(table, j + 1, i + 1)
            row[:] = ((1 - b) * low + b * high) * factor
        return out

    def _reduced(self, phi_i: Array, phi: Array) -> tuple[Array, Array]:
        """Azimuths within the file's, by the symmetry of a file that covers a half or a quarter of the circle."""
        phi_i = (phi_i + math.pi) % (2 * math.pi) - math.pi
        span = self.phi_i[-1] - self.phi_i[0]
        if self.isotropic or round(2 * math.pi / span) < 2:
            return phi_i, phi
        upper = phi_i > 0
        if round(2 * math.pi / span) == 4:  # a quarter: mirror symmetry about both axes of the surface
            phi_i, phi = np.where(upper, -phi_i, phi_i), np.where(upper, -phi, phi)
            right = phi_i > -math.pi / 2
            return np.where(right, -math.pi - phi_i, phi_i), np.where(right, -phi, phi)
        return np.where(upper, phi_i - math.pi, phi_i), phi  # a half: symmetry under half a turn


def reflected(theta_i: Array | float, theta_h: Array, azimuth: Array) -> tuple[Array, Array, Array]:
    """theta_r, phi = phi_r - phi_i and cos(theta_r) of light that a facet at `azimuth` from phi_i mirrors."""
    sin_i, cos_i = np.sin(theta_i), np.cos(theta_i)
    hx, hy, hz = np.sin(theta_h) * np.cos(azimuth), np.sin(theta_h) * np.sin(azimuth), np.cos(theta_h)
    twice = 2 * (sin_i * hx + cos_i * hz)
    rx, ry, rz = twice * hx - sin_i, twice * hy, twice * hz - cos_i
    return np.arctan2(np.hypot(rx, ry), rz), np.arctan2(ry, rx) % (2 * math.pi), rz


def _half(theta_i: Array, theta_r: Array, phi: Array) -> tuple[Array, Array]:
    """The half vector's polar angle, and its azimuth relative to phi_i."""
    hx = np.sin(theta_i) + np.sin(theta_r) * np.cos(phi)
    hy = np.sin(theta_r) * np.sin(phi)
    hz = np.cos(theta_i) + np.cos(theta_r)
    return np.minimum(np.arctan2(np.hypot(hx, hy), hz), math.pi / 2), np.arctan2(hy, hx)
