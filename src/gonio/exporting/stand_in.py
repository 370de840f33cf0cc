"""A model that a program knows in place of one that it does not: fitted on a grid, with the error that this makes."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from gonio.exporting.subject import Subject
from gonio.fitting.fitting import fit
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.projection import Projection
from gonio.geometry import Geometry
from gonio.measured.dataset import make_scan
from gonio.model import Model
from gonio.plausibility import hemispherical_reflectance as quadrature
from gonio.sampling import hemispherical_reflectance

Array = npt.NDArray[np.float64]

REPORTED = (0.0, 45.0, 75.0)  # incidence [deg] at which reflectances are compared
INCIDENCES = (5.0, 30.0, 60.0)  # of the grid [deg], for a model of no data
NEAREST, FARTHEST, DISTANCES, TURNS = 1e-3, 1.9, 24, 8  # from the mirror direction in direction cosines, and around it
RINGS, AZIMUTHS = 8, 16  # of the directions all over the hemisphere, each for the same projected solid angle
AGREED, DRAWS = 2e-4, 100_000
SEARCH = Projection(searches=2, line=7, rounds=1)  # values without noise have few minima
FAINTEST = 1e-6  # of the largest value, below which values are left out: no instrument measures so far down


@dataclass(frozen=True)
class StandIn:
    """What stands in for each set of a model, whether it is the model itself, and numbers that say how good it is."""

    subject: Subject
    exact: bool
    numbers: Mapping[str, float]


def stand_in(subject: Subject, model: Model, level: Mapping[str, float]) -> StandIn:
    """Another model with values that come nearest to those of the subject, in every set.

    Parameters
    ----------
    subject : Subject
        What is exported.
    model : Model
        What the program knows. The subject is returned where it has this model.
    level : mapping
        Its values for a BRDF of 1/sr in every direction, whose first is the weight: an ideal diffuse surface is exact.

    Returns
    -------
    StandIn
        Numbers are the root mean square difference of the decimal logarithms on the grid, the relative error where the
        exported model is largest, and reflectances with their errors; the worst of the sets where there are several.

    """
    found = {label: _one(subject, label, model, level) for label in subject.sets}
    worst: dict[str, float] = {}
    for _, _, numbers in found.values():
        worst |= {name: max(worst.get(name, 0.0), value, key=abs) for name, value in numbers.items()}
    sets = {label: values for label, (values, _, _) in found.items()}
    exact = all(same for _, same, _ in found.values())
    if subject.model is model:
        return StandIn(subject, True, worst)
    how = "equal to" if exact else "fitted on a grid, with logarithmic weighting, to"
    origin = f"{model.name} {how} {subject.model.name} ({subject.origin})"
    violated = {f"{subject.model.name} violates {law}": why for law, why in subject.model.violates.items()}
    told = replace(subject, model=model, sets=sets, uncertainties={}, origin=origin, solution=None)
    return StandIn(replace(told, facts={**subject.facts, **violated}), exact, worst)


def reflectance(model: Model, values: Mapping[str, float], theta_i: float) -> float:
    """Directional-hemispherical reflectance at theta_i [deg], good to some parts in a thousand for lobes of any width.

    By quadrature, and for lobes that are too narrow for that by random directions.
    """
    coarse, fine = (quadrature(lambda g: np.asarray(model(g, values)), theta_i, n) for n in (100, 200))
    if abs(coarse - fine) <= AGREED * abs(fine):
        return fine
    return hemispherical_reflectance(model, values, theta_i, DRAWS).value


def grid(theta_i: Sequence[float]) -> tuple[Array, Array, Array]:
    """Angles theta_i, theta_r and phi [deg] (n,): about the mirror direction at all scales, and over the hemisphere."""
    turns = np.arange(TURNS) * 2 * math.pi / TURNS
    distance = np.concatenate([[0.0], np.geomspace(NEAREST, FARTHEST, DISTANCES)])
    rings = np.sqrt((np.arange(RINGS) + 0.5) / RINGS)
    around = (np.arange(AZIMUTHS) + 0.5) * 2 * math.pi / AZIMUTHS
    columns = []
    for angle in theta_i:
        near = distance[:, None] * np.exp(1j * turns) - math.sin(math.radians(angle))
        all_over = rings[:, None] * np.exp(1j * around)
        cosines = np.concatenate([near.ravel(), all_over.ravel()])
        cosines = np.unique(np.round(cosines[np.abs(cosines) < math.sin(math.radians(89.0))], 12))
        theta_r, phi = np.degrees(np.arcsin(np.abs(cosines))), np.degrees(np.angle(cosines)) % 360
        columns.append((np.full(len(cosines), angle), theta_r, phi))
    angles, theta_r, phi = (np.concatenate(c) for c in zip(*columns, strict=True))
    return angles, theta_r, phi


def _one(
    subject: Subject, label: str, model: Model, level: Mapping[str, float]
) -> tuple[dict[str, float], bool, dict[str, float]]:
    """Values of one set, whether they are exact, and the numbers."""
    if subject.model is model:
        values = dict(subject.sets[label])
        return values, True, {f"reflectance_{a:.0f}": reflectance(model, values, a) for a in REPORTED}
    angles = grid(subject.theta_i or INCIDENCES)
    geometry = Geometry.from_degrees(*angles)
    true = np.broadcast_to(np.asarray(subject.brdf(geometry, label), dtype=float), angles[0].shape)
    if not true.max() > 0:
        raise ValueError(f"{subject.model.name} reflects nothing at these values: give a weight above 0")
    exact = bool(np.ptp(true) <= 1e-12 * true.max())
    if exact:
        weight = next(iter(level))
        values = {**level, weight: level[weight] * float(true.mean())}
    else:
        values = _fitted(model, angles, true)
    near = np.asarray(model(geometry, values), dtype=float)
    seen = true > FAINTEST * true.max()
    top = int(np.argmax(true))
    numbers = {
        "log10_rmse": float(np.sqrt(np.mean(np.log10(near[seen] / true[seen]) ** 2))),
        "peak_error": float(near[top] / true[top] - 1),
    }
    for angle in REPORTED:
        expected = reflectance(subject.model, subject.sets[label], angle)
        numbers[f"reflectance_{angle:.0f}"] = found = reflectance(model, values, angle)
        numbers[f"reflectance_error_{angle:.0f}"] = found / expected - 1
    return values, exact, numbers


def _fitted(model: Model, angles: tuple[Array, Array, Array], true: Array) -> dict[str, float]:
    theta_i, theta_r, phi = angles
    seen = true > FAINTEST * true.max()
    scan = make_scan(theta_i[seen], theta_r[seen], true[seen], phi[seen])
    solution = fit(Problem(model, scan, weighting="log"), SEARCH)
    return {name: float(solution.values[name]) for name in model.parameters}
