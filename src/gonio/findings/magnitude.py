"""Values that are too large: a reflectance above 1, and whether percent or a factor pi would explain it.

In plane alone the hemisphere is not known. An isotropic surface whose lobe keeps its shape in direction cosines (the
shift invariance of Harvey and Shack) has

    R(theta_i) = integral of f(s) over the unit disc,   s = |beta - beta_0|,

as d beta_x d beta_y = cos(theta) d omega; beta_0 is the mirror direction. f(s) is the lower of the two sides, and where
the scan has no value it is 0, so that R is low rather than high.
"""

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.findings.curves import Curve
from gonio.measured import dataset
from gonio.measured.check import Finding, Severity
from gonio.resampling.hemisphere import EXCESS, Reflectance

Values = npt.NDArray[np.float64]

ESTIMATE = 1.25  # R in plane: 10 % of calibration, and 15 % of the integral over a peak two samples wide
BRUSHED = 20.0  # the same on one side of the normal: a brushed surface fans its light out in the plane that is scanned
DIFFUSE = 1.5  # largest over least value: such a curve has no lobe, and so no fan
STEEPEST = 75.0  # deg: towards the horizon values grow for every surface
BEHIND = -30.0  # deg: a scan that reaches this far behind the normal shows what is beside the lobe
NODES = 1_500  # of the integral over s, from 0 to 2, denser towards the peak


def too_large(scan: xr.Dataset, curves: list[Curve], table: Sequence[Reflectance]) -> list[Finding]:
    """`reflectance-above-one`, with `percent` and `factor-pi` where these would explain it.

    table: the reflectances of a table that covers the hemisphere; else they are estimated from the curves.
    """
    if scan["brdf"].attrs.get("units") != dataset.ABSOLUTE or scan.attrs.get("quantity"):
        return []
    value, most, where, how = _of_table(table) if table else _in_plane(curves)
    if not value > most:
        return []
    what = f"{how} {100 * value:.4g} % of the light that falls on the surface"
    remedy = "check unit and calibration, and what filled gaps; --divide VALUE divides by a number that you know"
    # In plane a brushed surface may look so, and a fit is not to warn of each; over the hemisphere nothing may.
    severity = Severity.WARNING if table or value > BRUSHED else Severity.NOTE
    out = [Finding(severity, what, remedy, where, "reflectance-above-one")]
    if most < BRUSHED and value / np.pi <= most:
        what = f"the reflectance is {value:.3g}, and {value / np.pi:.3g} when divided by pi"
        remedy = "if the values are reflectance factors (pi f, BRF), give --divide pi"
        out.append(Finding(severity, what, remedy, where, "factor-pi"))
    if value / 100 <= most:
        what = f"the reflectance is {value:.3g}, and {value / 100:.3g} when divided by 100"
        out.append(Finding(severity, what, "if the values are percent, give --divide 100", where, "percent"))
    return out


Found = tuple[float, float, str, str]  # reflectance, what it may be, where, and how it was found


def _of_table(table: Sequence[Reflectance]) -> Found:
    """The largest reflectance over the hemisphere."""
    worst = max(table, key=lambda one: one.value)
    return worst.value, 1 + EXCESS, worst.where, "the table scatters"


def _in_plane(curves: list[Curve]) -> Found:
    """The curve whose reflectance is largest over what it may be."""
    worst: Found = (0.0, ESTIMATE, "", "")
    for curve in curves:
        value = reflectance(curve)
        inner = curve.values[np.abs(curve.theta_r) <= STEEPEST]
        is_diffuse = inner.size and inner.max() <= DIFFUSE * inner.min()
        most = ESTIMATE if is_diffuse or curve.theta_r[0] <= BEHIND else BRUSHED
        if value / most > worst[0] / worst[1]:
            worst = (value, most, f"{curve.name} deg", "an isotropic surface with these values in plane scatters")
    return worst


def reflectance(curve: Curve) -> float:
    """The directional-hemispherical reflectance of an isotropic surface with this curve, low rather than high.

    The lobe may lie about the mirror direction, or back towards the source: the lower of both counts.
    """
    if len(curve.theta_r) < 3:
        return 0.0
    return min(_about(curve, sign * float(np.sin(np.radians(curve.theta_i)))) for sign in (1, -1))


def _about(curve: Curve, centre: float) -> float:
    """The integral over the disc of direction cosines for a lobe about `centre`."""
    beta, f = np.sin(np.radians(curve.theta_r)), np.maximum(curve.values, 0.0)
    s = 2.0 * np.linspace(0.0, 1.0, NODES + 1) ** 2
    middle = (s[1:] + s[:-1]) / 2
    ahead, behind = (np.interp(centre + sign * middle, beta, f, np.nan, np.nan) for sign in (1, -1))
    lower = np.nan_to_num(np.fmin(ahead, behind))
    # The circle of radius s about beta_0 lies inside the unit disc but for the half angle whose cosine this is.
    cosine = (1 - centre**2 - middle**2) / np.maximum(2 * abs(centre) * middle, 1e-12)
    inside = 1 - np.arccos(np.clip(cosine, -1, 1)) / np.pi
    return float(np.sum(np.pi * np.diff(s**2) * lower * inside))
