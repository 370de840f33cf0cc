"""Flat facets, each with its area, its normal and its BRDF: a fit, or a model with values given by hand."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from gonio.fitting.certainty.sets import mixture
from gonio.fitting.solution import Solution
from gonio.geometry import Geometry
from gonio.measured import dataset
from gonio.model import Model
from gonio.outside import printable

Values = npt.NDArray[np.float64]
Brdf = Callable[[Values, Geometry], Values]  # of all values of a fit, and of directions; a model ignores the values

# Directions at which a surface is turned about its normal, to see whether it has a direction [deg].
TRIED = ((20.0, 35.0, 70.0), (50.0, 40.0, 160.0), (5.0, 5.0, 180.0))
TURNS = (0.0, 37.0, 74.0)
SAME = 1e-9


@dataclass(frozen=True, eq=False)
class Facet:
    """A flat surface that faces one way.

    Parameters
    ----------
    area : float
        Area [m^2].
    normal : array_like (3,) or (times, 3)
        Its normal, of any length, in the frame of the sun and the observer.
    brdf : Solution or Model
        A fit of absolute data, or a model with `values`.
    values : mapping
        Of a model, by the names of its parameters; they are taken as exact.
    select : mapping
        Of a fit with values for several channels, wavelengths or scans: which one, {"channel": "G"}; or several with
        their weights in the band, {"channel": {"R": 0.3, "G": 0.6, "B": 0.1}}, whose weighted mean is taken.
    along : array_like (3,) or (times, 3), optional
        A vector whose projection on the surface is its x axis; a surface that has a direction needs it.
    name : str
        What it is called; facets of one name are counted together.

    Raises
    ------
    ValueError
        The area is no positive number, a value is unknown to the model, the fit is relative, or a set has to be chosen.

    """

    area: float
    normal: Any
    brdf: Solution | Model
    values: Mapping[str, float] = field(default_factory=dict)
    select: Mapping[str, Any] = field(default_factory=dict)
    along: Any = None
    name: str = ""

    def __post_init__(self) -> None:
        if not (np.isfinite(self.area) and self.area > 0):
            raise ValueError(f"{self._called}: its area is {self.area:g}: give square metres above 0")
        if isinstance(self.brdf, Model):
            if self.select:
                raise ValueError(f"{self._called}: select chooses a set of a fit, and this is a model")
            self.brdf(Geometry.from_degrees(0.0, 0.0, 0.0), self.values)  # for what it refuses, here and not later
            return
        if self.values:
            raise ValueError(f"{self._called}: values belong to a model, and a fit has its own")
        if self.brdf.unit != dataset.ABSOLUTE:
            raise ValueError(f"{self._called}: its fit is in {self.brdf.unit}, and a magnitude needs a BRDF in sr-1")
        mixture(self.brdf, self.select, self._called)

    @property
    def _called(self) -> str:
        return f"facet {printable(self.name)}" if self.name else "a facet"

    @property
    def solution(self) -> Solution | None:
        """The fit, None for a model."""
        return self.brdf if isinstance(self.brdf, Solution) else None

    @property
    def key(self) -> tuple[Any, ...]:
        """The same for facets of the same BRDF, which are evaluated together."""
        mixed = tuple((n, tuple(c.items()) if isinstance(c, Mapping) else c) for n, c in self.select.items())
        return id(self.brdf), tuple(self.values.items()), mixed

    def evaluated(self) -> Brdf:
        """The BRDF as a function of all values of the fit and of directions."""
        if isinstance(self.brdf, Model):
            model, values = self.brdf, dict(self.values)
            return lambda _, g: np.asarray(model(g, values), dtype=float)
        model, mixed = self.brdf.model, mixture(self.brdf, self.select, self._called)

        def brdf(values: Values, g: Geometry) -> Values:
            parts = [w * np.asarray(model(g, {n: values[k] for n, k in at.items()})) for w, at in mixed]
            return np.sum(parts, axis=0)

        return brdf

    def refuse_unturned(self) -> None:
        """ValueError for a surface that has a direction where `along` does not say which."""
        if self.along is not None:
            return
        values = np.empty(0) if self.solution is None else self.solution.dataset["value"].values
        theta_i, theta_r, phi = np.array(TRIED).T
        turned = [self.evaluated()(values, Geometry.from_degrees(theta_i, theta_r, phi, turn)) for turn in TURNS]
        if not all(np.allclose(one, turned[0], rtol=SAME, atol=0) for one in turned[1:]):
            raise ValueError(f"{self._called}: its surface has a direction: give along, a vector along its x axis")
