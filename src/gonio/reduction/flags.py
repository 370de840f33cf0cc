"""Readings that are no measurement of the sample: each gets a flag and a reason, and stays in the scan.

A flagged value has a number in the scan's mask, by which fits leave it out. A negative one is flagged and not masked:
about zero, noise goes to both sides, and to leave out one side would move the mean.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from gonio.measured.dataset import MASK_MEANINGS

Values = npt.NDArray[np.float64]
Rows = npt.NDArray[np.intp]
NEAR_LARGEST = 0.01  # of the largest signal, within which a reading may be cut off
STEADY = 0.2  # of the median relative scatter: a reading that scatters by less than that has lost its noise
NEAR_SOURCE = 20.0  # deg from the source, within which its arm may shade the detector, or the detector's arm the beam
FALLS_TO = 0.8  # of what the two directions before let expect: below, a reading is shaded
SURE = 5.0  # standard deviations by which it must lie below


@dataclass(frozen=True)
class Flag:
    """One flag: its name, the row of the reading it is of, and the reason."""

    name: str
    row: int
    reason: str

    @property
    def code(self) -> int:
        """Its number in the mask; 0 for a flag that masks nothing."""
        return MASK_MEANINGS.index(self.name) if self.name in MASK_MEANINGS else 0


def saturated(signal: Values, sd: Values, overload: npt.NDArray[np.bool_]) -> Iterator[Flag]:
    """Readings (n,) that the detector cut off: it says so, or they lie at the top and have lost their scatter."""
    for row in np.flatnonzero(overload).tolist():
        yield Flag("saturated", row, "the detector said that it was overloaded")
    size = np.abs(signal)
    with np.errstate(divide="ignore", invalid="ignore"):
        scatter = sd / size
    known = np.isfinite(scatter) & (scatter > 0)
    if known.sum() < 3:
        return
    usual = float(np.median(scatter[known]))
    top = size >= (1 - NEAR_LARGEST) * size.max()
    for row in np.flatnonzero(top & known & (scatter < STEADY * usual) & ~overload).tolist():
        yield Flag(
            "saturated",
            row,
            f"{size[row]:g} is within 1 % of the largest signal and scatters by {100 * scatter[row]:.2g} %, "
            f"others by {100 * usual:.2g} %",
        )


def negative(net: Values) -> Iterator[Flag]:
    """Readings (n,) whose signal without dark and background is below zero."""
    for row in np.flatnonzero(net < 0).tolist():
        yield Flag("negative", row, f"the net signal is {net[row]:.4g}, below zero")


def shaded(theta_i: Values, signed: Values, brdf: Values, uncertainty: Values) -> Iterator[Flag]:
    """In-plane readings (n,) next to the source that fall off where nothing but an arm in the way makes them.

    signed: theta_r [deg]. The reading nearest to the source on each side of it is compared with the line, of the
    logarithm, through the next two; with a value below zero there, where these are above.
    """
    unknown = ~np.isfinite(uncertainty)
    for angle in np.unique(np.round(theta_i, 3)).tolist():
        for side in (-1.0, 1.0):
            offset = (signed + theta_i) * side
            rows = np.flatnonzero((np.abs(theta_i - angle) < 1e-3) & (offset > 1e-9))
            rows = rows[np.argsort(offset[rows], kind="stable")]
            rows = rows[np.unique(np.round(offset[rows], 3), return_index=True)[1]]
            if len(rows) < 3 or offset[rows[0]] > NEAR_SOURCE:
                continue
            first, second, third = rows[:3].tolist()
            if not min(brdf[second], brdf[third]) > 0:
                continue
            slope = np.log(brdf[second] / brdf[third]) / (offset[third] - offset[second])
            expected = brdf[second] * np.exp(slope * (offset[second] - offset[first]))
            spread = (
                0.0 if unknown[first] or unknown[second] else float(np.hypot(uncertainty[first], uncertainty[second]))
            )
            if brdf[first] < FALLS_TO * expected and expected - brdf[first] > SURE * spread:
                yield Flag(
                    "shaded",
                    first,
                    f"{100 * (1 - brdf[first] / expected):.0f} % below what the next directions let expect, "
                    f"{offset[first]:.3g} deg from the source",
                )


def record(flag: Flag, line: int, angles: dict[str, float]) -> dict[str, Any]:
    """A flag as plain data, with the line and the direction of its reading."""
    return {"flag": flag.name, "line": line, **angles, "masked": flag.code > 0, "reason": flag.reason}
