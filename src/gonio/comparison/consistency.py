"""Values that a scan itself contradicts, so that a fit of all describes none well: whole incidence angles, and edges.

Incidence angles that contradict the others by reciprocity
----------------------------------------------------------

Exchange of source and detector leaves a BRDF as it is: f(a, b) = f(b, a) for the in-plane angles a and b. Where a scan
has both, the difference d = ln f(a, b) - ln f(b, a) is measurement error, whatever the surface. One incidence angle
that differs from most others, while these agree with each other, is the one that is wrong: light that passes the
sample, a spot that leaves it, an arm that is off. Such faults grow towards grazing.

The largest consistent subset (cox2007) is what remains when the worst angle is taken out as long as its differences
stand out. An angle stands out if the median |d| of its pairs is more than twice the median of all pairs, and means more
than 10 %. Six angles are needed to have a majority, and at most a third is taken out: of more, none, since then nothing
says which are right.

Edges
-----
At the end of a curve the arm may stand in the light, the sample may end, or the horizon may cut the detector's view.
The values then fall from one direction to the next by far more than anywhere near. A surface does not do that: a drop
by more than a factor of 2.5 in one step, in ln three times the largest of the eight steps before, is an edge, and what
lies beyond it, six values at most, is no measurement of the surface. A narrow peak is none, as its other flank is as
steep.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.comparison.metrics import curves
from gonio.measured import dataset
from gonio.measured.masking import mask
from gonio.measured.stack import foreign_dims

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]

FEWEST_ANGLES = 6  # of incidence
FEWEST_PAIRS = 5  # of one angle with others
OUTSTANDING = 2.0  # times the median of all pairs: 3.5 standard deviations of a median of seven
LEAST = np.log(1.1)  # of a difference: what a good model misses, so smaller ones spoil no fit
MOST = 1 / 3  # of the angles


EDGE = np.log(2.5)  # of a drop
STEEPER = 3.0  # times the largest step before
WIDE = 1.5  # times the usual step: a gap, such as one about the beam
BEFORE, BEYOND = 8, 6  # steps before a drop, and values beyond it


class Contradiction(NamedTuple):
    """Values at one incidence angle [deg] that the rest of the scan contradicts, and why.

    kind: `reciprocity` or `edge`. rows: their places among the points of the scan.
    """

    kind: str
    theta_i: float
    rows: Places
    words: str


def record(found: Sequence[Contradiction]) -> list[dict[str, Any]]:
    """Contradictions as plain data, with the number of points of each."""
    return [{"kind": one.kind, "theta_i": one.theta_i, "points": len(one.rows), "words": one.words} for one in found]


def consistent(scan: xr.Dataset) -> tuple[xr.Dataset, list[Contradiction]]:
    """The scan with the values masked that the rest of it contradicts, and which these are."""
    if foreign_dims(scan):  # many scans, which a Problem refuses
        return scan, []
    points = dataset.points(scan)
    found = contradictions(points)
    if not found:
        return scan, []
    flat = dataset.flatten(scan)
    in_use, wrong = np.flatnonzero(dataset.in_use(flat)), np.zeros(flat.sizes["direction"], dtype=bool)
    for one in found:
        wrong[in_use[one.rows]] = True
    return mask(flat, exclude=xr.DataArray(wrong, dims="direction"), why="that the rest of the scan contradicts"), found


def contradictions(points: xr.Dataset) -> list[Contradiction]:
    """The values of a flat scan that the rest of it contradicts: incidence angles, the worst first, then edges.

    None of a scan with transmission, whose exchanged directions lie on the other side, nor of a surface that was
    turned, whose curves are many at one incidence angle; nor of degrees of polarisation, which change under exchange.
    """
    is_turned = "phi_i" in points.coords and len(np.unique(points["phi_i"].values)) > 1
    if is_turned or "transmission" in dataset.modes(points) or dataset.is_degree(points):
        return []
    angles = inconsistent_angles(points)
    theta_i = points["theta_i"].values
    found = []
    for angle, factor, others in angles:
        words = (
            f"theta_i {angle:g} deg contradicts the other incidence angles by reciprocity, by a factor of "
            f"{math.exp(factor):.3g}, and they each other by {math.exp(others):.3g} (medians)"
        )
        found.append(Contradiction("reciprocity", angle, np.flatnonzero(theta_i == angle), words))
    wrong = {angle for angle, _, _ in angles}
    return found + [edge for edge in _edges(points) if edge.theta_i not in wrong]


def _edges(points: xr.Dataset) -> Iterator[Contradiction]:
    """The values beyond a sudden drop at the ends of the in-plane curves that are positive throughout."""
    signed, values = dataset.signed_theta_r(points), points["brdf"].values
    for key, rows in curves(points):
        if len(rows) < BEFORE + BEYOND + 1 or (values[rows] <= 0).any():
            continue
        for outward in (rows[::-1], rows):  # each ends at an end of the curve
            fall, width = -np.diff(np.log(values[outward])), np.abs(np.diff(signed[outward]))
            fall[width > WIDE * np.median(width)] = 0.0  # across a gap anything may happen
            last = range(len(fall) - BEYOND, len(fall))
            before = {k: float(np.abs(fall[max(k - BEFORE, 0) : k]).max()) for k in last}
            at = next((k for k in last if fall[k] > max(EDGE, STEEPER * before[k])), None)
            if at is None:
                continue
            beyond = outward[at + 1 :]
            low, high = sorted((float(signed[beyond[0]]), float(signed[beyond[-1]])))
            where = f"{low:g}" if low == high else f"{low:g} to {high:g}"
            words = (
                f"theta_i {key['theta_i']:g}, theta_r {where} deg: the values fall by a factor of "
                f"{math.exp(fall[at]):.3g} in one step at the end of the curve, and by at most "
                f"{math.exp(before[at]):.3g} in the steps before"
            )
            yield Contradiction("edge", float(key["theta_i"]), beyond, words)


def inconsistent_angles(points: xr.Dataset) -> list[tuple[float, float, float]]:
    """The incidence angles of a flat scan that are no part of its largest consistent subset, the worst first.

    Each as angle [deg], median |ln ratio| with the others, and that of the others with each other.
    """
    theta_i = points["theta_i"].values
    angles = np.unique(theta_i)
    if not FEWEST_ANGLES <= len(angles) <= 1000:
        return []
    pairs = _pairs(points)
    out: list[tuple[float, float, float]] = []
    while worst := _worst(pairs, len(angles) - len(out)):
        out.append(worst)
        if len(out) > MOST * len(angles):
            return []
        pairs = {key: value for key, value in pairs.items() if worst[0] not in key[:2]}
    return out


def _worst(pairs: Mapping[tuple[float, float, int], float], angles: int) -> tuple[float, float, float] | None:
    """The angle whose differences stand out most, with the medians of its pairs and of the others, or None."""
    if angles < FEWEST_ANGLES - 1:
        return None
    worst = None
    typical = float(np.median(list(pairs.values()))) if pairs else 0.0
    for angle in {key[0] for key in pairs} | {key[1] for key in pairs}:
        own = [value for key, value in pairs.items() if angle in key[:2]]
        others = [value for key, value in pairs.items() if angle not in key[:2]]
        if len(own) < FEWEST_PAIRS or len(others) < FEWEST_PAIRS:
            continue
        median = float(np.median(own))
        if median > max(OUTSTANDING * typical, LEAST) and (worst is None or median > worst[1]):
            worst = angle, median, float(np.median(others))
    return worst


def _pairs(points: xr.Dataset) -> dict[tuple[float, float, int], float]:
    """|ln f(a, b) - ln f(b, a)| for every two incidence angles and each side of the normal, the mean over sets.

    Where b lies between two measured angles of the curve at a, its logarithm is interpolated.
    """
    signed, values = dataset.signed_theta_r(points), points["brdf"].values
    found: dict[tuple[float, float, int], list[float]] = {}
    by_set: dict[tuple[object, ...], dict[float, tuple[Values, Values]]] = {}
    for key, rows in curves(points):
        used = rows[values[rows] > 0]
        if len(used) > 1:
            of_set = by_set.setdefault(tuple(v for k, v in key.items() if k != "theta_i"), {})
            of_set[key["theta_i"]] = signed[used], np.log(values[used])
    for of_set in by_set.values():
        angles = sorted(of_set)
        for k, a in enumerate(angles):
            for b in angles[k + 1 :]:
                for side in (1, -1):
                    there, back = _at(of_set[a], side * b), _at(of_set[b], side * a)
                    if np.isfinite(there + back):
                        found.setdefault((a, b, side), []).append(abs(there - back))
    return {key: float(np.mean(some)) for key, some in found.items()}


def _at(curve: tuple[Values, Values], theta: float) -> float:
    theta_r, log = curve
    return float(np.interp(theta, theta_r, log, left=np.nan, right=np.nan))
