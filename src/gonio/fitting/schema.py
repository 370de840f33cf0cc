"""What a Solution holds: its variables and attributes, declared once, and the one function that puts them together.

Most variables have the dimension `parameter`, with one place for each value of the model, held ones too: `ks`, or
`ks[30]` where `ks` has one value for each group. A solver knows the free values alone, in a vector of weights and then
shape. `Parameters` puts such vectors, and matrices over them, into their places among all values.

The same declarations serve `fit`, `fit_many` and the reader of files (`stored`), so that what one writes the others
accept. A new attribute is one more line in ATTRIBUTES; a file that lacks it is then refused.

A fit of one scan holds the points that it was fitted to as well, so that residuals, metrics and figures need no other
file: variables along `direction` whose names begin with `scan_`. More than MOST_KEPT points are not kept, nor are those
of the lanes of `fit_many`.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from importlib.metadata import version
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.netcdf import CONTENT
from gonio.fitting.objective.problem import Problem
from gonio.measured import dataset
from gonio.measured.causes import CAUSE, WHOLE, total
from gonio.measured.instrument import IDEAL

Values = npt.NDArray[Any]

SOLUTION = "gonio solution"  # the value of the attribute `content`, by which a file is known to hold a solution
PARAMETER, PAIR, BY_CAUSE = ("parameter",), ("parameter", "parameter_b"), (CAUSE, "parameter")
SCAN = "scan_"  # begins the names of what is known of the points that were fitted
MOST_KEPT = 2**17  # points that a solution holds: some megabytes; a ranking of the whole catalogue holds them 49 times
PROBLEM = "problem"  # beside the attributes: the problem itself, from which `assembled` takes bounds and points


@dataclass(frozen=True)
class Variable:
    """One variable: its dimensions, the kind of its dtype (f number, b true or false, U text), and what it is.

    optional: whether a solution may lack it.
    """

    dims: tuple[str, ...]
    kind: str
    help: str
    optional: bool = False


VARIABLES: Mapping[str, Variable] = {
    "value": Variable(PARAMETER, "f", "the value, NaN where a lane had no point that depends on it"),
    "uncertainty": Variable(PARAMETER, "f", "standard; NaN for held values, infinite for values not determined"),
    "uncertainty_systematic": Variable(
        PARAMETER, "f", "root of the sum of squares of the shifts by all causes, NaN where the scan states none"
    ),
    "systematic_shift": Variable(PARAMETER, "f", "the same with its sign where there is one cause; NaN for several"),
    "shift_by_cause": Variable(BY_CAUSE, "f", "shift by each cause, with its sign: all values shift together"),
    "at_bound": Variable(PARAMETER, "b", "whether the value is at its bound"),
    "held": Variable(PARAMETER, "b", "whether the value was given and not fitted"),
    "lower": Variable(PARAMETER, "f", "the least value that the fit allowed", optional=True),
    "upper": Variable(PARAMETER, "f", "the largest value that the fit allowed", optional=True),
    "covariance": Variable(PAIR, "f", "of random errors; NaN for held values"),
    "history": Variable(("step", "chain"), "f", "best E after each step, with the penalty of smooth parameters"),
    "bootstrap": Variable(("parameter", "draw"), "f", "values of fits to resampled scans", optional=True),
}
# Beside these, coordinates of the points by their names after SCAN: angles, sets, and what parameters are grouped by.
OF_POINTS: Mapping[str, Variable] = {
    f"{SCAN}brdf": Variable(("direction",), "f", "the measured values that were fitted"),
    f"{SCAN}weight": Variable(("direction",), "f", "their weights g in eq 11"),
    f"{SCAN}uncertainty": Variable(("direction",), "f", "the standard uncertainty that the scan states", optional=True),
}
COORDINATES: Mapping[str, Variable] = {
    "parameter": Variable(PARAMETER, "U", "the name of the value, with its group in brackets"),
    "name": Variable(PARAMETER, "U", "the parameter of the model"),
    "by": Variable(PARAMETER, "U", "the coordinates that group it, separated by commas; empty without groups"),
    "group": Variable(PARAMETER, "U", "the label of the value's group"),
    "unit": Variable(PARAMETER, "U", "the unit of the value"),
}  # Beside these, the names of the causes of systematic uncertainty along CAUSE: one, WHOLE, where the scan names none.

# Every attribute with its type and its default; None for those that have no default and must be given.
ATTRIBUTES: Mapping[str, tuple[type, Any]] = {
    "model": (str, None),
    "cite": (str, None),
    "solver": (str, None),
    "settings": (str, ""),  # repr of the solver
    "status": (str, None),
    "cost": (float, None),  # E, eq 11, of the data alone
    "seconds": (float, math.nan),  # NaN for a lane from a store of results, which holds those of many calls
    "evaluations": (int, None),  # of the model; for a lane of many, steps of its search
    "weighting": (str, None),
    "weighting_reason": (str, ""),  # why the data ask for it; empty where it was named
    "noise_floor": (float, 0.0),
    "loss": (str, "squared"),
    "loss_scale": (float, math.nan),  # scatter of the weighted residuals; NaN for squared errors
    "points": (int, None),
    "points_searched": (int, None),  # on which starts were searched: all, or a sample of very many
    "searches": (int, 0),  # that were followed to a minimum; 0 where a solver follows none, or only one
    "searches_alike": (int, 0),  # of them that ended at the lowest minimum, to NEARLY of E
    "next_minimum": (float, math.nan),  # E of the next one over that of the lowest
    "points_discounted": (int, 0),  # which count for less than half under the loss
    "effective_values": (float, None),  # number of free values, or less where smoothing ties them together
    "smooth": (str, ""),  # name=coordinate:strength:scale, separated by spaces
    "unit": (str, None),  # of the data
    "covariance": (str, None),  # its kind
    "instrument_error": (float, 0.0),  # change of the residual by a finer rule for the cones, over the residual
    "precision": (str, "float64"),
    "device": (str, ""),
    "data_history": (str, ""),
    "versions": (str, ""),
    "answer": (str, ""),  # of `gonio.fit(scan)`, as JSON: weighting, validation, verdict and the models tried
    **{f"instrument_{name}": (float, value) for name, value in asdict(IDEAL).items()},
}


@dataclass(frozen=True)
class Parameters:
    """Where the free values of a problem belong among all n values along `parameter`.

    coords: name, group and unit of every value, as COORDINATES declares them. free (n,): which values are free.
    held (n,): what the others are held at, NaN for free ones.
    """

    coords: Mapping[str, list[str]]
    free: npt.NDArray[np.bool_]
    held: Values

    @classmethod
    def of(cls, problem: Problem) -> "Parameters":
        """Those of a problem, in the order of its entries: weights first, then shape, as in a solver's vector."""
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
        """All values (.., n), held ones included, from the free ones (.., n_free)."""
        values = self.spread(free, np.nan)
        values[..., ~self.free] = self.held[~self.free]
        return values

    def spread(self, free: Values, fill: Any, axes: int = 1) -> Values:
        """An array over the free values as one over all values: the last `axes` axes (n_free) become (n).

        free: a vector (.., n_free), or with axes=2 a matrix (.., n_free, n_free) such as a covariance. `fill` is put in
        the places of held values. The dtype stays that of `free`.
        """
        places = np.flatnonzero(self.free)
        spread = np.full((*free.shape[: free.ndim - axes], *(len(self.free),) * axes), fill, dtype=free.dtype)
        index: Any = (Ellipsis, *np.ix_(*(places,) * axes))  # ix_: all pairs of rows and columns, not their diagonal
        spread[index] = free
        return spread


