"""What is handed on: a model with its values, and what is known of them."""

import hashlib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.arrays import Array
from gonio.completion import Corrected
from gonio.door.binary import sha256
from gonio.fitting.solution import Solution, labels_of, some
from gonio.geometry import Geometry
from gonio.measured.dataset import ABSOLUTE, SETS, make_scan
from gonio.model import Model
from gonio.units import weight_unit

Values = Mapping[str, float]
ONE = ""  # the label of a set that is the only one


@dataclass(frozen=True)
class Subject:
    """A model with its values, in one set or in several.

    Attributes
    ----------
    model : Model
        What was fitted, or chosen.
    sets : mapping
        Every value of the model by name, for each set: a channel, a wavelength [nm], or the one set, whose label is
        ONE. Weights are in units of an absolute BRDF [1/sr].
    by : str
        What tells the sets apart: `channel`, `wavelength`, or nothing.
    uncertainties : mapping
        Standard uncertainties in the same form; NaN for values that were given or held.
    origin : str
        Where the values come from, in one line.
    facts : mapping
        What else a reader has to know, by what it is: data, weighting, SHA-256.
    wavelength : float or None
        Of the one set [nm], where it is known.
    theta_i : tuple
        The incidence angles [deg] at which it was measured, in order; empty for a model of no data.
    solution : Solution or None
        The fit that it is.
    corrected : callable or None
        The lg by which the BRDF lies above the model's (n,), at directions of a set. No formula has it: tables alone
        can be written.

    """

    model: Model
    sets: Mapping[str, Values]
    by: str = ""
    uncertainties: Mapping[str, Values] = field(default_factory=dict)
    origin: str = ""
    facts: Mapping[str, str] = field(default_factory=dict)
    wavelength: float | None = None
    theta_i: tuple[float, ...] = ()
    solution: Solution | None = None
    corrected: Callable[[Geometry, str], np.ndarray] | None = None

    @property
    def values(self) -> Values:
        """The values of the one set; ValueError, with the remedy, where there are several."""
        if len(self.sets) > 1:
            raise ValueError(
                f"the fit has {len(self.sets)} sets, one for each {self.by}, and this target takes one: "
                f"choose one by --select {self.by}=VALUE: {some(self.sets)}"
            )
        return next(iter(self.sets.values()))

    @property
    def label(self) -> str:
        """The label of the one set."""
        return next(iter(self.sets))

    def uncertainty(self, name: str, label: str | None = None) -> float:
        """The standard uncertainty of a value; NaN where there is none."""
        of_set = self.uncertainties.get(self.label if label is None else label, {})
        return float(of_set.get(name, math.nan))

    def unit(self, name: str) -> str:
        """The unit of a parameter, "1" for none."""
        if name in self.model.shape:
            return self.model.shape[name].unit
        return weight_unit(ABSOLUTE, self.model.term_unit(name))

    def brdf(self, geometry: Geometry, label: str | None = None) -> Array:
        """The BRDF [1/sr] of a set at pairs of directions, the one set where none is named."""
        modelled = self.model(geometry, self.values if label is None else self.sets[label])
        if self.corrected is None:
            return modelled
        return np.asarray(modelled) * 10 ** self.corrected(geometry, self.label if label is None else label)

    def one(self, label: str) -> "Subject":
        """One of the sets."""
        told = f"{self.by} {label}"
        nm = float(label) if self.by == "wavelength" else self.wavelength
        return replace(
            self,
            sets={label: self.sets[label]},
            uncertainties={label: self.uncertainties.get(label, {})},
            origin=f"{self.origin}, {told}",
            wavelength=nm,
        )


