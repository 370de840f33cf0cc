"""Directional-hemispherical reflectance of lobes that are tabulated about the mirror direction.

Relative Integra files state this reflectance for each lobe (kbdf); scattering.py scales the lobes to it.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from gonio.measured.coordinates import SAME, WIDEST_AZIMUTH

Values = npt.NDArray[np.float64]


def lobe_reflectances(theta_i: Values, phi: Values, theta: Values, brdf: Values) -> Values:
    """Reflectances (.., theta_i) of lobes `brdf` (.., theta_i, phi, theta) [1/sr]; 1 where a lobe is zero everywhere.

    Angles are in degrees, theta from the mirror direction and phi about it, 0 towards the normal. The BRDF is linear
    between nodes and 0 beyond the last theta; NaN counts as 0. Azimuths cover the circle, or run from 0 to 180 deg and
    are mirrored. Raises ValueError for other azimuths, and where theta has one node.
    """
    rows, times = np.arange(len(phi)), 1.0
    if abs(phi[0]) < SAME and abs(phi[-1] - 180) < SAME:
        times = 2.0
    elif 0 < phi[0] + 360 - phi[-1] <= WIDEST_AZIMUTH:
        phi, rows = np.append(phi, phi[0] + 360), np.append(rows, 0)
    elif abs(phi[-1] - phi[0] - 360) > SAME:
        raise ValueError("azimuths all round the mirror direction, or from 0 to 180 deg")
    if len(theta) < 2:
        raise ValueError("several angles from the mirror direction")
    centre = np.radians(theta_i)[:, None]
    around, along = _Cells.between(phi), _Cells.between(theta)
    known = np.nan_to_num(brdf)
    total = np.zeros(brdf.shape[:-2])
    for at, before, share, width in zip(around.middle, around.before, around.share, around.width, strict=True):
        row = (1 - share) * known[..., rows[before], :] + share * known[..., rows[before + 1], :]
        row = (1 - along.share) * row[..., along.before] + along.share * row[..., along.before + 1]
        cosine = np.cos(centre) * np.cos(along.middle) + np.sin(centre) * np.sin(along.middle) * np.cos(at)
        total += np.sum(row * np.maximum(cosine, 0.0) * np.sin(along.middle) * along.width, axis=-1) * width
    reflectance: Values = np.where(total > 0, times * total, 1.0)
    return reflectance


@dataclass(frozen=True)
class _Cells:
    """Cells of at most a degree between nodes: their middles and widths [rad], for the midpoint rule.

    `before` is the node before each cell and `share` the weight of the node after it, in linear interpolation. Sums
    over the cells are within 1e-4 of the integral.
    """

    middle: Values
    width: Values
    before: npt.NDArray[np.intp]
    share: Values

    @classmethod
    def between(cls, nodes: Values) -> "_Cells":
        """The cells between ascending nodes [deg]."""
        spans = np.diff(nodes)
        counts = np.ceil(spans).astype(int)
        before = np.repeat(np.arange(len(spans)), counts)
        within = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        share = (within + 0.5) / counts[before]
        width = np.radians(spans / counts)[before]
        return cls(np.radians(nodes[before] + share * spans[before]), width, before, share)
