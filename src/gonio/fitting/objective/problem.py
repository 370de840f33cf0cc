"""A model and a scan become two functions of numbers alone, `design` and `residual`; a solver sees nothing else.

A model is f = sum_k w_k t_k(shape), with weights w and terms t. At the points of a scan, for one shape, that is a
matrix times the weights, the `design`. A fit makes the relative weighted squared error least (guo2023, eq 11),
E = sum g (f - m)^2 / sum g m^2, with m the measured values
and g = g1(theta_i) g2(theta_r) their weights. With r = sqrt(g) (f - m), the `residual`, E is the squared length of r
over `scale`. For logarithmic weighting r = sqrt(g) (ln f - ln m), and `scale` is sum g.

A vector (n,) holds the free weights, then the free shape values, in the order of `names`. This file does not minimise
E: in `fitting.search` variable projection (golub1973) uses `design`, and searches of all values use `residual`.
"""

import functools
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.objective.axes import Axes
from gonio.fitting.objective.entries import (
    Entry,
    Places,
    as_html,
    described,
    designed,
    groups,
    held_values,
    refuse_bounds,
    shape_at_points,
    summed,
)
from gonio.fitting.objective.from_scan import WAVELENGTH, answered, kept, refuse_no_scan, seen
from gonio.fitting.objective.options import ProblemOptions
from gonio.fitting.objective.smooth import Smooth, declared, penalty_rows
from gonio.fitting.objective.weighting import WEIGHTINGS
from gonio.geometry import Geometry
from gonio.measured import dataset
from gonio.measured.instrument import Acceptance
from gonio.measured.polarimetry.ratio import whole
from gonio.measured.polarisers import POLARISATION, analysed
from gonio.model import Model
from gonio.options import options_of
from gonio.units import weight_unit

Values = npt.NDArray[np.float64]

MANY_VALUES = 64  # free values below which a matrix of all points and values is never called large
LARGE = 2**19  # numbers: 4 MiB, what a processor's cache holds


