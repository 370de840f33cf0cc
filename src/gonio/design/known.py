"""What a fit knows of readings that are not there yet: their BRDF, and how it changes with the free values."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.design.noise import Noise, noise_of
from gonio.fitting.objective.differences import SMALLEST, derivative
from gonio.fitting.objective.entries import group_label
from gonio.fitting.solution import Solution
from gonio.measured.dataset import sets
from gonio.measured.instrument import Acceptance

Values = npt.NDArray[np.float64]
MOST_VALUES = 64  # free values beyond which a design takes minutes, and one direction cannot be told from the next


@dataclass(frozen=True, eq=False)
class Known:
    """A fit, and the free values that lie inside their bounds: those that readings can make surer.

    names: of these values. places: theirs along `parameter` of the fit. at_bound: the names of the free values that lie
    at a bound and are taken as held there, because a reading moves them to one side only.
    """

    solution: Solution
    names: tuple[str, ...]
    places: npt.NDArray[np.intp]
    at_bound: tuple[str, ...]

    @classmethod
    def of(cls, solution: Solution) -> "Known":
        """What a fit knows; ValueError, with the remedy, for one that no readings can be designed for.

        Those are fits of several wavelengths, channels or scans at once, of smooth parameters, and of many values.
        """
        if solution.smooth:
            raise ValueError(f"{', '.join(solution.smooth)} is smooth: fit without --smooth to plan readings")
        for name in sets(solution.scan):
            some = [group_label(value) for value in np.unique(solution.scan[name].values).tolist()]
            raise ValueError(
                f"the fit is of {len(some)} values of {name}, and readings are planned for one: "
                f"add --select {name}={some[0]}"
            )
        free = ~solution.dataset["held"].values
        bound = solution.dataset["at_bound"].values & free
        names = solution.dataset["parameter"].values
        places = np.flatnonzero(free & ~bound)
        if not len(places):
            raise ValueError("every value is held or at a bound: no reading makes one surer")
        if len(places) > MOST_VALUES:
            raise ValueError(
                f"the fit has {len(places)} free values, and readings are planned for {MOST_VALUES} at most"
            )
        return cls(solution, tuple(names[places].tolist()), places, tuple(names[bound].tolist()))

    def brdf(self, directions: xr.Dataset) -> Values:
        """The fitted BRDF (m,) at directions, as the instrument of the fit reads it."""
        return self.solution.brdf(directions)

    def slopes(self, directions: xr.Dataset) -> Values:
        """The derivative (m, values) of the BRDF at directions by the values, as the instrument of the fit reads it.

        By a weight it is the term itself, by a shape parameter it is taken by differences within its declared bounds.
        ValueError where a direction belongs to no group of the fit.
        """
        model, stored = self.solution.model, self.solution.dataset
        at = self.solution.places(directions)
        acceptance = Acceptance.of(self.solution.instrument, directions, model)
        values = stored["value"].values
        owner = stored["name"].values[self.places]
        shape = [k for k, name in enumerate(owner) if name in model.shape or acceptance.of_degrees]
        out = np.zeros((directions.sizes["direction"], len(self.places)))

        def of_shape(some: Values) -> Values:
            changed = values.copy()
            changed[self.places[shape]] = some
            return np.broadcast_to(acceptance.brdf(model, {n: changed[p] for n, p in at.items()}), len(out))

        if shape:
            bounds = [model.shape.get(owner[k]) for k in shape]  # none of a weight, which a ratio takes like a shape
            lower = np.array([0.0 if one is None else one.lower for one in bounds])
            upper = np.array([np.inf if one is None else one.upper for one in bounds])
            some = values[self.places[shape]]
            low, high = np.minimum(lower, some), np.maximum(upper, some)
            out[:, shape] = derivative(of_shape, some, low, high, scale=SMALLEST)
        if acceptance.of_degrees:
            return out
        basis = acceptance.basis(model, {n: values[p] for n, p in at.items() if n in model.shape})
        for k, name in enumerate(owner):
            if name in basis:
                out[:, k] = np.where(at[name] == self.places[k], basis[name], 0.0)
        return out

    def noise(self) -> Noise:
        """The noise of the points of the fit (`noise.noise_of`)."""
        points = self.solution.scan
        return noise_of(points, self.brdf(points), self.slopes(points))

    def rows(self, directions: xr.Dataset, noise: Noise) -> Values:
        """The derivative (m, values) of readings at directions, each over its standard uncertainty."""
        return self.slopes(directions) / noise.deviation(self.brdf(directions))[:, None]

    def wanted(self, asked: Sequence[str]) -> list[str]:
        """The names of the values that are asked for: `ks` is all of `ks[30]`, `ks[40]`.

        ValueError for a name that the fit has not, and for values that are held or at a bound.
        """
        all_names = [str(n) for n in self.solution.dataset["parameter"].values]
        owner = dict(zip(all_names, self.solution.dataset["name"].values.tolist(), strict=True))
        out: list[str] = []
        for name in asked:
            some = [n for n in all_names if name in (n, owner[n])]
            if not some:
                raise ValueError(f"the fit has no value {name!r} to want; it has {', '.join(all_names)}")
            inside = [n for n in some if n in self.names]
            if not inside:
                why = "lies at its bound" if set(some) & set(self.at_bound) else "is held"
                remedy = "give it wider bounds with --bound" if "bound" in why else "leave it free"
                raise ValueError(f"{name} {why}, so no reading makes it surer: {remedy}, or want another value")
            out += [n for n in inside if n not in out]
        return out
