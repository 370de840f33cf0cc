"""Scatter of a surface by wave optics from the characteristic function of its heights, whatever their statistics.

    f = R X (1/wavelength^2) Int [chi(k_z, r) - chi_0] exp(2 pi i shift r/wavelength) d^2 r
    chi(k_z, r) = mean over x of exp(i k_z (z(x + r) - z(x)))

over the plane of lags r. For Gaussian differences of height chi is exp(-k_z^2 D(r)/2), which `light.diffraction` takes.
Steps, pits, grooves and scratches are not Gaussian: a map of two heights that are half a wavelength apart at normal
incidence scatters nothing, which its structure function cannot say. chi_0 is the share of the mirror direction.

chi is summed over the map's own points, pairs of measured ones alone, and not interpolated. So the pitch has to resolve
the phase: of neighbours that lose it light would be folded back to where none is, and such a map is refused.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy.fft import fft2, ifft2, next_fast_len
from scipy.special import j0

from gonio.geometry import Geometry
from gonio.topography.correlation import FEW_PAIRS, taper
from gonio.topography.heights import Values, pitch, values

RINGS = 8  # to a pixel, over which a surface without a direction is averaged: J0 changes by 1 % within one at most
DIGITS = 12  # to which two pairs of directions share k_z
IN_PHASE = 0.5  # chi of neighbours, below which they lose the phase: 1.2 rad rms of Gaussian heights


class Characteristic(NamedTuple):
    """chi over the lags (y, x), complex, with the lags [um], at one k_z; and `settled`, to which it falls: chi_0."""

    x: Values
    y: Values
    chi: npt.NDArray[np.complex128]
    settled: float


class _Screen:
    """A map as the phases of the light that it reflects, ready for any k_z."""

    def __init__(self, heights: xr.Dataset) -> None:
        z = values(heights)
        self._used = np.isfinite(z)
        self._z = np.where(self._used, z, 0.0)
        self._half = [n // 2 for n in z.shape]
        self._shape = [next_fast_len(n + h) for n, h in zip(z.shape, self._half, strict=True)]
        dx, dy = pitch(heights)
        self.x, self.y = (np.arange(-h, h + 1) * step for h, step in zip(self._half[::-1], (dx, dy), strict=True))
        self._pairs = np.rint(self._correlated(self._used.astype(complex)).real)
        part = np.hypot(*np.meshgrid(self.x / self.x[-1], self.y / self.y[-1]))
        self.weight = np.where(part < 1, taper(np.minimum(part, 1.0)), 0.0) * dx * dy
        self.distance = np.hypot(*np.meshgrid(self.x, self.y))
        self._ring = np.rint(self.distance / min(dx, dy) * RINGS).astype(int)
        # A plane wave that the map is too small to hold once: chi_0 is what leaves it as much light as the mirror.
        self._lowest = 1 - j0(2 * math.pi * self.distance / min(self.x[-1], self.y[-1]))

    def _correlated(self, field: npt.NDArray[np.complex128]) -> npt.NDArray[np.complex128]:
        """The sum over pairs of points at each lag up to half a side, padded so that nothing wraps around."""
        whole = ifft2(np.abs(fft2(field, self._shape)) ** 2)
        rows, columns = (np.arange(-h, h + 1) for h in self._half)
        return np.asarray(whole[np.ix_(rows, columns)])

    def at(self, k_z: float) -> Characteristic:
        """The characteristic function at k_z [1/um]."""
        total = self._correlated(np.where(self._used, np.exp(1j * k_z * self._z), 0.0))
        chi = np.where(self._pairs >= FEW_PAIRS, total / np.maximum(self._pairs, 1.0), 0.0)
        row, column = self._half
        neighbours = min(float(chi[row, column + 1].real), float(chi[row + 1, column].real))
        if neighbours < IN_PHASE:
            raise ValueError(
                f"the points of the map are too far apart for this light: neighbours keep {max(neighbours, 0):.0%} of "
                f"its phase, and {IN_PHASE:.0%} are needed: predict by waves, which takes them for smooth between"
            )
        even = self.weight * self._lowest
        return Characteristic(self.x, self.y, chi, float(np.sum(even * chi.real) / np.sum(even)))

    def rings(self, found: Characteristic) -> tuple[Values, Values]:
        """Distances [um] of rings, and the weighted sum over each of what is left of chi without its plateau."""
        ring, weight = self._ring.ravel(), self.weight.ravel()
        left = np.bincount(ring, weight * (found.chi.real - found.settled).ravel()).astype(float)
        count = np.bincount(ring)
        there = np.flatnonzero(count)
        return np.asarray(np.bincount(ring, self.distance.ravel())[there] / count[there]), np.asarray(left[there])


def characteristic(heights: xr.Dataset, k_z: float) -> Characteristic:
    """The characteristic function of the differences of height of a map.

    Parameters
    ----------
    heights : xarray.Dataset
        The map.
    k_z : float
        2 pi (cos theta_i + cos theta_r)/wavelength [1/um].

    Returns
    -------
    Characteristic
        chi over lags up to half the sides, 1 at the lag 0, and the plateau to which it falls.

    Raises
    ------
    ValueError
        Neighbouring points lose the phase.

    """
    return _Screen(heights).at(k_z)


def diffracted_by_heights(
    g: Geometry, heights: xr.Dataset, wavelength: float, has_direction: bool = False
) -> tuple[Values, Values]:
    """The integral above with R = X = 1 [1/sr], and chi_0, the share of the mirror direction; wavelength in um.

    has_direction: the whole plane of lags, the map's x axis being the plane of incidence unless the geometry turns it
    (phi_i); else chi is averaged over all directions. Costs two FFTs of the map for each k_z that differs.
    Raises ValueError where neighbouring points lose the phase.
    """
    screen = _Screen(heights)
    k_z = np.ravel(2 * math.pi / wavelength * (g.cos_i + g.cos_r) * np.ones(np.shape(g.x_r)))
    along, across = (np.ravel((i + r) * np.ones(np.shape(g.x_r))) for i, r in ((g.x_i, g.x_r), (g.y_i, g.y_r)))
    out, share = np.empty(k_z.shape), np.empty(k_z.shape)
    rounded = np.round(k_z, DIGITS)
    for one in np.unique(rounded):
        found, rows = screen.at(float(one)), np.flatnonzero(rounded == one)
        share[rows] = max(found.settled, 0.0)  # of a rough map it is a small number of either sign
        if has_direction:
            plane = (found.chi - found.settled) * screen.weight
            turns = ((along, found.x), (across, found.y))
            x, y = (np.exp(2j * math.pi / wavelength * np.outer(part[rows], lag)) for part, lag in turns)
            out[rows] = np.real(np.einsum("ry,yx,rx->r", y, plane, x, optimize=True))
        else:
            r, left = screen.rings(found)
            out[rows] = j0(2 * math.pi / wavelength * np.outer(np.hypot(along[rows], across[rows]), r)) @ left
    shape = np.shape(g.x_r)
    return np.reshape(out / wavelength**2, shape), np.reshape(share, shape)
