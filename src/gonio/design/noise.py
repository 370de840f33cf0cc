"""The noise of readings that are not there yet: constant and in proportion, as a person says it or a scan shows it.

The standard deviation of a reading of BRDF f is sqrt((r f)^2 + c^2), with r the relative and c the constant part.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.certainty.noise import EXACT, Kinds, estimated
from gonio.measured.sound import is_stated

Values = npt.NDArray[np.float64]


class Noise(NamedTuple):
    """The noise of a reading: relative part r, and constant part c [unit of the BRDF]; `said` is where it is from."""

    relative: float
    constant: float
    said: str = "as given"

    @classmethod
    def parsed(cls, text: str) -> "Noise":
        """`1%`, `0.5`, or `1%+0.5`: a percentage of the BRDF, a constant in its unit, or both.

        Raises ValueError for other text, for a negative number, and where nothing is left.
        """
        parts = [part.strip() for part in text.split("+")]
        relative = [part.removesuffix("%") for part in parts if part.endswith("%")]
        constant = [part for part in parts if not part.endswith("%")]
        try:
            found = cls(float(relative[0]) / 100 if relative else 0.0, float(constant[0]) if constant else 0.0)
        except ValueError:
            found = cls(math.nan, math.nan)
        known = all(math.isfinite(part) and part >= 0 for part in found[:2]) and max(found[:2]) > 0
        if not known or max(len(relative), len(constant)) > 1:
            raise ValueError(f"the noise is {text!r}: write a percentage of the BRDF, a constant, or both, as 1%+0.5")
        return found

    @classmethod
    def stated(cls, uncertainty: Values, modelled: Values) -> "Noise":
        """What the stated standard uncertainties (points,) of a scan come to, at its modelled BRDF (points,)."""
        return _of_parts(uncertainty**2, np.maximum(modelled, 0.0), "as the scan states")

    @classmethod
    def of_residuals(cls, measured: Values, modelled: Values, slopes: Values) -> "Noise":
        """What the residuals of a fit show (`fitting.certainty.noise`); slopes (points, values): of the BRDF.

        Raises ValueError where the values are as many as the points, which leaves no residuals.
        """
        if slopes.shape[0] <= slopes.shape[1]:
            raise ValueError("a fit of as many values as points shows no noise: say it with --noise 1%+0.5")
        kinds = Kinds(np.empty(0), float(np.maximum(modelled, 0.0).max()) or 1.0, False)
        kinds = kinds._replace(variances=kinds.at(np.ones_like(modelled), modelled, measured))
        found = estimated(modelled - measured, slopes.shape[1], slopes, kinds)
        constant, relative = (np.sqrt(found.amounts) * found.size).tolist()
        return cls(max(relative / kinds.top, EXACT), constant, "as the residuals of the fit show")

    def deviation(self, brdf: Values) -> Values:
        """The standard deviation of readings of these BRDFs (m,), in their unit."""
        return np.hypot(self.relative * brdf, self.constant)

    def __str__(self) -> str:
        parts = [f"{100 * self.relative:.2g} %"] * (self.relative > 0) + [f"{self.constant:.2g}"] * (self.constant > 0)
        return " + ".join(parts)


def noise_of(points: xr.Dataset, modelled: Values, slopes: Values) -> Noise:
    """The noise of the points of a fit: as their uncertainty states it, where all have one, else from its residuals."""
    if "uncertainty" in points and is_stated(points["uncertainty"].values).all():
        return Noise.stated(points["uncertainty"].values, modelled)
    return Noise.of_residuals(points["brdf"].values, modelled, slopes)


def _of_parts(variance: Values, modelled: Values, said: str) -> Noise:
    """Both parts by least squares of relative errors of the variance (points,), neither below zero (NNLS)."""
    from scipy.optimize import nnls  # late: half a second that who only looks does not need

    top = float(modelled.max()) or 1.0
    shares = np.stack([np.ones_like(variance), (modelled / top) ** 2], axis=1)
    amounts, _ = nnls(shares / variance[:, None], np.ones_like(variance))
    return Noise(float(np.sqrt(amounts[1])) / top, float(np.sqrt(amounts[0])), said)
