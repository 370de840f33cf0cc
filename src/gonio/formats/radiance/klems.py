"""The Klems angle bases (klems1994): the hemisphere divided into bands of patches, and the patch of a direction.

A band is a range of polar angles, divided into patches of equal azimuth. The centre of a patch is at the mean of the
band's bounds; that of a single patch about the pole is the pole. Azimuths are those of the file, in degrees; the first
patch of a band is centred on azimuth 0.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Basis:
    """One basis: `lower` [deg] has where each band begins, `upper` where the last ends, `counts` their patches."""

    name: str
    lower: tuple[float, ...]
    counts: tuple[int, ...]
    upper: float = 90.0

    @property
    def size(self) -> int:
        """The number of patches."""
        return sum(self.counts)

    @property
    def bounds(self) -> Array:
        """The bounds of the bands [deg], one more than there are bands."""
        return np.array([*self.lower, self.upper])

    def centres(self) -> tuple[Array, Array]:
        """Polar angle and azimuth [deg] of every patch, in the order of the file."""
        middle = (self.bounds[:-1] + self.bounds[1:]) / 2
        theta = [0.0 if n == 1 and low == 0 else t for t, n, low in zip(middle, self.counts, self.lower, strict=True)]
        azimuths = np.concatenate([360.0 * np.arange(n) / n for n in self.counts])
        return np.repeat(theta, self.counts), azimuths

    def projected(self) -> Array:
        """The projected solid angle [sr] of every patch, the integral of the cosine over it."""
        squares = np.sin(np.radians(self.bounds)) ** 2
        return np.repeat(np.pi * np.diff(squares) / self.counts, self.counts)

    def index(self, theta: Array, azimuth: Array) -> npt.NDArray[np.int64]:
        """The index of the patch of each direction [deg], -1 where it has none; `upper` belongs to the last band."""
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
    """The basis from the text that `str` gives. Raises ValueError for another text."""
    name, _, bands = text.rpartition(" | ")
    *pairs, upper = bands.split()
    lower, counts = zip(*(pair.split(":") for pair in pairs), strict=True)
    return Basis(name, tuple(map(float, lower)), tuple(map(int, counts)), float(upper))


FULL = Basis("LBNL/Klems Full", (0, 5, 15, 25, 35, 45, 55, 65, 75), (1, 8, 16, 20, 24, 24, 24, 16, 12))
HALF = Basis("LBNL/Klems Half", (0, 6.5, 19.5, 32.5, 45.5, 58.5, 71.5), (1, 8, 12, 16, 20, 12, 8))
QUARTER = Basis("LBNL/Klems Quarter", (0, 9, 27, 45, 63), (1, 8, 12, 12, 8))
BASES = (FULL, HALF, QUARTER)  # as in Radiance since 2021; a file may define others
