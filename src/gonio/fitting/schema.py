"""What a Solution holds: its variables and attributes, declared once, and the one function that puts them together.

All variables stand along `parameter`, which has one place for each value of the model, held ones too: `ks`, or `ks[30]`
where `ks` has one value a group. A fit finds the free ones alone; `Parameters` knows where they belong.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import version
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.netcdf import CONTENT
from gonio.fitting.objective.problem import Problem
from gonio.measured import dataset
from gonio.measured.instrument import IDEAL

Values = npt.NDArray[Any]

SOLUTION = "gonio solution"  # what the file of a solution says that it holds
PARAMETER, PAIR = ("parameter",), ("parameter", "parameter_b")


@dataclass(frozen=True)
class Variable:
    """One variable: its dimensions, the kind of its dtype (f number, b truth, U text), and what it is."""

    dims: tuple[str, ...]
    kind: str
    help: str
    optional: bool = False


VARIABLES: Mapping[str, Variable] = {
    "value": Variable(PARAMETER, "f", "the value, NaN where a lane had no point that says anything of it"),
    "uncertainty": Variable(PARAMETER, "f", "standard; NaN for held values, infinite for undetermined ones"),
    "uncertainty_systematic": Variable(
        PARAMETER, "f", "what the systematic part of the scan's own does to the value, NaN where the scan states none"
    ),
    "systematic_shift": Variable(PARAMETER, "f", "the same with its sign, because all values shift together"),
    "at_bound": Variable(PARAMETER, "b", "whether the value is at its bound"),
    "held": Variable(PARAMETER, "b", "whether the value was given and not fitted"),
    "covariance": Variable(PAIR, "f", "of random errors; NaN for held values"),
    "history": Variable(("step", "chain"), "f", "best E after each step, with what holds values smooth"),
    "bootstrap": Variable(("parameter", "draw"), "f", "values of fits to resampled scans", optional=True),
}
COORDINATES: Mapping[str, Variable] = {
    "parameter": Variable(PARAMETER, "U", "the name of the value, with its group in brackets"),
    "name": Variable(PARAMETER, "U", "the parameter of the model"),
    "by": Variable(PARAMETER, "U", "the coordinates that tell its groups apart, with commas"),
    "group": Variable(PARAMETER, "U", "the label of the value's group"),
    "unit": Variable(PARAMETER, "U", "the unit of the value"),
}

# Every attribute with its type and what it is where nothing is said; None for those that are always said.
ATTRIBUTES: Mapping[str, tuple[type, Any]] = {
    "model": (str, None),
    "cite": (str, None),
    "solver": (str, None),
    "settings": (str, ""),
    "status": (str, None),
    "cost": (float, None),  # E, eq 11, of the data alone
    "seconds": (float, math.nan),
    "evaluations": (int, None),
    "weighting": (str, None),
    "noise_floor": (float, 0.0),
    "loss": (str, "squared"),
    "loss_scale": (float, math.nan),  # scatter of the weighted residuals; NaN for squared errors
    "points": (int, None),
    "points_searched": (int, None),  # on which starts were searched: all, or a sample of very many
    "points_discounted": (int, 0),  # which the loss lets count for less than half
    "effective_values": (float, None),  # free values, or what smoothing leaves of them
    "smooth": (str, ""),
    "unit": (str, None),  # of the data
    "covariance": (str, None),  # its kind
    "instrument_error": (float, 0.0),  # change by a finer rule for the cones, over what the fit leaves over
    "precision": (str, "float64"),
    "device": (str, ""),
    "data_history": (str, ""),
    "versions": (str, ""),
    **{f"instrument_{name}": (float, value) for name, value in asdict(IDEAL).items()},
}


@dataclass(frozen=True)
class Parameters:
    """The values of a problem along `parameter`: which are free, what the others are held at, and their coordinates."""

    coords: Mapping[str, list[str]]
    free: npt.NDArray[np.bool_]
    held: Values

    @classmethod
    def of(cls, problem: Problem) -> "Parameters":
        """Those of a problem, in the order of its entries."""
        rows = [(entry, label) for entry in problem.entries for label in entry.labels]
        coords = {
            "parameter": [name for entry in problem.entries for name in entry.names],
            "name": [entry.name for entry, _ in rows],
            "by": [",".join(entry.by) for entry, _ in rows],
            "group": [label for _, label in rows],
            "unit": [entry.unit for entry, _ in rows],
        }
        held = np.array([v for entry in problem.entries for v in entry.held or [np.nan] * entry.size])
        return cls(coords, np.array([entry.held is None for entry, _ in rows]), held)

    def values(self, free: Values) -> Values:
        """All values (.., n), held ones included, of free ones (.., n_free)."""
        whole = self.spread(free, np.nan)
        whole[..., ~self.free] = self.held[~self.free]
        return whole

    def spread(self, free: Values, fill: Any, axes: int = 1) -> Values:
        """What is known of the free values, for all: the last `axes` axes (n_free) become (n), `fill` elsewhere."""
        places = np.flatnonzero(self.free)
        whole = np.full((*free.shape[: free.ndim - axes], *(len(self.free),) * axes), fill, dtype=free.dtype)
        index: Any = (Ellipsis, *np.ix_(*(places,) * axes))
        whole[index] = free
        return whole


def told_by(problem: Problem) -> dict[str, Any]:
    """The attributes that follow from the problem alone."""
    return {
        "model": problem.model.name,
        "cite": problem.model.cite,
        "weighting": problem.weighting,
        "noise_floor": problem.noise_floor,
        "loss": problem.loss,
        "smooth": " ".join(f"{name}={one}" for name, one in problem.smoothed.items()),
        "unit": dataset.unit(problem.data),
        "data_history": problem.data.attrs.get("history", ""),
        "versions": versions("gonio", "numpy", "scipy"),
        **{f"instrument_{name}": value for name, value in asdict(problem.instrument).items()},
    }


def versions(*packages: str) -> str:
    """The versions of packages in one line."""
    return ", ".join(f"{name} {version(name)}" for name in packages)


def assembled(
    coords: Mapping[str, Any],
    columns: Mapping[str, Values],
    attributes: Mapping[str, Any],
) -> xr.Dataset:
    """The Dataset of a Solution from what is known: every variable and attribute is there, and each of its type.

    columns: value, at_bound, held (n,); covariance (n, n), from which the uncertainties follow, NaN where it is left
    out; systematic_shift (n,), NaN where it is left out; history (steps, chains).
    Raises KeyError for an attribute that is not declared, or is needed and left out.
    """
    given = dict(columns)
    size = len(given["value"])
    given.setdefault("covariance", np.full((size, size), np.nan))
    shift = given.setdefault("systematic_shift", np.full(size, np.nan))
    with np.errstate(invalid="ignore"):
        given.setdefault("uncertainty", np.sqrt(np.diag(given["covariance"])))
    given["uncertainty_systematic"] = np.abs(shift)
    if unknown := given.keys() - VARIABLES.keys() | attributes.keys() - ATTRIBUTES.keys():
        raise KeyError(f"a solution has no {', '.join(sorted(unknown))}")
    attrs: dict[str, Any] = {CONTENT: SOLUTION}
    for name, (kind, default) in ATTRIBUTES.items():
        value = attributes.get(name, default)
        if value is None:
            raise KeyError(f"a solution needs the attribute {name}")
        attrs[name] = kind(value)
    return xr.Dataset(
        {name: (VARIABLES[name].dims, given[name]) for name in VARIABLES if name in given},
        coords={name: (COORDINATES[name].dims, values) for name, values in coords.items()},
        attrs=attrs,
    )
