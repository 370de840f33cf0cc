"""The Klems angle bases: the hemisphere in bands of patches, and which patch holds a direction (klems1994).

A patch is a piece of a band of polar angles; its centre is the mean of the band's bounds, but the pole where a band is
one patch about it. Azimuths are those of the file, in degrees; the first patch of a band is centred on azimuth 0.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Basis:
    """The bands of one basis: polar angles [deg] from `lower` up to the next one or to `upper`, each in `counts`."""

    name: str
    lower: tuple[float, ...]
    counts: tuple[int, ...]
    upper: float = 90.0

    @property
    def size(self) -> int:
        return sum(self.counts)

    @property
    def bounds(self) -> Array:
        return np.array([*self.lower, self.upper])

    def centres(self) -> tuple[Array, Array]:
        """Polar angle and azimuth [deg] of every patch, in the order of the file."""
        middle = (self.bounds[:-1] + self.bounds[1:]) / 2
        theta = [0.0 if n == 1 and low == 0 else t for t, n, low in zip(middle, self.counts, self.lower, strict=True)]
        azimuths = np.concatenate([360.0 * np.arange(n) / n for n in self.counts])
        return np.repeat(theta, self.counts), azimuths

    def index(self, theta: Array, azimuth: Array) -> npt.NDArray[np.int64]:
        """The patch that holds each direction [deg], -1 where none does; 90 deg belongs to the last band."""
        band = np.searchsorted(self.bounds, theta, side="right") - 1
        band = np.where(theta == self.upper, len(self.counts) - 1, band)
        inside = (band >= 0) & (band < len(self.counts))
        band = np.where(inside, band, 0)
        counts = np.array(self.counts)
        first = np.concatenate([[0], np.cumsum(counts)[:-1]])
        count = counts[band]
        patch = np.floor(np.asarray(azimuth) % 360.0 * count / 360.0 + 0.5).astype(np.int64) % count
        return np.where(inside, first[band] + patch, -1)

    def __str__(self) -> str:
        bands = " ".join(f"{low:.17g}:{n}" for low, n in zip(self.lower, self.counts, strict=True))
        return f"{self.name} | {bands} {self.upper:.17g}"


def from_text(text: str) -> Basis:
    """The basis that `str` has written; ValueError where it is another text."""
    name, _, bands = text.rpartition(" | ")
    *pairs, upper = bands.split()
    lower, counts = zip(*(pair.split(":") for pair in pairs), strict=True)
    return Basis(name, tuple(map(float, lower)), tuple(map(int, counts)), float(upper))


FULL = Basis("LBNL/Klems Full", (0, 5, 15, 25, 35, 45, 55, 65, 75), (1, 8, 16, 20, 24, 24, 24, 16, 12))
HALF = Basis("LBNL/Klems Half", (0, 6.5, 19.5, 32.5, 45.5, 58.5, 71.5), (1, 8, 12, 16, 20, 12, 8))
QUARTER = Basis("LBNL/Klems Quarter", (0, 9, 27, 45, 63), (1, 8, 12, 12, 8))
BASES = (FULL, HALF, QUARTER)  # as Radiance has them since 2021; a file may define its own
