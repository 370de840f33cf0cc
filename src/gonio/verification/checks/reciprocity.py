"""Helmholtz reciprocity of a scan: f(i, r) = f(r, i), for every pair of directions that was measured both ways."""

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured import dataset, exchange
from gonio.measured.causes import causes, total
from gonio.measured.sound import is_stated
from gonio.verification.checks.outcome import Detail, Outcome

Values = npt.NDArray[np.float64]
DECIMALS = 1  # of a degree, to which angles that were read back are those of the exchanged direction
COSINES = (1.0, 2.0)  # powers of cos(theta_i)/cos(theta_r) by which pairs differ: a cosine is missing, or is swapped
NEAR = 0.25  # of these
WORST = 3  # pairs that are listed
REMEDY = "look for drift between the two readings, a spot larger than the field of view, and a tilted sample"
FILL = (
    "the pairs differ as the cosines of theta_i and theta_r do: the statement of what the detector sees (--fill under "
    "or over) is the wrong one"
)


def reciprocity(scan: xr.Dataset) -> Outcome:
    """The root mean square of ln f(i, r)/f(r, i) over the pairs of a scan, and what uncertainties make of it.

    Causes that shift both values of a pair by one factor cancel. Values that are not above zero take no part. Raises
    ValueError where the scan holds no pair.
    """
    flat = dataset.points(scan)
    names = [name for name in dataset.DIRECTIONS if name in flat.coords]
    rounded = {n: (flat[n].dims, np.round(flat[n].values.astype(float), DECIMALS)) for n in names}
    rows, others = exchange.pairs(flat.assign_coords(rounded))
    brdf = flat["brdf"].values
    good = (brdf[rows] > 0) & (brdf[others] > 0)
    rows, others = rows[good], others[good]
    if not len(rows):
        raise ValueError(
            "the scan holds no pair of exchanged directions: measure theta_r at the theta_i of other curves, such as "
            "30/50 and 50/30"
        )
    ratio = np.log(brdf[rows] / brdf[others])
    spread = _spread(flat, rows, others)
    cosines = _cosines(flat, rows)
    exponent = float(ratio @ cosines / (cosines @ cosines)) if cosines.any() else 0.0
    explained = np.sqrt(np.mean((ratio - exponent * cosines) ** 2)) < 0.5 * np.sqrt(np.mean(ratio**2))
    by_cosine = bool(explained) and any(abs(abs(exponent) - power) < NEAR for power in COSINES)
    worst = np.argsort(-np.abs(ratio), kind="stable")[:WORST]
    return Outcome(
        float(np.sqrt(np.mean(ratio**2))),
        float(np.sqrt(np.mean(spread**2))),
        len(rows),
        "rms of ln f(i, r)/f(r, i)",
        FILL if by_cosine else REMEDY,
        details=tuple(Detail(_place(flat, rows[k]), float(ratio[k]), float(spread[k])) for k in worst.tolist()),
    )


def _spread(flat: xr.Dataset, rows: npt.NDArray[np.intp], others: npt.NDArray[np.intp]) -> Values:
    """The standard uncertainty of ln f(i, r)/f(r, i) of each pair; NaN where the scan states none."""
    brdf, parts = flat["brdf"].values, []
    if "uncertainty" in flat:
        random = flat["uncertainty"].values / brdf
        random = np.where(is_stated(flat["uncertainty"].values), random, np.nan)
        parts += [random[rows], random[others]]
    for shifts in causes(flat).values():
        relative = shifts / brdf
        parts.append(relative[rows] - relative[others])
    return total(parts) if parts else np.full(len(rows), np.nan)


def _cosines(flat: xr.Dataset, rows: npt.NDArray[np.intp]) -> Values:
    theta_i, theta_r = (np.radians(flat[n].values[rows].astype(float)) for n in ("theta_i", "theta_r"))
    found: Values = np.log(np.cos(theta_i) / np.cos(theta_r))
    return found


def _place(flat: xr.Dataset, row: int) -> str:
    theta_i, theta_r, phi = (float(flat[name].values[row]) for name in dataset.ANGLES)
    return f"theta_i {theta_i:.4g}, theta_r {theta_r:.4g}, phi {phi:.4g} deg and its exchange"