def problem_attributes(problem: Problem) -> dict[str, Any]:
    """The attributes of the fit of one scan that follow from its problem, with the problem itself under PROBLEM.

    Of the problem `assembled` keeps the bounds and the points. Its functions g1 and g2 are in no Solution.
    """
    return {**shared_attributes(problem), PROBLEM: problem}


def shared_attributes(problem: Problem) -> dict[str, Any]:
    """The attributes that follow from a problem, the same for a fit of one scan and for each lane of many."""
    return {
        "model": problem.model.name,
        "cite": problem.model.cite,
        "weighting": problem.weighting,
        "weighting_reason": problem.weighting_reason,
        "noise_floor": problem.noise_floor,
        "loss": problem.loss,
        "smooth": " ".join(f"{name}={one}" for name, one in problem.smoothed.items()),
        "unit": dataset.unit(problem.data),
        "data_history": problem.data.attrs.get("history", ""),
        "versions": versions("gonio", "numpy", "scipy"),
        **{f"instrument_{name}": value for name, value in asdict(problem.instrument).items()},
    }


def columns_of(problem: Problem) -> dict[str, Values]:
    """What a solution keeps of its problem: the bounds (n,) of every value, and columns of its points (points,)."""
    entries = [(entry, label) for entry in problem.entries for label in entry.labels]
    columns: dict[str, Values] = {
        "lower": np.array([entry.lower for entry, _ in entries], dtype=float),
        "upper": np.array([entry.upper for entry, _ in entries], dtype=float),
    }
    if problem.points.sizes["direction"] > MOST_KEPT:
        return columns
    return columns | points_columns(problem.points, problem.root_weights**2, {c for e, _ in entries for c in e.by})