@dataclass(frozen=True, eq=False)
class Problem(ProblemOptions):
    """Fit `model` to `data` by minimising the relative weighted squared error (guo2023, eq 11).

    The options are those of ProblemOptions, by keyword. Those that are read from the scan, a half width or the optical
    constants of a material, are numbers once the Problem is made. A model's `wavelength` is held at that of the scan,
    where the scan has one, unless it is held, grouped, bounded or smooth.
    Problems are immutable and compared by identity; `dataclasses.replace` makes a changed one. Raises ValueError for a
    name that the model does not have, a scan without values, or a weighting that the scan does not allow.
    """

    model: Model
    data: xr.Dataset
    weighting: str = field(default="uniform", kw_only=True)  # eq 11; what looks for an answer asks for `auto`

    def __post_init__(self) -> None:
        super().__post_init__()
        dataset.unit(self.data)
        for name, value in seen(self, self.model, self.data).items():
            object.__setattr__(self, name, value)
        refuse_no_scan(self.data)
        for name, value in answered(self, self.data).items():
            object.__setattr__(self, name, value)
        self._refuse_unknown_names()
        if not self.free:
            raise ValueError("every parameter is held: nothing is left to fit")
        if self.point_weights is not None and np.shape(self.point_weights) != self.measured.shape:
            raise ValueError(f"point_weights needs one for each of the {len(self.measured)} points in use")
        _ = (
            self.root_weights,
            (self.instrument or whole(self.model).polarised) and self.acceptance,
        )  # refuse before a search

    def __repr__(self) -> str:
        return described(self.model, self.entries, dataset.unit(self.data), self.weighting)

    def _repr_html_(self) -> str:
        """The scan, the weighting, and what becomes of every parameter, for notebooks."""
        return as_html(self.model, self.entries, self.points, self.weighting)

    def _refuse_unknown_names(self) -> None:
        for name_of, option in options_of(ProblemOptions).items():
            for name in getattr(self, name_of) if option.of_parameters else ():
                if name not in self.model.parameters:
                    have = ", ".join(self.model.parameters)
                    raise ValueError(f"{name_of}: {self.model.name} has no parameter {name!r}; it has {have}")

    @functools.cached_property
    def points(self) -> xr.Dataset:
        """The scan's values in use, on one dimension `direction`."""
        return dataset.points(self.data)

    @functools.cached_property
    def geometry(self) -> Geometry:
        """The directions of the points in use, as unit vectors (points,)."""
        return dataset.geometry(self.points)

    @functools.cached_property
    def acceptance(self) -> Acceptance:
        """The directions that source and detector take in at every point; an ideal instrument takes in one each."""
        seen_by = analysed(self.points) if whole(self.model).polarised else None
        return Acceptance(self.instrument, self.geometry, seen_by)

    @functools.cached_property
    def measured(self) -> Values:
        """The measured BRDF (points,) in the scan's unit."""
        return np.asarray(self.points["brdf"].values, dtype=float)

    @property
    def logarithmic(self) -> bool:
        """Whether the residual compares logarithms."""
        return WEIGHTINGS[self.weighting].logarithmic

    @functools.cached_property
    def root_weights(self) -> Values:
        """Square roots (points,) of the weights g1(theta_i) g2(theta_r) of eq 11.

        Raises ValueError for weights that are negative, not finite or all zero.
        """
        weights = WEIGHTINGS[self.weighting].weights(self.points, self.noise_floor)
        for name, g in (("theta_i", self.g1), ("theta_r", self.g2)):
            if g is not None:
                weights = weights * np.asarray(g(self.points[name].values))
        if self.point_weights is not None:
            weights = weights * self.point_weights
        if not (np.isfinite(weights).all() and (weights >= 0).all() and weights.any()):
            raise ValueError("the weights (with g1, g2, point_weights) must be finite, non-negative and not all zero")
        root: Values = np.sqrt(weights)
        return root

    @functools.cached_property
    def target(self) -> Values:
        """What the residual subtracts (points,): weighted measured values, or their logarithms."""
        values = np.log(self.measured) if self.logarithmic else self.measured
        return self.root_weights * values

    @functools.cached_property
    def scale(self) -> float:
        """The denominator of eq 11; for logarithms the sum of the weights, since theirs have no zero to relate to."""
        return float(np.sum(self.root_weights**2) if self.logarithmic else np.sum(self.target**2))

    @functools.cached_property
    def smoothed(self) -> dict[str, Smooth]:
        """The smooth parameters by name, each as a full Smooth."""
        return declared(self.smooth, self.points, self.held, self.shared)

    @functools.cached_property
    def penalty(self) -> Values:
        """Rows (m, n) whose product with a vector (n,) is added below the residual; none where nothing is smooth.

        They hold the root of `scale` as a factor: E is the squared residual over `scale`, and the penalty adds to E.
        """
        rows: Values = penalty_rows(self.smoothed, self.free, self.points) * math.sqrt(self.scale)
        return rows

    @functools.cached_property
    def entries(self) -> tuple[Entry, ...]:
        """Weights first, then shape parameters, in the model's order."""
        return tuple(self._entry(name, is_weight=name in self.model.weights) for name in self.model.parameters)

    def _entry(self, name: str, is_weight: bool) -> Entry:
        own = kept(self, self.model, name, self.points)
        by = (WAVELENGTH,) if isinstance(own, Mapping) else self._grouped_by(name)
        labels, group = self._groups(by)
        if is_weight:
            lower, upper = self.bounds.get(name, (0.0, math.inf))
            unit = weight_unit(dataset.unit(self.data), self.model.term_unit(name))
        else:
            parameter = self.model.shape[name]
            lower, upper = self.bounds.get(name, (parameter.lower, parameter.upper))
            unit = parameter.unit
        held_at = self.held.get(name, own)
        assert not isinstance(held_at, str)  # `answered` has read every half width
        held = held_values(name, held_at, by, labels)
        for value in held or ():
            if not is_weight and not lower <= value <= upper:
                raise ValueError(f"{name} is held at {value:g}, outside its bounds {lower:g} to {upper:g}")
        refuse_bounds(name, (lower, upper), held is not None, self.model)
        return Entry(name, is_weight, by, labels, group, lower, upper, unit, held)

    def _grouped_by(self, name: str) -> tuple[str, ...]:
        """The coordinates that group a parameter: those asked for, sets for weights, and the one it is smooth over.

        States of polarisation share the weights of a Mueller model, which says how they differ.
        """
        by = self.grouped.get(name, ())
        by = (by,) if isinstance(by, str) else tuple(by)
        if name in whole(self.model).weights and name not in self.shared and name not in self.held:
            known = (*by, *[POLARISATION] * whole(self.model).polarised)
            by += tuple(s for s in self.sets[0] if s not in known)
        if name in self.smoothed and self.smoothed[name].by not in by:
            by += (self.smoothed[name].by,)
        return by

    def _groups(self, by: tuple[str, ...]) -> tuple[tuple[str, ...], Places]:
        if by not in self._known_groups:
            self._known_groups[by] = groups(self.points, by)
        return self._known_groups[by]

    @functools.cached_property
    def _known_groups(self) -> dict[tuple[str, ...], tuple[tuple[str, ...], Places]]:
        """Groups by their coordinates, computed once: most weights share them, and there may be millions of points."""
        return {}

    @functools.cached_property
    def sets(self) -> tuple[tuple[str, ...], Places]:
        """The coordinates that tell sets apart (channel, wavelength, scan ..), and each point's set (points,)."""
        by = dataset.sets(self.points)
        return by, self._groups(by)[1]

    @functools.cached_property
    def free_weights(self) -> tuple[Entry, ...]:
        """The weights among them."""
        return tuple(e for e in self.entries if e.is_weight and e.held is None)

    @functools.cached_property
    def free_shape(self) -> tuple[Entry, ...]:
        """The shape values among them."""
        return tuple(e for e in self.entries if not e.is_weight and e.held is None)

    @property
    def free(self) -> tuple[Entry, ...]:
        """The values that a search finds: weights, then shape."""
        return (*self.free_weights, *self.free_shape)

    @functools.cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the free values, in the order of a solver's vector: weights, then shape."""
        return tuple(name for entry in self.free for name in entry.names)

    @functools.cached_property
    def n_weights(self) -> int:
        """How many of the free values are weights."""
        return sum(entry.size for entry in self.free_weights)

    @functools.cached_property
    def lower(self) -> Values:
        """The least allowed value of every free value (n,)."""
        return np.array([e.lower for e in self.free for _ in e.labels])

    @functools.cached_property
    def upper(self) -> Values:
        """The largest allowed value of every free value (n,)."""
        return np.array([e.upper for e in self.free for _ in e.labels])

    @functools.cached_property
    def shape_start(self) -> Values:
        """The declared defaults of the free shape values (n_shape,), moved inside the bounds."""
        defaults = [self.model.shape[e.name].default for e in self.free_shape for _ in e.labels]
        return np.clip(defaults, self.lower[self.n_weights :], self.upper[self.n_weights :])

    def axes(self, lower: Values | None = None, upper: Values | None = None) -> Axes:
        """The free shape values as coordinates from 0 to 1, between the problem's bounds or narrower ones."""
        n = self.n_weights
        parameters = [self.model.shape[e.name] for e in self.free_shape for _ in e.labels]
        evenly = [e.name in self.smoothed for e in self.free_shape for _ in e.labels]
        low, high = self.lower[n:] if lower is None else lower, self.upper[n:] if upper is None else upper
        return Axes(parameters, low, high, evenly)

    def part(self, rows: Places) -> "Problem":
        """The same problem of some of its points in use, `rows` of them; `scale` and groups are those of the part."""
        point_weights = None if self.point_weights is None else self.point_weights[rows]
        return replace(self, data=self.points.isel(direction=rows), point_weights=point_weights)

    def design(self, shape: Values) -> tuple[Values, Values]:
        """The matrix whose product with the weights is the BRDF, and the part of held weights, as the instrument reads.

        `shape` (..., n_shape) may carry leading dimensions for several candidates, whose terms are computed at once;
        returns (..., points, n_weights) and (..., points). A grouped weight has one column a group, zero outside it.
        """
        basis = self.acceptance.basis(self.model, shape_at_points(self.entries, shape))
        return designed(self.entries, basis, (*shape.shape[:-1], len(self.measured)))

    def terms(self, shape: Values) -> dict[str, Values]:
        """Every term (points,) by weight as the instrument reads it, at one shape (n_shape,), without a design."""
        basis = self.acceptance.basis(self.model, shape_at_points(self.entries, shape))
        return {name: np.broadcast_to(term, self.measured.shape) for name, term in basis.items()}

    @functools.cached_property
    def is_large(self) -> bool:
        """Whether a matrix of all points and values is so large that `objective.cells` may serve better."""
        points, values = len(self.measured), len(self.names)
        several_designs = points * self.n_weights * max(values - self.n_weights, 1)
        return values >= MANY_VALUES and (points * values > LARGE or several_designs > 8 * LARGE)

    def brdf(self, vector: Values) -> Values:
        """The BRDF (..., points) as the instrument reads it, for vectors (..., n) of weights and shape."""
        if self.is_large:
            one_by_one = [summed(self.entries, self.terms(v[self.n_weights :]), v) for v in np.atleast_2d(vector)]
            return np.reshape(one_by_one, (*vector.shape[:-1], -1))
        several = max(8 * LARGE // max(len(self.measured) * self.n_weights, 1), 1)
        if vector.ndim == 2 and len(vector) > several:  # the designs of all would not fit into memory
            return np.concatenate([self.brdf(vector[k : k + several]) for k in range(0, len(vector), several)])
        matrix, fixed = self.design(vector[..., self.n_weights :])
        out: Values = np.einsum("...nw,...w->...n", matrix, vector[..., : self.n_weights]) + fixed
        return out

    def residual(self, vector: Values) -> Values:
        """Residual (..., points + m) of vectors (..., n): weighted model less measurement, then the m penalty rows.

        Its squared sum over `scale` is E (eq 11) plus the penalty.
        """
        difference = self.difference(self.brdf(vector))
        return np.concatenate([difference, vector @ self.penalty.T], axis=-1) if len(self.penalty) else difference

    def penalised(self, matrix: Values, target: Values, shape: Values) -> tuple[Values, Values]:
        """A weighted design and its target for one shape or several, with the rows of the penalty below.

        For a fixed shape the penalty rows times the shape are a constant, which is subtracted from the target.
        """
        if not len(self.penalty):
            return matrix, target
        of_weights, of_shape = self.penalty[:, : self.n_weights], shape @ self.penalty[:, self.n_weights :].T
        of_weights = np.broadcast_to(of_weights, (*shape.shape[:-1], *of_weights.shape))
        return np.concatenate([matrix, of_weights], axis=-2), np.concatenate([target, -of_shape], axis=-1)

    def difference(self, modelled: Values) -> Values:
        """The residual (..., points) of modelled BRDF values, without the penalty."""
        if self.logarithmic:  # a search may try weights for which the model is zero or negative somewhere
            modelled = np.log(np.maximum(modelled, np.finfo(float).tiny))
        return self.root_weights * modelled - self.target

    def error(self, uncertainty: Values) -> Values:
        """How far an uncertainty (points,) of the measured values moves the residual; d ln m = dm/m for logarithms."""
        return self.root_weights * (uncertainty / self.measured if self.logarithmic else uncertainty)

    def cost(self, residual: Values) -> Values:
        """E (eq 11) of a residual (..., points)."""
        total: Values = np.sum(residual**2, axis=-1) / self.scale
        return total