def of_model(model: Model, values: Values, *, scale: float | None = None, unit: str = ABSOLUTE, **told: Any) -> Subject:
    """A model with values; shape parameters left out take their defaults, and weights are 0.

    scale: 1/sr for a unit of relative weights. told: what else the Subject holds.
    Raises ValueError for a name that the model does not have, for no weight, a value outside its bounds, and relative
    values without a scale.
    """
    known = dict.fromkeys(model.weights, 0.0) | {name: p.default for name, p in model.shape.items()}
    if unknown := [name for name in values if name not in known]:
        raise ValueError(f"{model.name} has no parameter {unknown[0]!r}; it has {', '.join(known)}")
    for name, parameter in model.shape.items():
        if name in values and not parameter.lower <= values[name] <= parameter.upper:
            beyond = f"outside its bounds {parameter.lower:g} to {parameter.upper:g}"
            raise ValueError(f"{name} is {values[name]:g}, {beyond}: `gonio models {model.name}` has them")
    complete = known | {name: float(value) for name, value in values.items()}
    if not any(complete[w] for w in model.weights):
        example = f"--set {model.weights[0]}=0.5"
        raise ValueError(f"{model.name} reflects nothing: give at least one weight, as in {example}")
    factor = _scale(unit, scale, model.name)
    scaled = {name: value * (factor if name in model.weights else 1.0) for name, value in complete.items()}
    facts = {"scale": f"{factor:g} 1/sr for a unit of the values as they were given"} if unit != ABSOLUTE else {}
    told = {"origin": f"values of {model.name}, given by hand"} | told
    return Subject(model, {ONE: scaled}, facts=facts | told.pop("facts", {}), **told)


def of_solution(
    of: Solution | Corrected,
    *,
    scale: float | None = None,
    select: Mapping[str, str] | None = None,
    file: Path | None = None,
) -> Subject:
    """A fit, in all its sets or in those that are selected.

    A fit may be corrected by what a scan says beyond it.
    Raises ValueError for a set that it does not have, values that change with the incidence angle, two kinds of sets at
    once, and relative data without a scale.
    """
    corrected, solution = (of, of.solution) if isinstance(of, Corrected) else (None, of)
    name = file.name if file else "the fit"
    factor = _scale(solution.unit, scale, name)
    choice, by, labels = _sets(solution, select or {}, name)
    sets, uncertainties = {}, {}
    for label in labels:
        point = _point(choice | ({by: label} if by else {}))
        places = {n: int(np.ravel(p)[0]) for n, p in solution.places(point).items()}
        factors = {n: factor if n in solution.model.weights else 1.0 for n in places}
        sets[label] = {n: float(solution.dataset["value"].values[k]) * factors[n] for n, k in places.items()}
        halves = _standard(solution)
        uncertainties[label] = {n: float(halves[k]) * factors[n] for n, k in places.items()}
    facts = _facts(solution, file)
    if factor != 1.0 or solution.unit != ABSOLUTE:
        facts["scale"] = f"{factor:g} 1/sr for a unit of the fitted values"
    if corrected is not None:
        facts["correction"] = f"{corrected.words}: the values of the table are not those of the model alone"
    chosen = "".join(f", {k} {v}" for k, v in choice.items())
    return Subject(
        solution.model,
        sets,
        by,
        uncertainties,
        f"{solution.model.name} fitted to {solution.dataset.attrs['points']} points, {name}{chosen}",
        facts,
        float(choice["wavelength"]) if "wavelength" in choice else _wavelength(solution),
        _incidence(solution),
        solution,
        None if corrected is None else partial(_shift, corrected, choice, by),
    )


def _shift(corrected: Corrected, choice: Mapping[str, str], by: str, geometry: Geometry, label: str) -> np.ndarray:
    """The lg by which a corrected fit lies above its model, in the shape of the directions."""
    unit_vectors = np.broadcast_arrays(*geometry)
    x_i, y_i, z_i, x_r, y_r, z_r = (np.ravel(v).astype(float) for v in unit_vectors)
    theta_i, theta_r = np.degrees(np.arctan2(np.hypot(x_i, y_i), z_i)), np.degrees(np.arctan2(np.hypot(x_r, y_r), z_r))
    phi = np.degrees(np.arctan2(y_r, x_r) - np.arctan2(y_i, x_i)) % 360.0
    sets = {**choice, **({by: label} if by else {})}
    columns = {n: np.full(len(phi), float(v) if n == "wavelength" else v) for n, v in sets.items() if n in SETS}
    points = make_scan(theta_i, theta_r, np.zeros(len(phi)), phi, coordinates=columns)
    return corrected.learned.shift(points).reshape(unit_vectors[0].shape)


