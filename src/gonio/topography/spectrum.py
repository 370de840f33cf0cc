"""The height spectrum S2 of a map [um^4] over spatial frequency [1/um], and the closed forms of an ABC spectrum."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.fft import fft2, fftfreq, fftshift
from scipy.special import gammaln

from gonio.topography.heights import Values, pitch, values


class Spectrum(NamedTuple):
    """S2 [um^4] over frequencies (y, x) [1/um], and its mean over directions (`radial`) at the frequencies `f`.

    The sum of S2 df_x df_y is the mean squared height; S2 counts both signs of a frequency.
    """

    fx: Values
    fy: Values
    two: Values
    f: Values
    radial: Values

    @property
    def nyquist(self) -> float:
        """The largest frequency that the pitch resolves in every direction [1/um]."""
        return float(min(np.abs(self.fx).max(), np.abs(self.fy).max()))

    def rms(self, least: float = 0.0, most: float = math.inf) -> float:
        """The rms height [um] of frequencies from `least` to `most` [1/um]."""
        f = np.hypot(*np.meshgrid(self.fx, self.fy))
        cell = float(np.diff(self.fx[:2])[0] * np.diff(self.fy[:2])[0])
        return math.sqrt(float(self.two[(f >= least) & (f <= most)].sum()) * cell)


def spectrum(heights: xr.Dataset) -> Spectrum:
    """The spectrum of a levelled map: |dx dy sum z w exp(-2 pi i f x)|^2/(A mean w^2), w the Hann window.

    Missing points have no weight. The radial mean is over rings as wide as the coarser of both frequency steps.
    """
    z, (dx, dy) = values(heights), pitch(heights)
    used = np.isfinite(z)
    rows, columns = z.shape
    window = np.outer(_hann(rows), _hann(columns)) * used
    area = dx * columns * dy * rows
    amplitude = fft2(np.where(used, z, 0.0) * window) * (dx * dy)
    two = fftshift(np.abs(amplitude) ** 2) / (area * np.mean(window**2))
    fx, fy = fftshift(fftfreq(columns, dx)), fftshift(fftfreq(rows, dy))
    f, mean = _rings(fx, fy, two)
    return Spectrum(fx, fy, two, f, mean)


def _hann(count: int) -> Values:
    """The window over so many points, one that is nowhere zero, so that two points have one too."""
    return np.sin(math.pi * (np.arange(count) + 0.5) / count) ** 2


def _rings(fx: Values, fy: Values, two: Values) -> tuple[Values, Values]:
    step = max(float(np.diff(fx).max()), float(np.diff(fy).max()))
    f = np.hypot(*np.meshgrid(fx, fy))
    end = min(np.abs(fx).max(), np.abs(fy).max())
    kept = (f > 0) & (f <= end)
    ring = np.rint(f[kept] / step).astype(int)
    count = np.bincount(ring)
    there = np.flatnonzero(count)
    mean = np.bincount(ring, f[kept])[there] / count[there]
    return mean, np.bincount(ring, two[kept])[there] / count[there]


@dataclass(frozen=True)
class AbcSpectrum:
    """The ABC (K-correlation) spectrum A/(1 + (B f)^2)^(C/2): A [um^4], B [um], C > 2 for heights of finite rms."""

    A: float
    B: float
    C: float

    def two(self, f: Values) -> Values:
        """S2 [um^4] at frequencies [1/um]."""
        return self.A / (1 + (self.B * np.asarray(f)) ** 2) ** (self.C / 2)

    def profile(self, f: Values) -> Values:
        """S1 [um^3] of a profile, both signs of a frequency counted: the integral of S2 over the other frequency."""
        ratio = math.exp(gammaln((self.C - 1) / 2) - gammaln(self.C / 2))
        top = self.A * math.sqrt(math.pi) * ratio / self.B
        return top * (1 + (self.B * np.asarray(f)) ** 2) ** (-(self.C - 1) / 2)

    def rms(self, least: float, most: float) -> float:
        """The rms height [um] of frequencies from `least` to `most` [1/um], the latter may be infinite."""
        power = 1 - self.C / 2
        ends = [(1 + (self.B * f) ** 2) ** power if math.isfinite(f) else 0.0 for f in (least, most)]
        return math.sqrt(2 * math.pi * self.A / (self.B**2 * (self.C - 2)) * (ends[0] - ends[1]))

    def slope(self, least: float, most: float) -> float:
        """The rms slope, both axes together, of frequencies from `least` to `most` [1/um]; C is not 4.

        It has no limit as `most` grows for C <= 4: a slope without its band means nothing.
        """

        def part(f: float) -> float:
            u = 1 + (self.B * f) ** 2
            two, one = 2 - self.C / 2, 1 - self.C / 2
            return float((u**two - 1) / two - (u**one - 1) / one)

        return math.sqrt(4 * math.pi**3 * self.A / self.B**4 * (part(most) - part(least)))
