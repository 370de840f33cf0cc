"""A model with its values, and what it is worth at given directions: BRDF, Mueller matrix, polarised light."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Union

import numpy as np

from gonio.app import output
from gonio.fitting.solution import Solution, labels_of, some
from gonio.geometry import Geometry
from gonio.measured import dataset
from gonio.model import Model
from gonio.models.publications import Published
from gonio.models.publications import published as surfaces
from gonio.polarisation import angle_of_linear_polarisation, degree_of_linear_polarisation, reflected
from gonio.units import unit_label

Place = tuple[float, float, float]
Surface = Union["EvaluatedModel", "EvaluatedFit"]


@dataclass(frozen=True)
class EvaluatedModel:
    """A model, values given by hand, and a paper's constants where they were asked for."""

    model: Model
    given: Mapping[str, float]
    published: Published | None

    @property
    def unit(self) -> str:
        return self.published.unit if self.published else "sr-1"

    @property
    def title(self) -> str:
        """What a figure of it is called."""
        return self.published.title if self.published else self.model.title

    def values(self, theta_i: float) -> dict[str, float]:
        """Values at an incidence angle [deg]; what was given by hand comes before what the paper printed."""
        return {**(self.published.at(theta_i) if self.published else {}), **self.given}


@dataclass(frozen=True)
class EvaluatedFit:
    """A fit, and the set of directions that it is asked for: a channel, a wavelength, a sample.

    Its values are those of the surface itself, without the instrument that was folded into the fit.
    """

    file: Path
    solution: Solution
    choice: Mapping[str, str]

    @classmethod
    def of(cls, file: Path, solution: Solution, choice: Mapping[str, str]) -> "EvaluatedFit":
        """ValueError where the fit has several sets and none is chosen, or one that it does not have."""
        known = labels_of(solution)
        sets = {name: labels for name, labels in known.items() if name != "theta_i"}
        if strange := [name for name in sets if name not in dataset.SETS]:
            raise ValueError(f"{file}: has one value for each {strange[0]!r}, of which a direction has none")
        if unknown := [name for name in choice if name not in sets]:
            have = ", ".join(sets) or "one set alone"
            raise ValueError(f"{file}: the fit has no {unknown[0]} to select; it has {have}")
        chosen = {}
        for name, labels in sets.items():
            wanted = choice.get(name, labels[0] if len(labels) == 1 else "")
            if wanted not in labels:
                what = f"no {name} is {wanted}" if wanted else f"holds {len(labels)} sets"
                raise ValueError(f"{file}: {what}; choose one by --select {name}=VALUE: {some(labels)}")
            chosen[name] = wanted
        return cls(file, solution, chosen)

    @property
    def model(self) -> Model:
        """The model that was fitted."""
        return self.solution.model

    @property
    def published(self) -> None:
        """A fit is of no paper."""

    @property
    def unit(self) -> str:
        """The unit of the data; a fit of degrees of polarisation knows the BRDF but for a factor."""
        return dataset.RELATIVE if self.solution.unit == dataset.DEGREE else self.solution.unit

    @property
    def title(self) -> str:
        """What a figure of it is called."""
        return ", ".join([f"{self.model.name} fitted, {self.file.name}", *(f"{k} {v}" for k, v in self.choice.items())])

    def values(self, theta_i: float) -> dict[str, float]:
        """Values at an incidence angle [deg]; ValueError for one of no group of the fit."""
        sets = {n: np.array([float(v) if n == "wavelength" else v]) for n, v in self.choice.items()}
        direction = dataset.make_scan([theta_i], [0.0], [0.0], coordinates=sets)
        try:
            return {name: float(np.ravel(value)[0]) for name, value in self.solution.at(direction).items()}
        except ValueError as error:
            raise ValueError(f"{self.file}: {error}") from error


def surface(model: Model, given: Mapping[str, float], published: str) -> EvaluatedModel:
    """Raises ValueError for published constants of another model, and for a shape value outside its bounds."""
    chosen = surfaces[published] if published else None
    if chosen and chosen.model != model.name:
        raise ValueError(f"the constants of {published} belong to {chosen.model}, not to {model.name}")
    for name, parameter in model.shape.items():
        if name in given and not parameter.lower <= given[name] <= parameter.upper:
            beyond = f"outside its bounds {parameter.lower:g} to {parameter.upper:g}"
            raise ValueError(f"{name} is {given[name]:g}, {beyond}: `gonio models {model.name}` has them")
    return EvaluatedModel(model, given, chosen)


def evaluate(surface: Surface, places: Sequence[Place], stokes: Sequence[float] | None = None) -> list[dict[str, Any]]:
    """One record a place: the value; for a polarised model its Mueller matrix; with `stokes` the light that leaves."""
    return [_evaluate(surface, place, stokes) for place in places]


def _evaluate(surface: Surface, place: Place, stokes: Sequence[float] | None) -> dict[str, Any]:
    geometry, values = Geometry.from_degrees(*place), surface.values(place[0])
    found: dict[str, Any] = {"value": float(surface.model(geometry, values))}
    if surface.model.polarised or stokes is not None:
        matrix = np.asarray(surface.model.mueller(geometry, values))
        found["mueller"] = matrix.tolist()
        if stokes is not None:
            light = reflected(matrix, stokes)
            found["stokes"] = light.tolist()
            found["dolp"] = float(degree_of_linear_polarisation(light))
            found["aolp_deg"] = float(angle_of_linear_polarisation(light))
    return found


def record(surface: Surface, places: Sequence[Place], records: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The evaluation as plain data."""
    text = "1/sr" if surface.unit == "sr-1" else surface.unit
    out = {"model": surface.model.name, "at": places, "values": [r["value"] for r in records], "unit": text}
    for name in ("mueller", "stokes", "dolp", "aolp_deg"):
        if records and name in records[0]:
            out[name] = [r[name] for r in records]
    return out


def table(surface: Surface, places: Sequence[Place], records: Sequence[Mapping[str, Any]]) -> Any:
    """The evaluation for people."""
    angles = ("theta_i [deg]", "theta_r [deg]", "phi [deg]")
    unit = unit_label(surface.unit)
    if records and "stokes" in records[0]:
        out = output.table("theta_i", "theta_r", "phi", *"IQUV", "DoLP", "AoLP", left=0)
        out.caption, out.caption_justify = f"Stokes parameters in {unit}; angles in deg", "left"
        for place, found in zip(places, records, strict=True):
            light = (f"{value:.4g}" for value in found["stokes"])
            out.add_row(*(f"{a:g}" for a in place), *light, f"{found['dolp']:.4f}", f"{found['aolp_deg']:.2f}")
        return out
    out = output.table(*angles, f"BRDF [{unit}]", left=0)
    for place, found in zip(places, records, strict=True):
        out.add_row(*(f"{angle:g}" for angle in place), f"{found['value']:.6g}")
    return out
