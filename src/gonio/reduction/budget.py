"""The budget of a scan's uncertainty, as the Guide to the expression of uncertainty in measurement has it (JCGM 100).

Each cause has a type, a distribution, and its part of the relative standard uncertainty in every direction: sensitivity
times standard uncertainty, (1/f) (df/dx) u(x). The covariance of the values is

    U = diag(u_random^2) + sum over causes of s_c s_c',

so the combined uncertainty of a value is the root of the sum of squares, and the expanded one is k = 2 times that.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.measured.causes import causes, total
from gonio.measured.dataset import points
from gonio.reduction.causes import declared

Values = npt.NDArray[np.float64]
COVERAGE = 2.0  # k of the expanded uncertainty
RANDOM = "random"
MOST_CORRELATED = 100  # directions whose correlations are listed: more are a matrix for a program alone


class Row(NamedTuple):
    """One line of the budget: a cause with its parts, and its relative part in every direction (n,), in fractions.

    parts: their names in the scan, several where a cause has several, such as each dark. by_direction is signed where
    there is one part, and the root of the sum of squares of several. shape: over angles, in words.
    """

    cause: str
    parts: tuple[str, ...]
    help: str
    type: str
    distribution: str
    shape: str
    by_direction: Values

    @property
    def relative(self) -> float:
        """The relative standard uncertainty by this cause: root of the mean square over directions."""
        return float(np.sqrt(np.mean(np.square(self.by_direction)))) if len(self.by_direction) else 0.0


class Budget(NamedTuple):
    """The rows, random first, and the combined relative standard uncertainty of every direction (n,)."""

    rows: tuple[Row, ...]
    combined: Values
    scan: xr.Dataset

    @property
    def expanded(self) -> Values:
        """The relative expanded uncertainty (n,), k = 2."""
        return COVERAGE * self.combined

    def record(self) -> list[dict[str, Any]]:
        """The rows as plain data."""
        return [
            {
                "cause": row.cause,
                "parts": list(row.parts),
                "help": row.help,
                "type": row.type,
                "distribution": row.distribution,
                "relative": row.relative,
                "largest": float(np.abs(row.by_direction).max(initial=0.0)),
                "shape": row.shape,
                "by_direction": row.by_direction.tolist(),
            }
            for row in self.rows
        ]


def budget(scan: xr.Dataset) -> Budget:
    """The budget of the values of a scan that are in use, in their order. Values of zero have no relative part.

    Rows follow from what the scan states: `uncertainty`, and `systematic` by cause, whose names say what they are.
    """
    flat = points(scan)
    flat = flat.isel(direction=np.flatnonzero(flat["brdf"].values != 0))
    brdf = flat["brdf"].values
    rows = []
    if "uncertainty" in flat:
        relative = np.nan_to_num(flat["uncertainty"].values) / np.abs(brdf)
        rows.append(Row(RANDOM, (RANDOM,), "scatter of single readings", "A", "normal", "independent", relative))
    grouped: dict[str, list[tuple[str, Values]]] = {}
    for name, shifts in causes(flat).items():
        grouped.setdefault(declared(name).name, []).append((name, shifts / brdf))
    for cause, found in grouped.items():
        of = declared(found[0][0])
        by_direction = found[0][1] if len(found) == 1 else total([part for _, part in found])
        names = tuple(name for name, _ in found)
        rows.append(Row(cause, names, of.help, of.type, of.distribution, of.shape, by_direction))
    combined = total([row.by_direction for row in rows]) if rows else np.zeros(len(brdf))
    return Budget(tuple(rows), combined, flat)


def covariance(scan: xr.Dataset) -> Values:
    """The covariance (n, n) [1/sr^2] of the values of a scan that are in use: random and by every cause."""
    flat = points(scan)
    count = flat.sizes["direction"]
    random = np.nan_to_num(flat["uncertainty"].values) if "uncertainty" in flat else np.zeros(count)
    shifts = np.array([*causes(flat).values()]).reshape(-1, count)
    found: Values = np.diag(random**2) + shifts.T @ shifts
    return found


def correlation(scan: xr.Dataset) -> Values:
    """The correlations (n, n) between the errors of the values in use; 0 where a value states no uncertainty."""
    found = covariance(scan)
    spread = np.sqrt(np.diag(found))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.nan_to_num(found / np.outer(spread, spread)))
