"""A model and a scan become two functions of numbers alone, `design` and `residual`; a solver sees nothing else."""

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.objective.axes import Axes
from gonio.fitting.objective.blocks import Bulk, bulk
from gonio.fitting.objective.loss import LOSSES
from gonio.fitting.objective.smooth import Smooth, Smoothing, declared, penalty_rows
from gonio.fitting.objective.weighting import WEIGHTINGS
from gonio.fitting.solution import label
from gonio.geometry import Geometry
from gonio.measured import dataset
from gonio.measured.distinct import combined, distinct, first_of
from gonio.measured.instrument import IDEAL, Acceptance, Instrument
from gonio.measured.stack import foreign_dims
from gonio.model import Model
from gonio.units import UNITS, weight_unit

Values = npt.NDArray[np.float64]
Grouping = Mapping[str, str | tuple[str, ...]]
MANY = 200_000  # points in use from which a search takes them in blocks


@dataclass(frozen=True)
class Entry:
    """One parameter of a problem: a weight or a shape parameter, with one value or one a group of directions."""

    name: str
    is_weight: bool
    by: tuple[str, ...]
    labels: tuple[str, ...]
    group: npt.NDArray[np.intp]
    lower: float
    upper: float
    unit: str
    held: tuple[float, ...] | None = None

    @property
    def size(self) -> int:
        return len(self.labels)

    @property
    def names(self) -> tuple[str, ...]:
        """`ks`, or `ks[30]` where there is one value a group."""
        return tuple(f"{self.name}[{label}]" if label else self.name for label in self.labels)


