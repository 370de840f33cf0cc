"""A diffuse standard against its certified curve (guo2023, Fig 7), over which angles belongs to the number.

No standard is Lambertian: against a constant real Spectralon differs by percents beyond some 30 deg. So the certificate
is a curve, and the deviation is given for several ranges of theta_r.
"""

import math
from dataclasses import dataclass

import numpy as np
import xarray as xr

from gonio.measured import dataset
from gonio.resampling.difference import difference
from gonio.verification.delta import Deviation, Values, delta

RANGES = (20.0, 30.0, 45.0, 60.0, 75.0)  # deg of |theta_r|, up to which deviations are given


@dataclass(frozen=True)
class Compared:
    """A scan of a standard with the certified values at its directions, flat.

    points: the scan, with `other`, the certified value. missing: how many directions the certificate does not reach.
    """

    points: xr.Dataset
    missing: int

    @property
    def theta_r(self) -> Values:
        """Signed [deg] (n,)."""
        return dataset.signed_theta_r(self.points)

    def within(self, limit: float, theta_i: float | None = None, expanded: float = math.nan) -> Deviation:
        """Delta over |theta_r| up to a limit [deg], of one theta_i or of all.

        expanded: relative, k = 2; without it twice the root mean square of what the scan states, NaN where it states
        none.
        """
        rows = np.abs(self.theta_r) <= limit + 1e-6
        if theta_i is not None:
            rows &= self.points["theta_i"].values == theta_i
        part = self.points.isel(direction=np.flatnonzero(rows))
        measured = part["brdf"].values
        known = expanded if math.isfinite(expanded) else _expanded(part)
        what = f"|theta_r| up to {limit:g} deg" + (f", theta_i = {theta_i:g} deg" if theta_i is not None else "")
        return Deviation(what, len(measured), delta(measured, part["other"].values), known)

    def deviations(self, expanded: float = math.nan) -> list[Deviation]:
        """Over each range of RANGES that holds more directions than the one before, and over all."""
        reach = float(np.abs(self.theta_r).max()) if self.points.sizes["direction"] else 0.0
        limits = [limit for limit in RANGES if limit < reach] + [reach]
        found = [self.within(limit, expanded=expanded) for limit in limits]
        return [one for k, one in enumerate(found) if one.count > (found[k - 1].count if k else 0)]


def diffuse(scan: xr.Dataset, certified: xr.Dataset) -> Compared:
    """A scan of a standard beside its certified BRDF, which is interpolated to the scan's directions.

    Raises ValueError where one of them is in arbitrary units, or nothing is in common.
    """
    for one, what in ((scan, "the scan"), (certified, "the certificate")):
        if dataset.unit(one) != dataset.ABSOLUTE:
            raise ValueError(
                f"{what} is in {dataset.unit(one)}: absolute values (1/sr) are compared with a certificate"
            )
    found = difference(certified, scan)
    if not found.count:
        raise ValueError("the certificate reaches no direction of the scan")
    return Compared(found.points, found.missing)


def lambertian(scan: xr.Dataset, reflectance: float) -> xr.Dataset:
    """A certificate that is one constant, reflectance/pi, at the directions of a scan: for a range about the normal."""
    flat = dataset.points(scan)
    same = flat.copy()
    same["brdf"] = flat["brdf"] * 0 + reflectance / math.pi
    return same


def _expanded(part: xr.Dataset) -> float:
    squares = [part[n].values ** 2 for n in ("uncertainty", "uncertainty_systematic") if n in part]
    if not squares or not part.sizes["direction"]:
        return math.nan
    return 2 * float(np.sqrt(np.mean(np.sum(squares, axis=0) / part["brdf"].values ** 2)))
