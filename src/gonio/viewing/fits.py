"""A fit as a page needs it: values in groups, their covariance, and which group each curve belongs to."""

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from gonio.fitting.objective.weighting import WEIGHTINGS
from gonio.fitting.quantiles import normal
from gonio.fitting.solution import Solution
from gonio.resampling.difference import FLOOR
from gonio.results.content import content
from gonio.viewing.columns import Columns


def record(solution: Solution, columns: Columns) -> dict[str, Any]:
    """The fit, for the cells of a scan; ValueError where these belong to no group of the fit.

    `parameters` has for each parameter of the model its groups and, for each cell, the place of its group; `start` is
    where the values of a parameter begin in `expanded`. With J the derivative of a curve by all values, half the width
    of its 95 % band is the root of J M J', M being `expanded`: 0 for values that were held, and for those that the data
    do not determine. `weight` is what each row counts for in E, where that is not as the columns have it.
    """
    data, model = solution.dataset, solution.model
    places = solution.places(columns.points)
    values, names = data["value"].values, data["name"].values
    unknown = np.full(len(values), math.nan)
    lower, upper = (data[n].values if n in data else unknown for n in ("lower", "upper"))
    parameters = []
    for name in model.parameters:
        rows = np.flatnonzero(names == name)
        place = places[name]
        cells = np.broadcast_to(np.asarray(place), columns.points.sizes["direction"])[columns.first] - rows[0]
        parameters.append(
            {
                "name": name,
                "start": int(rows[0]),
                "labels": data["group"].values[rows].tolist(),
                "by": str(data["by"].values[rows[0]]),
                "values": values[rows].tolist(),
                "uncertainty": [_finite(u) for u in data["uncertainty"].values[rows]],
                "determined": (~np.isinf(data["uncertainty"].values[rows])).tolist(),
                "lower": [_finite(v) for v in lower[rows]],
                "upper": [_finite(v) for v in upper[rows]],
                "held": bool(data["held"].values[rows[0]]),
                "at_bound": data["at_bound"].values[rows].astype(bool).tolist(),
                "unit": str(data["unit"].values[rows[0]]),
                "cells": cells.astype(int).tolist(),
            }
        )
    said = content(solution)
    return {
        "model": model.name,
        "parameters": parameters,
        "expanded": _expanded(solution).tolist(),
        "cost": solution.cost,
        "status": str(solution.status),
        **_weighed(solution, columns),
        "cones": bool(solution.instrument),
        "facts": list(said.facts),
        "notes": list(said.notes),
    }


def _expanded(solution: Solution) -> npt.NDArray[np.float64]:
    """k^2 C + z^2 sum_c p_c p_c' over all values, as `Solution.expanded` adds random and systematic uncertainties."""
    covariance, shifts = (
        np.where(np.isfinite(part), part, 0.0)
        for part in (solution.dataset[n].values for n in ("covariance", "shift_by_cause"))
    )
    expanded: npt.NDArray[np.float64] = (
        solution.coverage_factor() ** 2 * covariance + normal(0.975) ** 2 * shifts.T @ shifts
    )
    return expanded


def _weighed(solution: Solution, columns: Columns) -> dict[str, Any]:
    """What each row counts for in the E of the fit, and below which value a logarithm says nothing."""
    attrs, data = solution.dataset.attrs, solution.dataset
    name, noise_floor = str(attrs["weighting"]), float(attrs["noise_floor"])
    try:
        weight = WEIGHTINGS[name].weights(columns.points, noise_floor)
    except ValueError:  # a fit of another scan, whose weighting these values do not allow
        return {}
    if solution.has_scan and data.sizes["direction"] == columns.header["total"]:  # its own: g1, g2 and a loss count too
        own = data["scan_weight"].values[columns.rows]
        weight = (
            own if np.array_equal(data["scan_brdf"].values[columns.rows], columns.points["brdf"].values) else weight
        )
    floor = float(np.fmax(columns.least, FLOOR * noise_floor))
    same = np.array_equal(weight, columns.columns["weight"])
    found = {"weighting": name, "logarithmic": WEIGHTINGS[name].logarithmic, "floor": _finite(floor)}
    return found if same else found | {"weight": weight.tolist()}


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
