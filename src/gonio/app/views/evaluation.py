"""A model with its values, and what it is worth at given directions: BRDF, Mueller matrix, polarised light."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gonio.app import output
from gonio.geometry import Geometry
from gonio.model import Model
from gonio.models.publications import Published
from gonio.models.publications import published as surfaces
from gonio.polarisation import angle_of_linear_polarisation, degree_of_linear_polarisation, reflected
from gonio.units import unit_label

Place = tuple[float, float, float]


@dataclass(frozen=True)
class EvaluatedModel:
    """A model, values given by hand, and a paper's constants where they were asked for."""

    model: Model
    given: Mapping[str, float]
    published: Published | None

    @property
    def unit(self) -> str:
        return self.published.unit if self.published else "sr-1"

    def values(self, theta_i: float) -> dict[str, float]:
        """Values at an incidence angle [deg]; what was given by hand comes before what the paper printed."""
        return {**(self.published.at(theta_i) if self.published else {}), **self.given}


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


def evaluate(
    surface: EvaluatedModel, places: Sequence[Place], stokes: Sequence[float] | None = None
) -> list[dict[str, Any]]:
    """One record a place: the value; for a polarised model its Mueller matrix; with `stokes` the light that leaves."""
    return [_evaluate(surface, place, stokes) for place in places]


def _evaluate(surface: EvaluatedModel, place: Place, stokes: Sequence[float] | None) -> dict[str, Any]:
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


def record(surface: EvaluatedModel, places: Sequence[Place], records: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """The evaluation as plain data."""
    text = "1/sr" if surface.unit == "sr-1" else surface.unit
    out = {"model": surface.model.name, "at": places, "values": [r["value"] for r in records], "unit": text}
    for name in ("mueller", "stokes", "dolp", "aolp_deg"):
        if records and name in records[0]:
            out[name] = [r[name] for r in records]
    return out


def table(surface: EvaluatedModel, places: Sequence[Place], records: Sequence[Mapping[str, Any]]) -> Any:
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