def points_columns(points: xr.Dataset, weights: Values, grouping: Iterable[str] = ()) -> dict[str, Values]:
    """The columns of a flat scan that a solution keeps.

    grouping: the coordinates that parameters are grouped by, which are kept beside angles and sets.
    """
    columns = {f"{SCAN}brdf": points["brdf"].values.astype(float), f"{SCAN}weight": weights}
    if "uncertainty" in points:
        columns[f"{SCAN}uncertainty"] = points["uncertainty"].values.astype(float)
    for name in dict.fromkeys((*dataset.DIRECTIONS, *dataset.SETS, *sorted(grouping))):
        if name in points.coords:
            values = points[name].values
            columns[f"{SCAN}{name}"] = values.astype(float if values.dtype.kind in "fiu" else str)
    return columns


def versions(*packages: str) -> str:
    """The versions of packages in one line; PackageNotFoundError for one that is not installed."""
    return ", ".join(f"{name} {version(name)}" for name in packages)


def assembled(
    coords: Mapping[str, Any],
    columns: Mapping[str, Values],
    attributes: Mapping[str, Any],
) -> xr.Dataset:
    """The Dataset of a Solution with n values, complete: what is not given gets its default.

    coords: those of COORDINATES, as `Parameters.coords` has them, and CAUSE where there is a shift_by_cause.
    columns: value, at_bound, held (n,); history (steps, chains); covariance (n, n) and shift_by_cause (causes, n),
    which may be absent and are NaN then. The uncertainties are made from these two: a standard uncertainty is the
    square root of a variance, on the diagonal of the covariance.
    attributes: by name; each is converted to its type in ATTRIBUTES. PROBLEM among them brings `columns_of` it.
    Raises KeyError for a variable or an attribute that is not declared, and for an attribute that has no default and is
    absent.
    """
    variables = dict(columns)
    size = len(variables["value"])
    variables.setdefault("covariance", np.full((size, size), np.nan))
    shift = variables.setdefault("shift_by_cause", np.full((1, size), np.nan))
    variables["systematic_shift"] = shift[0] if len(shift) == 1 else np.full(size, np.nan)
    with np.errstate(invalid="ignore"):
        variables.setdefault("uncertainty", np.sqrt(np.diag(variables["covariance"])))
    variables["uncertainty_systematic"] = total(shift)
    if unknown := variables.keys() - VARIABLES.keys() | attributes.keys() - {*ATTRIBUTES, PROBLEM}:
        raise KeyError(f"a solution has no {', '.join(sorted(unknown))}")
    attrs: dict[str, Any] = {CONTENT: SOLUTION}
    for name, (kind, default) in ATTRIBUTES.items():
        value = attributes.get(name, default)
        if value is None:
            raise KeyError(f"a solution needs the attribute {name}")
        attrs[name] = kind(value)
    named = {CAUSE: [WHOLE], **coords}
    kept = columns_of(attributes[PROBLEM]) if PROBLEM in attributes else {}
    variables |= {name: kept.pop(name) for name in ("lower", "upper") if name in kept}
    return xr.Dataset(
        {name: (VARIABLES[name].dims, variables[name]) for name in VARIABLES if name in variables}
        | {name: (("direction",), column) for name, column in kept.items()},
        coords={name: ((CAUSE,) if name == CAUSE else COORDINATES[name].dims, v) for name, v in named.items()},
        attrs=attrs,
    )
