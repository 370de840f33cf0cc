"""cos(theta_r) left in the values, from reciprocity.

For a BRDF that was multiplied by cos(theta_r),  ln f(i, r) - ln f(r, i) = ln(cos theta_r/cos theta_i),  and for the
BRDF itself it is 0. Which of the two is nearer, over all pairs of directions that the scan holds both ways, tells them
apart. ln f is interpolated along the curves of two incidence angles, or between the directions of a table that has few
of them in plane.
"""

from collections.abc import Iterator
from itertools import combinations

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.findings.curves import Curve
from gonio.measured import dataset
from gonio.measured.check import Finding, Severity

Values = npt.NDArray[np.float64]

APART = 0.1  # |ln(cos theta_r/cos theta_i)|: pairs of less say nothing beside scatter of some percent
WIDEST = 5.5  # deg: between measured angles that ln f is interpolated over; goniometers step by 5 or less
FEW = 6  # pairs; of fewer the improvement must be larger, as scatter alone gives a factor of 2 now and then
BETTER, BETTER_OF_FEW = 2.0, 5.0  # how many times better reciprocity must become
SIGMAS = (
    4.0  # standard uncertainties of its slope that a cosine must stand out by: one false alarm in 30 000 noisy scans
)
MOST_CURVES = 40  # of one set: more are taken evenly
FEWEST, NEAREST, MOST_ANGLES = 10, 6, 12  # directions of an incidence angle of a table, those of a plane; such angles
AZIMUTHS = (0.0, 45.0, 90.0, 135.0, 180.0)  # deg: at which tables are compared


def cosine_left_in(flat: xr.Dataset, curves: list[Curve]) -> list[Finding]:
    """`cosine-left-in` where dividing by cos(theta_r) makes reciprocity much better."""
    pairs = [pair for group in _sets(curves) for pair in _pairs(group)]
    if len(pairs) < FEW and not dataset.is_in_plane(flat).all():
        pairs += _between(flat)
    told = np.array([pair for pair in pairs if abs(pair[1]) >= APART])
    if len(told) < 2:
        return []
    difference, expected = told.T
    before, after = (float(np.median(np.abs(v))) for v in (difference, difference - expected))
    if before < (BETTER if len(told) >= FEW else BETTER_OF_FEW) * after or before == 0:
        return []
    # The slope of the difference over the expected one is 1 with the cosine and 0 without; 1.48 is the standard
    # deviation over the median of |Gaussian noise|, and a median has 1.25 times the uncertainty of a mean.
    slope = float(np.sum(difference * expected) / np.sum(expected**2))
    if slope < SIGMAS * 1.25 * 1.48 * after / float(np.sqrt(np.sum(expected**2))):
        return []
    times = f"{before / after:.2g} times better" if after > 1e-3 * before else "exact"
    what = (
        f"dividing by cos(theta_r) makes reciprocity {times}: |ln f(i,r)/f(r,i)| has the median {before:.2g}, then "
        f"{after:.2g}, over {len(told)} pairs of directions"
    )
    remedy = "if the values are f cos(theta_r), as a detector's signal is, give --divide-cosine"
    # What is relative may be a signal, and is said to be no BRDF in 1/sr: worth a note, and no warning at every fit.
    severity = Severity.NOTE if flat["brdf"].attrs.get("units") == dataset.RELATIVE else Severity.WARNING
    return [Finding(severity, what, remedy, name="cosine-left-in")]


def _sets(curves: list[Curve]) -> Iterator[list[Curve]]:
    """The curves of each set, those with a positive angle of incidence, MOST_CURVES at most."""
    for key in dict.fromkeys(curve.set for curve in curves):
        group = [curve for curve in curves if curve.set == key and curve.theta_i > 0]
        yield group[:: 1 + len(group) // MOST_CURVES]


def _pairs(group: list[Curve]) -> Iterator[tuple[float, float]]:
    """Values of ln f(i, r)/f(r, i) and what a cosine would make them: two incidence angles of a set, on both sides."""
    for one, two in combinations(group, 2):
        for sign in (1.0, -1.0):
            first, second = _log_at(one, sign * two.theta_i), _log_at(two, sign * one.theta_i)
            if first is not None and second is not None:
                cosines = np.cos(np.radians([two.theta_i, one.theta_i]))
                yield first - second, float(np.log(cosines[0] / cosines[1]))


def _log_at(curve: Curve, theta_r: float) -> float | None:
    """The value of ln f at theta_r [deg], between neighbours that are near and positive; None where there are none."""
    k = int(np.searchsorted(curve.theta_r, theta_r - 1e-6))
    if k < len(curve.theta_r) and abs(curve.theta_r[k] - theta_r) <= 1e-6:
        return float(np.log(curve.values[k])) if curve.values[k] > 0 else None
    if k in (0, len(curve.theta_r)):
        return None
    t, f = curve.theta_r[k - 1 : k + 1], curve.values[k - 1 : k + 1]
    if t[1] - t[0] > WIDEST or f.min() <= 0:
        return None
    return float(np.interp(theta_r, t, np.log(f)))


def _between(flat: xr.Dataset) -> Iterator[tuple[float, float]]:
    """The same of a table of all azimuths, its first set, interpolated between the directions of each incidence angle.

    theta_r and |phi| are polar coordinates, in which ln f is a plane through the nearest directions: a surface that was
    not turned counts as isotropic. Nothing for a table whose directions each have an incidence angle of their own.
    """
    names = dataset.sets(flat)
    rows = np.flatnonzero(flat["brdf"].values > 0)
    rows = rows[np.all([flat[n].values[rows] == flat[n].values[rows[:1]] for n in names], axis=0)] if names else rows
    theta_i = np.round(flat["theta_i"].values[rows].astype(float), 6)
    angles, counts = np.unique(theta_i, return_counts=True)
    angles = angles[(counts >= FEWEST) & (angles > 0)]
    angles = angles[:: 1 + len(angles) // MOST_ANGLES]
    if "phi_i" in flat.coords or len(angles) < 2:
        return
    polar = flat["theta_r"].values[rows] * np.exp(1j * np.radians(flat["phi"].values[rows].astype(float)))
    place, logs = polar.real + 1j * np.abs(polar.imag), np.log(flat["brdf"].values[rows].astype(float))
    wanted = (angles[:, None] * np.exp(1j * np.radians(AZIMUTHS))).ravel()
    table = [_planes(place[theta_i == angle], logs[theta_i == angle], wanted) for angle in angles]
    at = np.array(table).reshape(len(angles), len(angles), len(AZIMUTHS))
    for i, j in combinations(range(len(angles)), 2):
        cosines = np.cos(np.radians(angles[[j, i]]))
        for difference in (at[i, j] - at[j, i])[np.isfinite(at[i, j] - at[j, i])]:
            yield float(difference), float(np.log(cosines[0] / cosines[1]))


def _planes(place: npt.NDArray[np.complex128], logs: Values, wanted: npt.NDArray[np.complex128]) -> Values:
    """At each place wanted, the plane through the values of the nearest places; NaN where none is near."""
    from scipy.spatial import KDTree

    distance, near = KDTree(np.column_stack([place.real, place.imag])).query(
        np.column_stack([wanted.real, wanted.imag]), k=NEAREST
    )
    away = place[near] - wanted[:, None]
    out = np.full(len(wanted), np.nan)
    for k in np.flatnonzero(distance[:, 0] <= WIDEST):
        columns = np.column_stack([np.ones(NEAREST), away[k].real, away[k].imag])
        out[k] = np.linalg.lstsq(columns, logs[near[k]], rcond=1e-6)[0][0]
    return out
