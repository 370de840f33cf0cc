"""Whether a reflectance obeys the laws of physics: positivity, Helmholtz reciprocity, energy; and where it fails."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.geometry import Geometry
from gonio.measured import dataset, exchange
from gonio.optics.quadrature import gauss_legendre
from gonio.resampling.hemisphere import WHOLE, Reflectance, excessive, reflectances

Values = npt.NDArray[np.float64]
Brdf = Callable[[Geometry], Values]

ROUNDING = 1e-6  # |ln ratio| of exchanged directions that arithmetic alone can leave
QUADRATURE = 1e-3  # excess of a reflectance over 1 that the quadrature alone can leave
PAIRS = 4_000  # pairs of directions at which a model is evaluated
STEEPEST = 85.0  # deg: largest angle of the quasi-random directions, because many models diverge towards 90 deg
INCIDENCES = 20  # nodes over the incidence angle of uniform light
RELATIVE = "the data are relative: without a calibration their energy is unknown"
FURNACE_ANGLES = (0.0, 15.0, 30.0, 45.0, 60.0, 75.0, 85.0)


@dataclass(frozen=True)
class Verdict:
    """One law of physics: whether it holds, by how much it fails and where; None where that is unknown, with why."""

    law: str
    holds: bool | None
    figures: dict[str, float]
    where: str
    why: str = ""


def positivity(brdf: Brdf, theta_i: Sequence[float] | None = None) -> Verdict:
    """The least value of a BRDF over quasi-random directions, and where it is.

    Parameters
    ----------
    brdf : callable
        Gives the BRDF of a Geometry.
    theta_i : sequence of float, optional
        Incidence angles [deg]; without them they are quasi-random too.

    Returns
    -------
    Verdict
        Whether no value is negative, the least value, and its direction.

    """
    angles = _directions(theta_i)
    values = np.asarray(brdf(Geometry.from_degrees(*angles)), dtype=float)
    least = int(np.argmin(values))
    return Verdict("positivity", bool(values[least] >= 0), {"least": float(values[least])}, _place(angles, least))


def reciprocity(brdf: Brdf, theta_i: Sequence[float] | None = None) -> Verdict:
    """The deviation of a BRDF from Helmholtz reciprocity, f(i, r) = f(r, i), over quasi-random pairs of directions.

    Parameters
    ----------
    brdf : callable
        Gives the BRDF of a Geometry.
    theta_i : sequence of float, optional
        Polar angles [deg] of both directions; without them they are quasi-random too.

    Returns
    -------
    Verdict
        Root mean square and worst of ln f(i, r)/f(r, i), and the pair.

    """
    angles = _directions(theta_i, both=True)
    forward = Geometry.from_degrees(*angles)
    exchanged = Geometry(*forward[3:], *forward[:3])
    return _exchange(np.asarray(brdf(forward)), np.asarray(brdf(exchanged)), lambda k: _place(angles, k))


def energy(brdf: Brdf, unit: str, theta_i: Sequence[float] | None = None) -> Verdict:
    """The white furnace: directional-hemispherical reflectance at several incidence angles, at most 1 each.

    Parameters
    ----------
    brdf : callable
        Gives the BRDF of a Geometry.
    unit : str
        Of the BRDF. Relative data have no verdict: without a calibration their reflectance is unknown.
    theta_i : sequence of float, optional
        Incidence angles [deg].

    Returns
    -------
    Verdict
        Whether energy is conserved, the largest reflectance, and the incidence angle.

    """
    if unit != dataset.ABSOLUTE:
        return Verdict("energy", None, {}, "", RELATIVE)
    angles = FURNACE_ANGLES if theta_i is None else theta_i
    reflectances = [hemispherical_reflectance(brdf, angle) for angle in angles]
    worst = int(np.argmax(reflectances))
    figures = {f"DHR({angle:g})": value for angle, value in zip(angles, reflectances, strict=True)}
    return Verdict("energy", reflectances[worst] <= 1 + QUADRATURE, figures, f"theta_i {angles[worst]:g} deg")


def hemispherical_reflectance(brdf: Brdf, theta_i: float, nodes: int = 200) -> float:
    """Directional-hemispherical reflectance: the integral of f cos(theta_r) over the hemisphere.

    Gauss-Legendre quadrature in theta_r and in both halves of phi, dense about the plane of incidence; for lobes no
    narrower than a slope of 0.02 it is good to 1e-5 up to 75 deg.

    Parameters
    ----------
    brdf : callable
        Gives the BRDF of a Geometry.
    theta_i : float
        Incidence angle [deg].
    nodes : int
        Of the quadrature, in each angle.

    Returns
    -------
    float
        In the unit of f times sr: at most 1 for a passive surface where f is in 1/sr, arbitrary for relative data.

    """
    x, w = gauss_legendre(nodes)
    half, v = gauss_legendre(nodes // 2)
    azimuths = np.concatenate([90 * (half + 1), 90 * (half + 1) + 180])
    theta_r, phi = np.meshgrid(45 * (x + 1), azimuths, indexing="ij")
    weights = np.outer(w, np.tile(v, 2)) * (math.pi / 4) * (math.pi / 2)
    f = np.asarray(brdf(Geometry.from_degrees(np.full_like(theta_r, theta_i), theta_r, phi)))
    r = np.radians(theta_r)
    return float(np.sum(weights * f * np.cos(r) * np.sin(r)))


def bihemispherical_reflectance(brdf: Brdf, nodes: int = 200) -> float:
    """Reflectance under light that is uniform over the hemisphere (white-sky albedo), in the unit of f times sr.

    Gauss-Legendre quadrature in theta_i over `hemispherical_reflectance` with so many nodes.
    """
    x, w = gauss_legendre(INCIDENCES)
    cosines_squared = (x + 1) / 2  # by which uniform light arrives evenly
    angles = np.degrees(np.arccos(np.sqrt(cosines_squared)))
    return float(sum(w / 2 * [hemispherical_reflectance(brdf, angle, nodes) for angle in angles]))


def of_scan(scan: xr.Dataset, table: Sequence[Reflectance] | None = None) -> list[Verdict]:
    """The three laws as far as a scan's values show them: reciprocity over the pairs of directions that it holds.

    Parameters
    ----------
    scan : xarray.Dataset
        The scan.
    table : sequence of Reflectance, optional
        The reflectances of the scan over the hemisphere where they are known; None to have them integrated.

    Returns
    -------
    list of Verdict
        Positivity, reciprocity and energy.

    """
    flat = dataset.points(scan)
    values = flat["brdf"].values
    least = int(np.argmin(values))
    angles = np.array([flat[name].values for name in dataset.ANGLES])
    positive = Verdict("positivity", bool(values[least] >= 0), {"least": float(values[least])}, _place(angles, least))
    return [positive, _reciprocity_of_scan(flat), _energy_of_scan(scan, table)]


def _energy_of_scan(scan: xr.Dataset, table: Sequence[Reflectance] | None) -> Verdict:
    """The reflectance of a table that covers the hemisphere; of less than that, whether what it covers is above 1."""
    if dataset.unit(scan) != dataset.ABSOLUTE:
        return Verdict("energy", None, {}, "", RELATIVE)
    try:
        found = reflectances(scan) if table is None else table
    except ValueError as error:  # the other laws hold or fail all the same
        return Verdict("energy", None, {}, "", str(error))
    if not found:
        why = "a scan of some directions says nothing about the hemisphere: fit a model and check that"
        return Verdict("energy", None, {}, "", why)
    worst = max(found, key=lambda one: one.value)
    figures: dict[str, float] = {}
    for one in found:
        name = f"DHR({one.theta_i:g})"
        figures[name] = max(one.value, figures.get(name, -math.inf))
    covered = min(one.covered for one in found)
    part = f"its directions cover {100 * covered:.3g} % of the hemisphere or more, and what they lack adds to this"
    if excessive(found):
        return Verdict("energy", False, figures, worst.where, part if covered < WHOLE else "")
    return Verdict("energy", True if covered >= WHOLE else None, figures, worst.where, part if covered < WHOLE else "")


def _reciprocity_of_scan(flat: xr.Dataset) -> Verdict:
    """Reciprocity of each pair of directions that the scan holds both ways, transmission on both sides."""
    rows, partners = exchange.pairs(flat)
    if not len(rows):
        return Verdict("reciprocity", None, {}, "", "the scan holds no pair of exchanged directions")
    values = flat["brdf"].values
    names = [name for name in dataset.DIRECTIONS if name in flat.coords]
    angles = np.array([flat[name].values for name in names])[:, rows]
    return _exchange(values[rows], values[partners], lambda k: _place(angles, k, names), tolerance=None)


def _exchange(
    forward: Values, exchanged: Values, place: Callable[[int], str], tolerance: float | None = ROUNDING
) -> Verdict:
    """Reciprocity from values at directions and at exchanged ones; without a tolerance there is no verdict."""
    both = (forward > 0) & (exchanged > 0)
    if not both.any():
        return Verdict("reciprocity", None, {}, "", "no pair of exchanged directions has positive values")
    ratio = np.log(forward[both]) - np.log(exchanged[both])  # no quotient: measured values may lie 600 decades apart
    worst = int(np.argmax(np.abs(ratio)))
    figures = {
        "pairs": float(both.sum()),
        "rms ln ratio": float(np.sqrt(np.mean(ratio**2))),
        "worst ln ratio": float(ratio[worst]),
    }
    holds = None if tolerance is None else bool(abs(ratio[worst]) <= tolerance)
    why = "measured values: judge the figures by their uncertainty" if tolerance is None else ""
    return Verdict("reciprocity", holds, figures, place(int(np.flatnonzero(both)[worst])), why)


def _directions(theta_i: Sequence[float] | None, both: bool = False) -> Values:
    """theta_i, theta_r and phi [deg] of quasi-random directions (Halton's sequence).

    With `theta_i`, incidence angles are drawn from it, and with `both` reflection angles as well.
    """
    unit = np.array([_radical_inverses(PAIRS, base) for base in (2, 3, 5)])
    angles: Values = unit * np.array([[STEEPEST], [STEEPEST], [360.0]])
    if theta_i is not None:
        choices = np.asarray(theta_i, dtype=float)
        for k in (0, 1) if both else (0,):
            angles[k] = choices[(unit[k] * len(choices)).astype(int)]
    return angles


def _radical_inverses(count: int, base: int) -> Values:
    """The numbers 1, 2, .. with their digits mirrored at the point: a dimension of Halton's sequence (halton1960)."""
    numbers, out, digit = np.arange(1, count + 1), np.zeros(count), 1.0
    while numbers.any():
        digit /= base
        out += digit * (numbers % base)
        numbers = numbers // base
    return out


def _place(angles: Values, k: int, names: Sequence[str] = dataset.ANGLES) -> str:
    return ", ".join(f"{name} {angles[j][k]:.4g}" for j, name in enumerate(names)) + " deg"
