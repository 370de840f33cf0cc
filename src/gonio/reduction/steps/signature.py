"""What the instrument itself scatters: a sweep of the arm through the direct beam, without a sample.

About the mirror direction of a sample, f = f_meas - R f_sig(theta_r - theta_i) cos(0)/cos(theta_r), with R the specular
reflectance as measured, and f_sig the signature over the angle from the direct beam (the idea of ASTM E2387).
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

Values = npt.NDArray[np.float64]
TOO_MUCH = 1 / 3  # of a value: a larger share of the signature is the instrument, and no surface


@dataclass(frozen=True)
class Signature:
    """The signature f_sig [1/sr] at angles from the direct beam [deg], ascending, and the specular reflectance R."""

    offset: Values
    brdf: Values
    specular: float

    def __post_init__(self) -> None:
        if len(self.offset) < 2 or not (np.diff(self.offset) > 0).all() or len(self.offset) != len(self.brdf):
            raise ValueError(
                "a signature needs two angles or more from the direct beam, ascending, with a value at each"
            )
        if not np.isfinite(self.brdf).all():
            raise ValueError("the signature has a value that is not finite")
        if not 0 < self.specular <= 1:
            raise ValueError(f"the specular reflectance is {self.specular:g}: give a number above 0, to 1")

    def share(self, theta_i: Values, theta_r: Values) -> Values:
        """What it adds to the BRDF (n,) [1/sr] at theta_i and signed theta_r [deg], zero beyond its ends."""
        found = np.interp(theta_r - theta_i, self.offset, self.brdf, left=0.0, right=0.0)
        return self.specular * found / np.cos(np.radians(theta_r))