@dataclass(frozen=True, eq=False)
class Problem:
    """Fit `model` to `data` by minimising the relative weighted squared error (guo2023, eq 11).

    held: parameters that keep a value given here; one that is grouped, a mapping from each group's label to its value.
        A model's `wavelength` is held at the scan's own, where that has it, unless it is held, grouped or bounded.
    grouped: parameters with one value for each value of one or more coordinates, `{"ks": "theta_i"}` (Table 1).
    shared: weights with one value over all channels, wavelengths or scans. The others have one value a set, because
        colour scales what a surface reflects; shape parameters are shared over sets unless grouped, because they
        describe the surface.
    weighting: a name of WEIGHTINGS. g1 and g2, functions of theta_i and of theta_r [deg], multiply it (eq 11).
    noise_floor: for relative weighting, the BRDF below which the noise is constant, while it is proportional above:
        the constant standard deviation over the relative one. Values of noise count for little, and none is dropped.
    loss: a name of LOSSES, what a large error costs.
    point_weights: of the points in use, on top of all other weights; a fit under a robust loss sets them.
    bounds: other bounds than the declared ones, by name; weights lie in 0..inf.
    smooth: parameters with one value for each value of a coordinate that vary smoothly along it, with the strength that
        holds them so: `{"sigma": ("wavelength", 1e-5)}`, or "auto"; `Smooth` says what is added to E.
    instrument: what source and detector take in, folded into every term; the values are those of the model without it.
    Raises ValueError for a name that the model does not have, for a scan without values, or for a weighting that the
    scan does not allow.
    """

    model: Model
    data: xr.Dataset
    held: Mapping[str, float | Mapping[str, float]] = field(default_factory=dict)
    grouped: Grouping = field(default_factory=dict)
    shared: tuple[str, ...] = ()
    weighting: str = "uniform"
    noise_floor: float = 0.0
    loss: str = "squared"
    point_weights: Values | None = None
    g1: Callable[[Values], Values] | None = None
    g2: Callable[[Values], Values] | None = None
    bounds: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    smooth: Smoothing = field(default_factory=dict)
    instrument: Instrument = IDEAL

    def __post_init__(self) -> None:
        named = {"held": self.held, "grouped": self.grouped, "shared": self.shared, "bounds": self.bounds}
        named["smooth"] = self.smooth
        for what, names in named.items():
            for name in names:
                if name not in self.model.parameters:
                    have = ", ".join(self.model.parameters)
                    raise ValueError(f"{what}: {self.model.name} has no parameter {name!r}; it has {have}")
        if self.weighting not in WEIGHTINGS:
            raise ValueError(f"no weighting {self.weighting!r}: choose one of {', '.join(WEIGHTINGS)}")
        if self.loss not in LOSSES:
            raise ValueError(f"no loss {self.loss!r}: choose one of {', '.join(LOSSES)}")
        if not 0 <= self.noise_floor < math.inf:
            raise ValueError(f"noise_floor is {self.noise_floor:g}: give a BRDF of zero or more")
        if self.noise_floor and not WEIGHTINGS[self.weighting].floored:
            raise ValueError(
                f"{self.weighting} weighting knows no noise floor: choose relative, or leave the floor out"
            )
        dataset.unit(self.data)
        if lanes := foreign_dims(self.data):
            along = ", ".join(lanes)
            raise ValueError(f"scans lie side by side along {along}: choose one, or fit each by fit_many (fit-stack)")
        if self.points.sizes["direction"] == 0:
            raise ValueError("the scan holds no value in use: every one is masked or missing")
        if "mode" in self.points.coords and (self.points["mode"].values == "transmission").any():
            raise ValueError("models are of reflection, and the scan holds transmission: add --select mode=reflection")
        if not self.measured.any():
            raise ValueError("every brdf value of the scan is zero: there is nothing to fit")
        if not self.free:
            raise ValueError("every parameter is held: nothing is left to fit")
        if self.point_weights is not None and np.shape(self.point_weights) != self.measured.shape:
            raise ValueError(f"point_weights needs one for each of the {len(self.measured)} points in use")
        _ = self.root_weights
        if self.instrument:
            _ = self.acceptance

    @functools.cached_property
    def smoothed(self) -> dict[str, Smooth]:
        """What is smooth, by name, each in full."""
        return declared(self.smooth, self.points, self.held, self.shared)

    @functools.cached_property
    def penalty(self) -> Values:
        """Rows (m, n) of the residual that hold a vector of values smooth, none where nothing is; they see no data."""
        rows: Values = penalty_rows(self.smoothed, self.free, self.points) * math.sqrt(self.scale)
        return rows

    @functools.cached_property
    def points(self) -> xr.Dataset:
        return dataset.points(self.data)

    @functools.cached_property
    def geometry(self) -> Geometry:
        return dataset.geometry(self.points)

    @functools.cached_property
    def acceptance(self) -> Acceptance:
        return Acceptance(self.instrument, self.geometry)

    @functools.cached_property
    def measured(self) -> Values:
        return np.asarray(self.points["brdf"].values, dtype=float)

    @property
    def logarithmic(self) -> bool:
        return WEIGHTINGS[self.weighting].logarithmic

    @functools.cached_property
    def root_weights(self) -> Values:
        """Square roots of the weights g1(theta_i) g2(theta_r) of eq 11."""
        weights = WEIGHTINGS[self.weighting].weights(self.points, self.noise_floor)
        for name, g in (("theta_i", self.g1), ("theta_r", self.g2)):
            if g is not None:
                weights = weights * np.asarray(g(self.points[name].values))
        if self.point_weights is not None:
            weights = weights * self.point_weights
        if not (np.isfinite(weights).all() and (weights >= 0).all() and weights.any()):
            raise ValueError("the weights g1, g2 and of points must be finite, non-negative and not all zero")
        root: Values = np.sqrt(weights)
        return root

    @functools.cached_property
    def target(self) -> Values:
        """What the residual subtracts: weighted measured values, or their logarithms."""
        values = np.log(self.measured) if self.logarithmic else self.measured
        return self.root_weights * values

    @functools.cached_property
    def scale(self) -> float:
        """The denominator of eq 11; for logarithms the number of values, since theirs have no zero to relate to."""
        return float(np.sum(self.root_weights**2) if self.logarithmic else np.sum(self.target**2))

    @functools.cached_property
    def entries(self) -> tuple[Entry, ...]:
        """Weights first, then shape parameters, in the model's order."""
        return tuple(self._entry(name, is_weight=name in self.model.weights) for name in self.model.parameters)

    def _entry(self, name: str, is_weight: bool) -> Entry:
        by = self.grouped.get(name, ())
        by = (by,) if isinstance(by, str) else tuple(by)
        if is_weight and name not in self.shared and name not in self.held:
            by += tuple(s for s in self.sets[0] if s not in by)
        if name in self.smoothed and self.smoothed[name].by not in by:
            by += (self.smoothed[name].by,)
        own = self._own_wavelength(name)
        by = ("wavelength",) if isinstance(own, Mapping) else by
        labels, group = self._groups(by)
        if is_weight:
            lower, upper = self.bounds.get(name, (0.0, math.inf))
            unit = weight_unit(dataset.unit(self.data), self.model.term_unit(name))
        else:
            parameter = self.model.shape[name]
            lower, upper = self.bounds.get(name, (parameter.lower, parameter.upper))
            unit = parameter.unit
        held = _held(name, self.held.get(name, own), by, labels)
        for value in held or ():
            if not is_weight and not lower <= value <= upper:
                raise ValueError(f"{name} is held at {value:g}, outside its bounds {lower:g} to {upper:g}")
        if not lower <= upper:
            raise ValueError(f"the bounds of {name} are the wrong way round: {lower:g} to {upper:g}")
        return Entry(name, is_weight, by, labels, group, lower, upper, unit, held)

    def _own_wavelength(self, name: str) -> float | dict[str, float] | None:
        """The scan's wavelength in the unit of the model's parameter, by label where there are several."""
        asked = any(name in names for names in (self.held, self.grouped, self.bounds, self.smooth))
        if name != "wavelength" or asked or name not in self.model.shape or name not in self.points.coords:
            return None
        size = UNITS[self.model.shape[name].unit].size
        own = {label(w): float(w) / size for w in np.unique(self.points[name].values)}
        return own if len(own) > 1 else next(iter(own.values()))

    def _groups(self, by: tuple[str, ...]) -> tuple[tuple[str, ...], npt.NDArray[np.intp]]:
        if not by:
            return ("",), np.zeros(len(self.measured), dtype=np.intp)
        for coordinate in by:
            if coordinate not in self.points.coords:
                have = ", ".join(str(c) for c in self.points.coords)
                raise ValueError(f"the scan has no coordinate {coordinate!r} to group by; it has {have}")
        if by in self._grouped:
            return self._grouped[by]
        columns = [labelled(self.points[c].values) for c in by]
        group = combined([code for _, code in columns])
        rows = first_of(group)
        labels = tuple(",".join(names[code[row]] for names, code in columns) for row in rows)
        return self._grouped.setdefault(by, (labels, group))

    @functools.cached_property
    def _grouped(self) -> dict[tuple[str, ...], tuple[tuple[str, ...], npt.NDArray[np.intp]]]:
        """The groups that were looked for: weights have the same, and there may be millions of points."""
        return {}

    @functools.cached_property
    def sets(self) -> tuple[tuple[str, ...], npt.NDArray[np.intp]]:
        """The coordinates that tell sets apart, and each point's set."""
        by = dataset.sets(self.points)
        return by, self._groups(by)[1]

    @functools.cached_property
    def bulk(self) -> Bulk | None:
        """The same points in blocks, for searches of very many; None where the problem does not go so."""
        return bulk(self) if len(self.measured) > MANY else None

    @functools.cached_property
    def free_weights(self) -> tuple[Entry, ...]:
        return tuple(e for e in self.entries if e.is_weight and e.held is None)

    @functools.cached_property
    def free_shape(self) -> tuple[Entry, ...]:
        return tuple(e for e in self.entries if not e.is_weight and e.held is None)

    @property
    def free(self) -> tuple[Entry, ...]:
        return (*self.free_weights, *self.free_shape)

    @functools.cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the free values, in the order of a solver's vector: weights, then shape."""
        return tuple(name for entry in self.free for name in entry.names)

    @functools.cached_property
    def n_weights(self) -> int:
        return sum(entry.size for entry in self.free_weights)

    @functools.cached_property
    def lower(self) -> Values:
        return np.array([e.lower for e in self.free for _ in e.labels])

    @functools.cached_property
    def upper(self) -> Values:
        return np.array([e.upper for e in self.free for _ in e.labels])

    @functools.cached_property
    def shape_start(self) -> Values:
        """The declared defaults, moved inside the bounds."""
        defaults = [self.model.shape[e.name].default for e in self.free_shape for _ in e.labels]
        return np.clip(defaults, self.lower[self.n_weights :], self.upper[self.n_weights :])

    def axes(self, lower: Values | None = None, upper: Values | None = None) -> Axes:
        """The free shape parameters as coordinates from 0 to 1, between the problem's bounds or narrower ones."""
        n = self.n_weights
        parameters = [self.model.shape[e.name] for e in self.free_shape for _ in e.labels]
        evenly = [e.name in self.smoothed for e in self.free_shape for _ in e.labels]
        low, high = self.lower[n:] if lower is None else lower, self.upper[n:] if upper is None else upper
        return Axes(parameters, low, high, evenly)

    def part(self, rows: npt.NDArray[np.intp]) -> "Problem":
        """The same problem of some of its points in use."""
        given = None if self.point_weights is None else self.point_weights[rows]
        return replace(self, data=self.points.isel(direction=rows), point_weights=given)

    def design(self, shape: Values) -> tuple[Values, Values]:
        """The matrix whose product with the weights is the BRDF, and the part of held weights, as the instrument reads.

        `shape` (..., n_shape) may carry leading dimensions for several candidates at once;
        returns (..., n_points, n_weights) and (..., n_points).
        """
        basis = self.acceptance.basis(self.model, self._shape_at_points(shape))
        lead = shape.shape[:-1]
        n = len(self.measured)
        columns = np.zeros((*lead, self.n_weights, n))  # column by column, as LAPACK reads a matrix
        fixed = np.zeros((*lead, n))
        column = 0
        for entry in self.entries:
            if not entry.is_weight:
                continue
            if entry.held is not None:
                fixed += np.asarray(entry.held)[entry.group] * basis[entry.name]
                continue
            if entry.size == 1:
                columns[..., column, :] = basis[entry.name]
            else:
                columns[..., column + entry.group, np.arange(n)] = basis[entry.name]
            column += entry.size
        return np.swapaxes(columns, -1, -2), fixed

    def brdf(self, vector: Values) -> Values:
        """The model at every point as the instrument reads it, for a vector (..., n) of weights and shape."""
        matrix, fixed = self.design(vector[..., self.n_weights :])
        out: Values = np.einsum("...nw,...w->...n", matrix, vector[..., : self.n_weights]) + fixed
        return out

    def residual(self, vector: Values) -> Values:
        """Weighted difference of model and measurement, whose squared sum over `scale` is E (eq 11), then a penalty."""
        difference = self.difference(self.brdf(vector))
        return np.concatenate([difference, vector @ self.penalty.T], axis=-1) if len(self.penalty) else difference

    def penalised(self, matrix: Values, target: Values, shape: Values) -> tuple[Values, Values]:
        """A weighted design and its target for one shape or several, with the rows of the penalty below."""
        if not len(self.penalty):
            return matrix, target
        weights, bent = self.penalty[:, : self.n_weights], shape @ self.penalty[:, self.n_weights :].T
        weights = np.broadcast_to(weights, (*shape.shape[:-1], *weights.shape))
        return np.concatenate([matrix, weights], axis=-2), np.concatenate([target, -bent], axis=-1)

    def difference(self, modelled: Values) -> Values:
        """The residual of BRDF values that are there already."""
        if self.logarithmic:
            modelled = np.log(np.maximum(modelled, np.finfo(float).tiny))
        return self.root_weights * modelled - self.target

    def error(self, uncertainty: Values) -> Values:
        """How far an uncertainty of every measured value moves the residual."""
        return self.root_weights * (uncertainty / self.measured if self.logarithmic else uncertainty)

    def cost(self, residual: Values) -> Values:
        """E (eq 11) of a residual."""
        total: Values = np.sum(residual**2, axis=-1) / self.scale
        return total

    def _shape_at_points(self, shape: Values) -> dict[str, Values | float]:
        """Each shape parameter's value at every point, shaped to broadcast against the directions."""
        values: dict[str, Values | float] = {}
        at = 0
        for entry in self.entries:
            if entry.is_weight:
                continue
            if entry.held is not None:
                values[entry.name] = entry.held[0] if entry.size == 1 else np.asarray(entry.held)[entry.group]
                continue
            part = shape[..., at : at + entry.size]
            values[entry.name] = part if entry.size == 1 else part[..., entry.group]
            at += entry.size
        return values


def labelled(values: npt.NDArray[Any]) -> tuple[tuple[str, ...], npt.NDArray[np.intp]]:
    """The labels of a coordinate's values in their order, and each value's place among them.

    Numbers that agree in six digits have one label, and are one value.
    """
    found, place = distinct(values)
    texts = [label(value) for value in found]
    labels = tuple(dict.fromkeys(texts))
    index = {text: at for at, text in enumerate(labels)}
    return labels, np.array([index[text] for text in texts], dtype=np.intp)[place]


def _held(
    name: str, given: float | Mapping[str, float] | None, by: tuple[str, ...], labels: tuple[str, ...]
) -> tuple[float, ...] | None:
    """The held value of every group, in the order of their labels."""
    if given is None:
        return None
    if not isinstance(given, Mapping):
        if by:
            raise ValueError(f"{name} is held at one value and grouped by {', '.join(by)}: choose one")
        return (float(given),)
    if missing := [label for label in labels if label not in given]:
        where = f"grouped by {', '.join(by)}" if by else "not grouped"
        raise ValueError(f"{name} is {where} and held for {', '.join(given)}: there is none for {missing[0] or 'all'}")
    return tuple(float(given[label]) for label in labels)
