"""The energy of a standard: what it scatters into the measured directions is at most what falls on it.

    R = integral of f cos(theta_r) over the hemisphere <= 1

Of a scan in the plane of incidence f is taken to change with the azimuth as a + b cos(phi), so that the mean of both
sides counts: R = 2 pi integral of (f(theta_r) + f(-theta_r))/2 cos(theta_r) sin(theta_r), up to the angle that both
sides reach. What lies beyond it only adds.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset
from gonio.measured.causes import causes, total
from gonio.optics.quadrature import gauss_legendre
from gonio.resampling.hemisphere import reflectances
from gonio.resampling.sources import sets_of
from gonio.verification.checks.outcome import Detail, Outcome

Values = npt.NDArray[np.float64]
NODES = 200
DECIMALS = 2  # of a degree, to which readings of one incidence angle agree
FEWEST = 3  # directions of a curve that has an integral
REMEDY = (
    "the scale is too large: look at the solid angle, the transmittance of the filter, the certificate, and whether "
    "the detector sees the whole spot (--fill)"
)


def energy(scan: xr.Dataset) -> Outcome:
    """The largest reflectance over the incidence angles and sets of a scan, which is at most 1.

    Raises ValueError for relative data, and where no curve of the scan has an integral.
    """
    if dataset.unit(scan) != dataset.ABSOLUTE:
        raise ValueError(f"the scan is in {dataset.unit(scan)}: only absolute values (1/sr) have an energy")
    flat = dataset.points(scan)
    in_plane = bool(dataset.is_in_plane(flat).all())
    found = list(_in_plane(flat)) if in_plane else list(_over_hemisphere(scan))
    if not found:
        raise ValueError("no curve of the scan reaches both sides of the normal: an integral needs both")
    largest = max(found, key=lambda one: one[0].value)
    notes = [f"the measured directions cover {100 * largest[1]:.3g} % of the hemisphere; what lies beyond only adds"]
    notes += ["in plane alone: between both sides f is taken to change as the cosine of the azimuth"] * in_plane
    return Outcome(
        largest[0].value,
        largest[0].uncertainty,
        len(found),
        f"reflectance of the measured directions, {largest[0].what}",
        REMEDY,
        expected=1.0,
        details=tuple(one for one, _ in found),
        notes=tuple(notes),
    )


def _in_plane(flat: xr.Dataset) -> Iterator[tuple[Detail, float]]:
    """The reflectance of each curve with the part of the hemisphere that it reaches."""
    for labels, part in sets_of(flat):
        angles = np.round(part["theta_i"].values.astype(float), DECIMALS)
        for theta_i in np.unique(angles).tolist():
            curve = part.isel(direction=np.flatnonzero(angles == theta_i))
            signed = dataset.signed_theta_r(curve)
            reach = float(min(signed.max(), -signed.min()))
            if len(np.unique(signed)) >= FEWEST and reach > 0:
                weights = _weights(signed, reach)
                value, spread = float(weights @ curve["brdf"].values), _uncertainty(curve, weights)
                yield Detail(_where(labels, theta_i), value, spread), float(np.sin(np.radians(reach)) ** 2)


def _weights(signed: Values, reach: float) -> Values:
    """What each value of a curve counts in the integral (n,): f between them is linear in the angle."""
    order = np.argsort(signed, kind="stable")
    at, first = np.unique(signed[order], return_index=True)  # of repeats the first stands for the direction
    x, w = gauss_legendre(NODES)
    theta = np.radians(reach) * (x + 1) / 2
    scale = np.pi * np.radians(reach) / 2 * w * np.cos(theta) * np.sin(theta)  # 2 pi times half of each side
    out = np.zeros(len(signed))
    for side in (np.degrees(theta), -np.degrees(theta)):
        upper = np.clip(np.searchsorted(at, side), 1, len(at) - 1)
        share = (side - at[upper - 1]) / (at[upper] - at[upper - 1])
        np.add.at(out, order[first[upper]], scale * share)
        np.add.at(out, order[first[upper - 1]], scale * (1 - share))
    return out


def _uncertainty(curve: xr.Dataset, weights: Values) -> float:
    """The standard uncertainty of a weighted sum: random errors alone, and every cause; NaN where none is stated."""
    parts = [float(weights @ shifts) for shifts in causes(curve).values()]
    if "uncertainty" in curve:
        parts.append(float(np.sqrt(np.sum((weights * curve["uncertainty"].values) ** 2))))
    return float(total(parts)) if parts else float("nan")


def _over_hemisphere(scan: xr.Dataset) -> Iterator[tuple[Detail, float]]:
    """The reflectance of each set and incidence angle; uncertainties of all directions together, as of one factor."""
    squares = [scan[n].values ** 2 for n in ("uncertainty", "uncertainty_systematic") if n in scan]
    spreads: list[float] = []
    if squares:
        units = {"units": scan["brdf"].attrs["units"]}
        dims = scan["brdf"].dims
        spread = scan.assign(brdf=(dims, np.sqrt(np.sum(squares, axis=0)), units))
        spreads = [one.value for one in reflectances(spread)]
    found = reflectances(scan)
    known = spreads if len(spreads) == len(found) else [float("nan")] * len(found)
    for one, u in zip(found, known, strict=True):
        yield Detail(one.where, one.value, u), one.covered


def _where(labels: Mapping[str, Any], theta_i: float) -> str:
    return ", ".join([*(f"{name} {value}" for name, value in labels.items()), f"theta_i {theta_i:g} deg"])
