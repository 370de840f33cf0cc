"""Many fits of one problem: a stand-in that takes one lane after the other."""

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from gonio.fit.fitting import fit
from gonio.fit.problem import Problem
from gonio.fit.solution import Status
from gonio.fit.solver import Progress, silent

MEANINGS = (*(s.name.lower() for s in Status), "no_points")


def fit_many(
    problem: Problem,
    stack: xr.Dataset,
    *,
    starts: int = 2,
    covariance: str = "robust",
    precision: str = "float64",
    device: str = "",
    progress: Progress = silent,
) -> xr.Dataset:
    """Fit `problem` to every lane of a stack."""
    lanes = tuple(str(d) for d in stack["brdf"].dims if d not in problem.data["brdf"].dims)
    shape = tuple(stack.sizes[d] for d in lanes)
    entries = [(entry, label) for entry in problem.entries for label in entry.labels]
    names = [name for entry in problem.entries for name in entry.names]
    n = len(names)
    out: dict[str, Any] = {k: np.full((*shape, n), np.nan) for k in ("value", "uncertainty")}
    out["at_bound"] = np.zeros((*shape, n), dtype=bool)
    if covariance:
        out["covariance"] = np.full((*shape, n, n), np.nan)
    cost = np.full(shape, np.nan)
    status = np.full(shape, len(MEANINGS) - 1, dtype=np.int8)
    steps, points = np.zeros(shape, dtype=np.int32), np.zeros(shape, dtype=np.int32)
    for at in itertools.product(*map(range, shape)):
        scan = stack.isel(dict(zip(lanes, at, strict=True))).drop_vars(lanes, errors="ignore").load()
        try:
            solution = fit(replace(problem, data=scan), covariance=covariance or "robust")
        except ValueError:
            continue
        for name in [k for k in out if k in solution.dataset]:
            out[name][at] = solution.dataset[name].values
        cost[at], status[at] = solution.cost, MEANINGS.index(solution.status.name.lower())
        steps[at], points[at] = solution.dataset.attrs["evaluations"], solution.dataset.attrs["points"]
    flags = {"flag_values": list(range(len(MEANINGS))), "flag_meanings": " ".join(MEANINGS)}
    text = {
        "name": [entry.name for entry, _ in entries],
        "by": [",".join(entry.by) for entry, _ in entries],
        "group": [label for _, label in entries],
        "unit": [entry.unit for entry, _ in entries],
    }
    tail = ("parameter", "parameter_b")
    return xr.Dataset(
        {k: ((*lanes, *tail[: v.ndim - len(shape)]), v) for k, v in out.items()}
        | {
            "cost": (lanes, cost),
            "status": (lanes, status, flags),
            "converged": (lanes, status == 0),
            "steps": (lanes, steps),
            "points": (lanes, points),
            "held": ("parameter", [entry.held is not None for entry, _ in entries]),
        },
        coords={"parameter": names}
        | {key: ("parameter", column) for key, column in text.items()}
        | {k: v for k, v in stack.coords.items() if v.dims and set(v.dims) <= set(lanes)},
        attrs={
            "model": problem.model.name,
            "cite": problem.model.cite,
            "solver": "stand-in",
            "weighting": problem.weighting,
            "noise_floor": problem.noise_floor,
            "covariance": covariance,
            "unit": problem.data["brdf"].attrs["units"],
            "precision": precision,
            "versions": "",
        },
    )
