"""The units that files, parameters and axes may name: one table, one place of conversion."""

import math
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Unit:
    """One unit: what it measures, its size in the unit that gonio uses for that quantity, and how figures write it."""

    quantity: str
    size: float
    label: str


UNITS = {
    "deg": Unit("angle", 1.0, "deg"),
    "rad": Unit("angle", 180.0 / math.pi, "rad"),
    "nm": Unit("length", 1.0, "nm"),
    "um": Unit("length", 1e3, "µm"),
    "sr-1": Unit("brdf", 1.0, "sr⁻¹"),
    "a.u.": Unit("relative", 1.0, "a.u."),
    "dolp": Unit("degree of polarisation", 1.0, ""),
}

# CF-style strings of the Dataset, and the suffix that a column of a text file carries for each.
CF_STRINGS = {"angle": "degree", "length": "nm", "brdf": "sr-1", "relative": "a.u.", "degree of polarisation": "1"}


def to_radians(degrees: Any) -> Any:
    """The one place where degrees become radians; works on any array."""
    return degrees * (math.pi / 180.0)


def to_degrees(radians: Any) -> Any:
    """Radians to degrees, on any array."""
    return radians * (180.0 / math.pi)


def unit_label(unit: str) -> str:
    """How a figure or a table writes `unit`; the text itself where the table has no entry."""
    if unit in UNITS:
        return UNITS[unit].label
    return {"1": "", "degree": "deg", "deg sr-1": "deg sr⁻¹"}.get(unit, unit)


def weight_unit(data: str, term: str) -> str:
    """Unit of a weight: the data's unit over the term's. Relative data and ratios leave every weight relative."""
    if data in ("a.u.", "1"):
        return "a.u."
    return {"sr-1": "1", "1": "sr-1", "deg-1": "deg sr-1"}[term]
