"""cos(theta_r) left in the values, from reciprocity.

For a BRDF that was multiplied by cos(theta_r),  ln f(i, r) - ln f(r, i) = ln(cos theta_r/cos theta_i),  and for the
BRDF itself it is 0. Which of the two is nearer, over all pairs of directions that the scan holds both ways, tells them
apart. Where no pair was measured exactly, ln f is interpolated along the curves of two incidence angles.
"""

from collections.abc import Iterator
from itertools import combinations

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.findings.curves import Curve
from gonio.measured import exchange
from gonio.measured.check import Finding, Severity
from gonio.measured.dataset import RELATIVE

Values = npt.NDArray[np.float64]

APART = 0.1  # |ln(cos theta_r/cos theta_i)|: pairs of less say nothing beside scatter of some percent
WIDEST = 5.5  # deg: between measured angles that ln f is interpolated over; goniometers step by 5 or less
FEW = 6  # pairs; of fewer the improvement must be larger, as scatter alone gives a factor of 2 now and then
BETTER, BETTER_OF_FEW = 2.0, 5.0  # how many times better reciprocity must become
MOST_CURVES = 40  # of one set: more are taken evenly
MOST_POINTS = 50_000  # of a scan without curves whose pairs are looked for


def cosine_left_in(flat: xr.Dataset, curves: list[Curve]) -> list[Finding]:
    """`cosine-left-in` where dividing by cos(theta_r) makes reciprocity much better."""
    pairs = [pair for group in _sets(curves) for pair in _pairs(group)]
    if not pairs and flat.sizes["direction"] <= MOST_POINTS:
        pairs = list(_measured(flat))
    told = np.array([pair for pair in pairs if abs(pair[1]) >= APART])
    if len(told) < 2:
        return []
    difference, expected = told.T
    before, after = (float(np.median(np.abs(v))) for v in (difference, difference - expected))
    if before < (BETTER if len(told) >= FEW else BETTER_OF_FEW) * after or before == 0:
        return []
    times = f"{before / after:.2g} times better" if after > 1e-3 * before else "exact"
    what = (
        f"dividing by cos(theta_r) makes reciprocity {times}: |ln f(i,r)/f(r,i)| has the median {before:.2g}, then "
        f"{after:.2g}, over {len(told)} pairs of directions"
    )
    remedy = "if the values are f cos(theta_r), as a detector's signal is, give --divide-cosine"
    # What is relative may be a signal, and is said to be no BRDF in 1/sr: worth a note, and no warning at every fit.
    severity = Severity.NOTE if flat["brdf"].attrs.get("units") == RELATIVE else Severity.WARNING
    return [Finding(severity, what, remedy, name="cosine-left-in")]


def _sets(curves: list[Curve]) -> Iterator[list[Curve]]:
    """The curves of each set, those with a positive angle of incidence, MOST_CURVES at most."""
    for key in dict.fromkeys(curve.set for curve in curves):
        group = [curve for curve in curves if curve.set == key and curve.theta_i > 0]
        yield group[:: 1 + len(group) // MOST_CURVES]


def _pairs(group: list[Curve]) -> Iterator[tuple[float, float]]:
    """The value of ln f(i, r)/f(r, i) and what a cosine would make it, for any two incidence angles of a set, on both sides."""
    for one, two in combinations(group, 2):
        for sign in (1.0, -1.0):
            first, second = _log_at(one, sign * two.theta_i), _log_at(two, sign * one.theta_i)
            if first is not None and second is not None:
                cosines = np.cos(np.radians([two.theta_i, one.theta_i]))
                yield first - second, float(np.log(cosines[0] / cosines[1]))


def _log_at(curve: Curve, theta_r: float) -> float | None:
    """The value of ln f of a curve at an angle [deg], between neighbours that are near and positive; None where there are none."""
    k = int(np.searchsorted(curve.theta_r, theta_r - 1e-6))
    if k < len(curve.theta_r) and abs(curve.theta_r[k] - theta_r) <= 1e-6:
        return float(np.log(curve.values[k])) if curve.values[k] > 0 else None
    if k in (0, len(curve.theta_r)):
        return None
    t, f = curve.theta_r[k - 1 : k + 1], curve.values[k - 1 : k + 1]
    if t[1] - t[0] > WIDEST or f.min() <= 0:
        return None
    return float(np.interp(theta_r, t, np.log(f)))


def _measured(flat: xr.Dataset) -> Iterator[tuple[float, float]]:
    """The same from the pairs that were measured exactly, of a scan without curves in plane."""
    rows, partners = exchange.pairs(flat)
    values = flat["brdf"].values.astype(float)
    cosine = np.cos(np.radians(flat["theta_r"].values.astype(float)))
    for here, there in zip(rows.tolist(), partners.tolist(), strict=True):
        if min(values[here], values[there], cosine[here], cosine[there]) > 0:
            yield float(np.log(values[here] / values[there])), float(np.log(cosine[here] / cosine[there]))
