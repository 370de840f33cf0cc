"""How much the atmosphere dims a body at an altitude above the horizon."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]


def airmass(altitude: Any) -> Values:
    """The air on the way of the light, relative to that at the zenith (kasten1989).

    X = 1/(sin h + 0.50572 (h + 6.07995)^-1.6364) with the altitude h [deg] above the horizon: 0.9997 at the zenith,
    38 at the horizon. The shape is that of `altitude`. Raises ValueError for altitudes outside 0 to 90 deg.
    """
    h = np.asarray(altitude, dtype=float)
    if not ((h >= 0) & (h <= 90)).all():
        raise ValueError("an altitude is outside 0 to 90 deg: a body is seen above the horizon")
    return np.asarray(1 / (np.sin(np.radians(h)) + 0.50572 * (h + 6.07995) ** -1.6364))


@dataclass(frozen=True)
class Air:
    """The atmosphere that a body is seen through.

    Parameters
    ----------
    extinction : float
        Extinction coefficient of the band [mag per airmass], at a good site about 0.12 in V.
    altitude : float or array_like (times,)
        Altitude of the body above the observer's horizon [deg].

    """

    extinction: float
    altitude: Any

    @property
    def dimming(self) -> Values:
        """By how many magnitudes the body is fainter."""
        if not (np.isfinite(self.extinction) and self.extinction >= 0):
            raise ValueError(f"the extinction is {self.extinction:g}: give magnitudes per airmass, 0 or more")
        return self.extinction * airmass(self.altitude)