def _scale(unit: str, scale: float | None, name: str) -> float:
    if unit == ABSOLUTE:
        if scale is not None:
            raise ValueError(f"{name}: is in 1/sr, which no --scale may change: leave it out")
        return 1.0
    if scale is None:
        raise ValueError(
            f"{name}: is relative ({unit}), and other programs take 1/sr: give --scale VALUE, the 1/sr of one unit"
        )
    if not (math.isfinite(scale) and scale > 0):
        raise ValueError(f"--scale is {scale:g}: give a positive number, the 1/sr of one unit")
    return scale


def _sets(solution: Solution, select: Mapping[str, str], name: str) -> tuple[dict[str, str], str, list[str]]:
    """What is chosen of each kind of set, the one kind that is left, and its labels."""
    known = labels_of(solution)
    if unknown := [k for k in select if k not in known]:
        raise ValueError(f"{name}: has no {unknown[0]} to select; it has {', '.join(known) or 'one set alone'}")
    choice = dict(select)
    for coordinate, labels in known.items():
        if coordinate in choice and choice[coordinate] not in labels:
            raise ValueError(f"{name}: no {coordinate} is {choice[coordinate]}; it has {some(labels)}")
        if coordinate not in choice and len(labels) == 1:
            choice[coordinate] = labels[0]
    left = [coordinate for coordinate in known if coordinate not in choice]
    if "theta_i" in left:
        raise ValueError(
            f"{name}: has one value for each incidence angle, and a model has one for all: fit one value for all, "
            f"or choose one angle by --select theta_i={known['theta_i'][0]}"
        )
    if len(left) > 1 or (left and left[0] not in SETS):
        raise ValueError(f"{name}: has a set for each {' and '.join(left)}: choose one by --select {left[0]}=VALUE")
    return choice, left[0] if left else "", known[left[0]] if left else [ONE]


def _point(choice: Mapping[str, str]) -> xr.Dataset:
    """A direction of a set, by which a fit finds its values."""
    sets = {n: np.array([float(v) if n == "wavelength" else v]) for n, v in choice.items() if n != "theta_i"}
    return make_scan(np.array([float(choice.get("theta_i", 0.0))]), np.zeros(1), np.zeros(1), coordinates=sets)


def _standard(solution: Solution) -> np.ndarray:
    """Standard uncertainties (n,) by random errors and every cause, NaN for held values."""
    systematic = np.nan_to_num(solution.dataset["uncertainty_systematic"].values, nan=0.0)
    return np.hypot(solution.dataset["uncertainty"].values, systematic)


def _wavelength(solution: Solution) -> float | None:
    if not solution.has_scan or "wavelength" not in solution.scan.coords:
        return None
    found = np.unique(solution.scan["wavelength"].values)
    return float(found[0]) if len(found) == 1 else None


def _incidence(solution: Solution) -> tuple[float, ...]:
    return tuple(np.unique(np.round(solution.scan["theta_i"].values, 6)).tolist()) if solution.has_scan else ()


def _facts(solution: Solution, file: Path | None) -> dict[str, str]:
    attrs = solution.dataset.attrs
    facts = {"fit": f"{attrs['status']}; {attrs['weighting']} weighting"}
    if solution.has_scan:
        facts["SHA-256 of the fitted points"] = points_digest(solution.scan)
    if file is not None and (digest := sha256(file)):
        facts[f"SHA-256 of {file.name}"] = digest
    if history := str(attrs["data_history"]):
        facts["data"] = "; ".join(history.splitlines())
    return facts


def points_digest(points: xr.Dataset, names: Sequence[str] = ("theta_i", "theta_r", "phi", "brdf")) -> str:
    """The SHA-256 of points: angles [deg] and values, 64-bit numbers, low byte first, one column after another."""
    digest = hashlib.sha256()
    for name in names:
        digest.update(np.ascontiguousarray(points[name].values, dtype="<f8").tobytes())
    return digest.hexdigest()
