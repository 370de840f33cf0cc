"""Further checks of a set-up: reciprocity, energy, linearity, zero of the angles, repeats and darks.

CHECKS declares each once: a new one is one more entry. Each gives an `Outcome`: a number that is zero (or at most one)
for a perfect set-up, its standard uncertainty, and what to do where the number is too large.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import xarray as xr

from gonio.verification.checks.energy import energy
from gonio.verification.checks.linearity import linearity
from gonio.verification.checks.outcome import Outcome
from gonio.verification.checks.reciprocity import reciprocity
from gonio.verification.checks.steady import dark, repeat
from gonio.verification.checks.zero import zero

__all__ = [
    "CHECKS",
    "READINGS",
    "SCAN",
    "Check",
    "Outcome",
    "dark",
    "energy",
    "linearity",
    "reciprocity",
    "repeat",
    "zero",
]

SCAN, READINGS = "a scan", "raw readings"  # what a check takes


class Check(NamedTuple):
    """One check. takes: SCAN, READINGS or both. run: raises ValueError, with the remedy, where nothing can be said."""

    help: str
    takes: tuple[str, ...]
    run: Callable[[xr.Dataset], Outcome]


CHECKS: Mapping[str, Check] = {
    "reciprocity": Check("pairs of directions with source and detector exchanged", (SCAN,), reciprocity),
    "energy": Check("reflectance of a standard, at most 1", (SCAN,), energy),
    "linearity": Check("flux addition: readings behind the filters A, B and A+B", (READINGS,), linearity),
    "zero": Check("zero of the angles, by the peaks of a mirror at three theta_i", (SCAN, READINGS), zero),
    "repeat": Check("repeated readings of the check direction", (READINGS,), repeat),
    "dark": Check("repeated darks", (READINGS,), dark),
}
