"""The laws of physics for a fit: positivity, reciprocity and energy of each of its sets, where its values are known."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np
import numpy.typing as npt

from gonio.fitting.solution import Solution, labels_of
from gonio.geometry import Geometry
from gonio.measured import dataset
from gonio.plausibility import Verdict, energy, positivity, reciprocity

Values = npt.NDArray[np.float64]


def of_fit(solution: Solution) -> dict[str, list[Verdict]]:
    """The verdicts by the set of a fit in words, as `channel R`; one without words is all of it.

    A fit is known at the incidence angles that its groups name, for each channel or wavelength of its own.
    Raises ValueError for a fit whose groups are of other coordinates, of which a direction has no value.
    """
    labels = labels_of(solution)
    if strange := sorted(set(labels) - {"theta_i", *dataset.SETS}):
        raise ValueError(f"has one value for each {strange[0]!r}: a check knows groups of theta_i and of sets alone")
    angles = sorted(map(float, labels["theta_i"])) if "theta_i" in labels else None
    combinations: list[dict[str, Any]] = [{}]
    for coordinate in (c for c in dataset.SETS if c in labels):
        combinations = [one | {coordinate: label} for one in combinations for label in sorted(labels[coordinate])]
    return {
        ", ".join(f"{k} {v}" for k, v in one.items()): laws(partial(fitted, solution, one), solution.unit, angles)
        for one in combinations
    }


def fitted(solution: Solution, one: Mapping[str, str], geometry: Geometry) -> Values:
    """The fit of one set at any directions, without its instrument: a value that is grouped by theta_i is looked up."""
    theta_i = np.round(np.ravel(geometry.theta_i_deg), 6)
    zeros = np.zeros(theta_i.shape)
    labels = {name: np.full(theta_i.shape, label) for name, label in one.items()}
    if "wavelength" in labels:
        labels["wavelength"] = labels["wavelength"].astype(float)
    points = dataset.make_scan(theta_i, zeros, zeros, zeros, coordinates=labels)
    shape = np.shape(geometry.theta_i_deg)
    values = {k: np.reshape(v, shape) if np.ndim(v) else v for k, v in solution.at(points).items()}
    return np.asarray(solution.model(geometry, values))


def laws(brdf: Callable[[Geometry], Any], unit: str, theta_i: list[float] | None = None) -> list[Verdict]:
    """The three verdicts on a function of directions; without a unit it is no BRDF, and its energy is unknown."""
    if unit:
        last = energy(brdf, unit, theta_i)
    else:
        last = Verdict("energy", None, {}, "", "the term is not normalised: its weight is no reflectance")
    return [positivity(brdf, theta_i), reciprocity(brdf, theta_i), last]
