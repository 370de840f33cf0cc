"""The forward and the backward side exchanged: in plane the sign of theta_r, out of plane the azimuth.

No surface without retroreflecting structure sends more light back than forward when the light comes in flat: Fresnel's
reflectance rises towards grazing incidence and sends it forward. What a scan shows at its largest incidence angle
therefore counts, and nothing that it shows elsewhere may contradict it.
"""

from collections.abc import Iterator
from enum import Enum

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.measured.check import Finding, Severity
from gonio.measured.distinct import combined

Values = npt.NDArray[np.float64]

STEEP = 15.0  # deg: incidence from which the two sides are apart
NEAR = 5.0  # deg: how near to a direction a lobe lies
WINDOW = 10.0  # deg: the lobe of a rough surface begins so much before the mirror direction, and may reach the horizon
SECTOR = 30.0  # deg of azimuth about the plane of incidence: what belongs to a side
TWICE = 2.0  # one side over the other. A matt surface that favours the back (Oren-Nayar) does so by less than 2
LIMB = 10.0  # growth of f towards the horizon. Behind the normal it is below 3 (Lommel-Seeliger, 70 deg), forward any
MOST_INCIDENCES, ROUNDED = 60, 5.0  # a table with more incidence angles than that is looked at in steps of so many deg
MOST_POINTS = 1_000_000  # of a table: of more, every n-th is looked at


class Side(Enum):
    """Which side the light of one incidence angle is on."""

    FORWARD, BACK, NEITHER = range(3)


def turned(flat: xr.Dataset) -> list[Finding]:
    """`sign-reversed` for a scan in plane, `azimuth-mirrored` for others."""
    seen = list(_by_incidence(flat))
    if not seen:
        return []
    steepest = max(theta_i for theta_i, *_ in seen)
    last = [side for theta_i, side, *_ in seen if theta_i == steepest]
    if any(side is Side.FORWARD for _, side, *_ in seen) or 2 * last.count(Side.BACK) <= len(last):
        return []
    angles = {theta_i for theta_i, *_ in seen}
    back = {theta_i for theta_i, side, *_ in seen if side is Side.BACK}
    at_mirror = {theta_i for theta_i, _, place, _ in seen if abs(place - theta_i) <= NEAR}
    most = max(ratio for *_, ratio in seen)
    times = f"{most:.3g} times what lies forward" if most < np.inf else "and nothing was measured forward"
    what = (
        f"the light lies in the backscatter direction at {len(back)} of {len(angles)} incidence angles, {times}"
        + f"; the peak is at theta_r = -theta_i at {len(at_mirror)}" * bool(at_mirror)
    )
    looks = "a retroreflector looks the same (--model gonio-best-retro, ggx-retro)"
    if dataset.is_in_plane(flat).all():
        remedy = (
            "positive theta_r (phi 180) is the forward side here: if the file counts the other way, give --flip, or "
            f"change the sign of theta_r in the file; {looks}"
        )
        return [Finding(Severity.WARNING, what, remedy, name="sign-reversed")]
    remedy = f"phi 180 is the forward side here: if the file counts the other way, give --mirror-azimuth; {looks}"
    return [Finding(Severity.WARNING, what, remedy, name="azimuth-mirrored")]


def _by_incidence(flat: xr.Dataset) -> Iterator[tuple[float, Side, float, float]]:
    """theta_i, the side of the light, where the back is largest, and back over forward; of incidence from STEEP on."""
    flat = flat.isel(direction=slice(None, None, 1 + flat.sizes["direction"] // MOST_POINTS))
    cosine = -np.cos(np.radians(flat["phi"].values.astype(float)))
    theta_i, theta_r = (flat[name].values.astype(float) for name in ("theta_i", "theta_r"))
    side = np.where(cosine >= np.cos(np.radians(SECTOR)), 1, np.where(-cosine >= np.cos(np.radians(SECTOR)), -1, 0))
    side = np.where(theta_r == 0, 0, side)
    if len(np.unique(np.round(theta_i, 6))) > MOST_INCIDENCES:
        theta_i = np.round(theta_i / ROUNDED) * ROUNDED
    kept = np.flatnonzero((side != 0) & (theta_i >= STEEP) & (theta_i < 90.0))
    if not len(kept):
        return
    theta_i = np.round(theta_i[kept], 6)
    group = combined([*(flat[name].values[kept] for name in dataset.sets(flat)), theta_i])
    order = np.argsort(group, kind="stable")
    values, signed = flat["brdf"].values[kept].astype(float), side[kept] * theta_r[kept]
    for rows in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        angle = float(theta_i[rows[0]])
        found = _side(angle, signed[rows], values[rows])
        if found is not None:
            yield (angle, *found)


def _side(theta_i: float, signed: Values, values: Values) -> tuple[Side, float, float] | None:
    """The side of the light, where on the back its largest value lies, and back over forward; None for nothing seen."""
    forward, back = (sign * signed >= theta_i - WINDOW for sign in (1, -1))
    place = float(-signed[back][np.argmax(values[back])]) if back.any() else np.inf
    if not (signed > NEAR).any():
        if not back.any() or len(values) < 3:
            return None
        peak, least, middle = float(values[back].max()), float(values.min()), float(np.median(values))
        is_lobe = abs(place - theta_i) <= NEAR and peak > TWICE**2 * middle
        lit = peak > 0 and (is_lobe or peak > LIMB * max(least, 0.0))
        return (Side.BACK if lit else Side.NEITHER), place, np.inf
    if not forward.any():
        return None
    if not (signed < -NEAR).any():
        return Side.FORWARD, place, 0.0
    if not back.any():
        return None
    ahead, behind = float(values[forward].max()), float(values[back].max())
    if ahead <= 0 or behind <= 0:
        return (Side.FORWARD if ahead > 0 else Side.BACK if behind > 0 else Side.NEITHER), place, np.inf
    ratio = behind / ahead
    return (Side.BACK if ratio >= TWICE else Side.FORWARD if ratio <= 1 / TWICE else Side.NEITHER), place, ratio
