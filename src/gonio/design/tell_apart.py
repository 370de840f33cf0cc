"""Readings that tell the model of a fit from rival models, beside those of its scan."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.design.candidates import coarse
from gonio.design.known import Known
from gonio.design.noise import Noise
from gonio.design.rivals import Rival, Telling, told_apart
from gonio.design.travel import in_order
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.objective.problem import Problem
from gonio.fitting.solution import Solution
from gonio.model import Model

Values = npt.NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Apart:
    """Readings that tell models apart, and the noncentrality of the test of fit of the rival hardest to tell apart.

    directions: in the order of measuring, a flat scan without values. now, after, uniform: noncentralities of the
    readings so far, with these, and with as many on a uniform grid instead, if the model of the fit is the true one.
    """

    directions: xr.Dataset
    rivals: tuple[str, ...]
    now: float
    after: float
    uniform: float
    noise: Noise


def tell_apart(
    solution: Solution,
    rivals: Sequence[Model],
    directions: xr.Dataset,
    points: int,
    *,
    noise: Noise | None = None,
    repeats: bool = False,
) -> Apart:
    """The readings among directions that tell the model of a fit from the rival that is hardest to tell from it.

    solution: a fit that holds its scan, taken as the truth. directions: as `candidates.reachable` gives them. noise: of
    the readings; as the scan states it, or as the residuals show, unless given. repeats: whether one direction may be
    chosen more than once. Rivals have values grouped and held as the fit has them, where they have parameters of these
    names. Raises ValueError as `Known.of` does, and for more points than directions without repeats.
    """
    known = Known.of(solution)
    noise = noise or known.noise()
    scan = solution.scan
    if points > directions.sizes["direction"] and not repeats:
        raise ValueError(
            f"{points} readings are asked for and {directions.sizes['direction']} directions are there to choose from: "
            "ask for fewer, take a finer step, or allow repeats"
        )
    both = _together(scan, directions)
    truth = known.brdf(both)
    both = both.assign(brdf=("direction", truth, directions["brdf"].attrs))
    made = [
        Rival.of(Problem(model, both, **_options(solution, model)), truth, noise.deviation(truth)) for model in rivals
    ]
    many = len(scan["brdf"])
    once = np.concatenate([np.ones(many), np.zeros(directions.sizes["direction"])])
    grid = once.copy()
    grid[many + coarse(directions, points)] = 1.0
    found = told_apart(made, points, once, repeats=repeats, allowed=np.arange(many, len(once)))
    chosen = directions.isel(direction=found.places - many)
    return Apart(
        chosen.isel(direction=in_order(chosen)),
        tuple(model.name for model in rivals),
        _of(made, once).noncentrality,
        found.noncentrality,
        _of(made, grid).noncentrality,
        noise,
    )


def _together(scan: xr.Dataset, directions: xr.Dataset) -> xr.Dataset:
    """The directions of a fit's points, then those to choose from, as one flat scan.

    What is one for all directions, such as a wavelength, the points of a fit need not repeat.
    """
    names = [str(name) for name in directions.coords]
    first = directions.isel(direction=[0] * scan.sizes["direction"])
    old = first.assign_coords({n: ("direction", scan[n].values) for n in names if n in scan.coords})
    return xr.concat([old, directions], "direction")


def _of(rivals: Sequence[Rival], counts: Values) -> Telling:
    return told_apart(rivals, 0, counts)


def _options(solution: Solution, model: Model) -> dict[str, Any]:
    """Grouped and held values of a fit, by the names that the model has too, and the instrument of the fit."""
    stored = solution.dataset
    grouped: dict[str, tuple[str, ...]] = {}
    held: dict[str, float] = {}
    rows = zip(*(stored[n].values.tolist() for n in ("name", "by", "held", "value")), strict=True)
    for name, by, is_held, value in rows:
        if name in model.parameters and by:
            grouped[name] = tuple(by.split(","))
        elif name in model.parameters and is_held:
            held[name] = value
    options = ProblemOptions(weighting="uniform", grouped=grouped, held=held, instrument=solution.instrument)
    return options.given()
