"""The values of a fit one by one: each with its set, unit, uncertainty, interval within its bounds, and status."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from gonio.fitting.solution import Solution
from gonio.results.numbers import LEVEL

if TYPE_CHECKING:
    from pandas import DataFrame

FITTED, AT_BOUND, NOT_DETERMINED, HELD = "fitted", "at its bound", "not determined", "held"


@dataclass(frozen=True)
class Value:
    """One value of a fit.

    by, group: the coordinates that it is grouped by and its label, as `theta_i` and `30`; empty for a single value.
    uncertainty: standard, of random errors. low, high: the 95 % interval, with the systematic uncertainty that the scan
    states, within the bounds of the fit; NaN for a held value.
    """

    parameter: str
    by: str
    group: str
    value: float
    unit: str
    uncertainty: float
    low: float
    high: float
    status: str

    @property
    def set(self) -> str:
        """The group in words: `theta_i=30, channel=R`."""
        if not self.by:
            return ""
        names = self.by.split(",")
        labels = self.group.split(",", len(names) - 1)  # the last may hold commas of its own
        return ", ".join(f"{name}={label}" for name, label in zip(names, labels, strict=True))


def values(solution: Solution) -> Iterator[Value]:
    """Every value of a fit, weights first, in the order of its Dataset."""
    stored, halves = solution.dataset, solution.half_widths(LEVEL)
    columns = [stored[n].values.tolist() for n in ("name", "by", "group", "unit", "value", "uncertainty", "held")]
    pinned = stored["at_bound"].values.tolist()
    for k, (name, by, group, unit, value, spread, held) in enumerate(zip(*columns, strict=True)):
        lower, upper = _bounds(solution, k)
        low, high = (math.nan, math.nan) if held else _cut(value, float(halves[k]), lower, upper)
        status = HELD if held else AT_BOUND if pinned[k] else FITTED if math.isfinite(spread) else NOT_DETERMINED
        yield Value(name, by, group, value, unit, spread, low, high, status)


def _cut(value: float, half: float, lower: float, upper: float) -> tuple[float, float]:
    """The interval value ± half within the bounds; the bounds themselves where nothing narrower is known."""
    if not math.isfinite(half):
        return lower, upper
    return max(value - half, lower), min(value + half, upper)


def _bounds(solution: Solution, k: int) -> tuple[float, float]:
    """The bounds of the fit of value k; those that the model declares for a lane of many, which holds none."""
    stored = solution.dataset
    if "lower" in stored and "upper" in stored:
        return float(stored["lower"].values[k]), float(stored["upper"].values[k])
    name, value = str(stored["name"].values[k]), float(stored["value"].values[k])
    if name not in solution.model.shape:
        return min(0.0, value), math.inf
    declared = solution.model.shape[name]
    return float(np.fmin(declared.lower, value)), float(np.fmax(declared.upper, value))


def dataframe(solution: Solution) -> "DataFrame":
    """The values as a pandas DataFrame, as `Solution.to_dataframe` says."""
    try:
        import pandas as pd
    except ImportError as error:
        raise ImportError("to_dataframe needs pandas: pip install pandas, or use solution.parameters()") from error
    rows = [(v.parameter, v.set, v.value, v.unit, v.uncertainty, v.low, v.high, v.status) for v in values(solution)]
    columns = ["parameter", "set", "value", "unit", "standard uncertainty", "low", "high", "status"]
    return pd.DataFrame(rows, columns=columns)
