"""A material that comes nearest to a model: shared roughness, a base colour for each channel, and what that costs."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gonio.exporting.stand_in import FAINTEST, INCIDENCES, REPORTED, grid, reflectance
from gonio.exporting.subject import ONE, Subject
from gonio.fitting.fitting import fit
from gonio.fitting.objective.problem import Problem
from gonio.fitting.search.projection import Projection
from gonio.geometry import Geometry
from gonio.measured.dataset import make_scan
from gonio.model import Model

RGB = ("R", "G", "B")
SEARCH = Projection(searches=4, line=9, rounds=1)
WHITE = 1.0  # the largest base colour that materials have

Values = Mapping[str, float]


@dataclass(frozen=True)
class Material:
    """A fitted material.

    Attributes
    ----------
    shape : mapping
        Metallic, roughness and what else the channels share.
    colour : tuple
        Base colour for R, G and B, linear.
    numbers : mapping
        Root mean square difference of the decimal logarithms, the relative error where the exported model is largest,
        and errors of the directional reflectance, over all channels the worst.
    remarks : tuple
        What a user has to know.

    """

    shape: Values
    colour: tuple[float, float, float]
    numbers: Values
    remarks: tuple[str, ...]


def material(subject: Subject, model: Model, title: str) -> Material:
    """The values of a material for a subject in one set, which is grey, or in the channels R, G and B.

    Raises ValueError for other sets, with the remedy.
    """
    labels = _labels(subject, title)
    angles = grid(subject.theta_i or INCIDENCES)
    geometry = Geometry.from_degrees(*angles)
    count = len(angles[0])
    true = {k: np.broadcast_to(np.asarray(subject.brdf(geometry, k), dtype=float), count) for k in labels}
    top = max(float(v.max()) for v in true.values())
    if not top > 0:
        raise ValueError(f"{subject.model.name} reflects nothing at these values: give a weight above 0")
    base, shape = _diffuse(true, model) or _fitted(true, angles, model, top)
    numbers = _numbers(subject, model, {k: {**shape, "base": base[k], "one": 1.0} for k in labels}, true, geometry)
    colour = tuple(base[k] for k in RGB) if len(labels) == len(RGB) else (base[labels[0]],) * 3
    return Material(shape, colour, numbers, tuple(_remarks(subject, model, base, title)))  # type: ignore[arg-type]


def _labels(subject: Subject, title: str) -> list[str]:
    labels = list(subject.sets)
    if len(labels) == 1:
        return labels
    if sorted(labels) == sorted(RGB):
        return list(RGB)
    raise ValueError(
        f"a material of {title} has one colour in R, G and B, and the fit has a set for each {subject.by}: choose one "
        f"by --select {subject.by}={labels[0]}, which is grey"
    )


def _diffuse(true: Mapping[str, np.ndarray], model: Model) -> tuple[dict[str, float], dict[str, float]] | None:
    """An ideal diffuse surface as a material that reflects nothing else, where the material can be one."""
    if any(np.ptp(v) > 1e-12 * v.max() for v in true.values()):
        return None
    still = {"metallic": 0.0, "roughness": 1.0} | {n: 0.0 for n in ("specular",) if n in model.shape}
    still |= {n: 1.0 for n in ("ior",) if n in model.shape}
    base = {k: math.pi * float(v.mean()) for k, v in true.items()}
    return None if max(base.values()) > WHITE else (base, still)


def _fitted(
    true: Mapping[str, np.ndarray], angles: tuple[np.ndarray, np.ndarray, np.ndarray], model: Model, top: float
) -> tuple[dict[str, float], dict[str, float]]:
    """The base colour of every channel and the shape that they share, by the logarithms of the values."""
    seen = {k: v > FAINTEST * top for k, v in true.items()}
    columns = [np.concatenate([a[seen[k]] for k in true]) for a in angles]
    values = np.concatenate([v[seen[k]] for k, v in true.items()])
    channel = np.concatenate([np.full(int(seen[k].sum()), k or ONE or "grey") for k in true])
    scan = make_scan(columns[0], columns[1], values, columns[2], coordinates={"channel": channel})
    problem = Problem(model, scan, weighting="log", held={"one": 1.0}, bounds={"base": (0.0, WHITE)})
    solution = fit(problem, SEARCH)
    found = {k: solution.values.get(f"base[{k or 'grey'}]", solution.values.get("base", math.nan)) for k in true}
    return {k: float(v) for k, v in found.items()}, {n: float(solution.values[n]) for n in model.shape}


def _numbers(
    subject: Subject, model: Model, values: Mapping[str, Values], true: Mapping[str, np.ndarray], geometry: Geometry
) -> dict[str, float]:
    """How far the material is from the model, the worst of the channels."""
    worst: dict[str, float] = {}
    for label, own in values.items():
        near, right = np.asarray(model(geometry, own), dtype=float), true[label]
        seen, top = right > FAINTEST * right.max(), int(np.argmax(right))
        found = {
            "log10_rmse": float(np.sqrt(np.mean(np.log10(near[seen] / right[seen]) ** 2))),
            "peak_error": float(near[top] / right[top] - 1),
        }
        for angle in REPORTED:
            expected = reflectance(subject.model, subject.sets[label], angle)
            found[f"reflectance_error_{angle:.0f}"] = reflectance(model, own, angle) / expected - 1
        worst |= {name: max(worst.get(name, 0.0), value, key=abs) for name, value in found.items()}
    return worst


def _remarks(subject: Subject, model: Model, base: Values, title: str) -> list[str]:
    said = [
        f"{title} knows no {subject.model.name}: the material is the nearest one, fitted on a grid with logarithmic "
        "weighting; the numbers above say how near"
    ]
    if len(base) == 1:
        said.append("one set of values makes a grey material: colours need the channels R, G and B")
    else:
        said.append("the channels R, G and B are taken as linear Rec.709 colours, as they are")
    if clipped := [k or "the base colour" for k, v in base.items() if v > WHITE - 1e-4]:
        said.append(f"{', '.join(clipped)} ends at 1, the largest that there is")
    if model.violates and not subject.model.violates:
        said.append(f"{title} violates " + "; ".join(f"{law}: {why}" for law, why in model.violates.items()))
    return said
