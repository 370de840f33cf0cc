"""A fit as a page needs it: values in groups, their covariance, and which group each curve belongs to."""

import math
from typing import Any

import numpy as np

from gonio.fitting.solution import Solution
from gonio.results.content import content
from gonio.viewing.columns import Columns


def record(solution: Solution, columns: Columns) -> dict[str, Any]:
    """The fit, for the cells of a scan; ValueError where these belong to no group of the fit.

    `parameters` has for each parameter of the model its groups and, for each cell, the place of its group; `places` is
    where the values of a parameter begin in `covariance`, of which rows and columns are 0 for values that were held.
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
        "covariance": [[_finite(v) or 0.0 for v in row] for row in solution.total_covariance],
        "coverage": float(solution.coverage_factor()),
        "cost": solution.cost,
        "status": str(solution.status),
        "weighting": str(data.attrs["weighting"]),
        "cones": bool(solution.instrument),
        "facts": list(said.facts),
        "notes": list(said.notes),
    }


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
