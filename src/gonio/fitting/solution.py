"""What a fit gives: a model with its values, how sure they are, and what became of the search."""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy.special import ndtri, stdtrit

from gonio.fitting.objective.entries import group_labels
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.smooth import Smooth
from gonio.fitting.status import Status
from gonio.measured.dataset import geometry
from gonio.measured.instrument import Acceptance, Instrument
from gonio.model import Model

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]

TOGETHER = 2**16  # directions that are evaluated at once: more cost memory and no less time


@dataclass(frozen=True, eq=False)
class Solution:
    """A fitted model: its declaration, a Dataset over `parameter`, and the views of it that people ask for.

    The Dataset's variables, coordinates and attributes are those of `fitting.schema`.
    """

    dataset: xr.Dataset
    model: Model

    @property
    def status(self) -> Status:
        """How the search ended."""
        return Status(self.dataset.attrs["status"])

    @property
    def cost(self) -> float:
        """E (guo2023, eq 11) of the data alone."""
        return float(self.dataset.attrs["cost"])

    @property
    def unit(self) -> str:
        """The unit of the data, `sr-1` or `a.u.`."""
        return str(self.dataset.attrs["unit"])

    @property
    def smooth(self) -> dict[str, Smooth]:
        """What was held smooth, by name, as a Problem takes it."""
        pairs = (text.partition("=") for text in self.dataset.attrs["smooth"].split())
        return {name: Smooth.parsed(how) for name, _, how in pairs}

    @property
    def instrument(self) -> Instrument:
        """What source and detector took in, which comparisons with the scan need again."""
        return Instrument(**{f.name: float(self.dataset.attrs[f"instrument_{f.name}"]) for f in fields(Instrument)})

    @property
    def effective_values(self) -> float:
        """How many free values the fit had the use of: their number, or what smoothing leaves of it."""
        return float(self.dataset.attrs["effective_values"])

    @functools.cached_property
    def values(self) -> dict[str, float]:
        """Value by parameter, `ks[30]` for one of a group."""
        return dict(zip(self.dataset["parameter"].values.tolist(), self.dataset["value"].values.tolist(), strict=True))

    @functools.cached_property
    def uncertainties(self) -> dict[str, float]:
        """Standard uncertainty by parameter."""
        names = self.dataset["parameter"].values.tolist()
        return dict(zip(names, self.dataset["uncertainty"].values.tolist(), strict=True))

    @property
    def covariance_kind(self) -> str:
        """`robust`, `scaled` or `absolute` (`fitting.covariance_kinds`)."""
        return str(self.dataset.attrs["covariance"])

    def vector(self, names: Sequence[str]) -> Values:
        """The values (n,) of these parameters, as a Problem's functions take those of its `names`."""
        return np.array([self.values[name] for name in names])

    @property
    def has_systematic(self) -> bool:
        """Whether the scan stated a systematic uncertainty."""
        return not bool(np.isnan(self.dataset["uncertainty_systematic"].values).all())

    def coverage_factor(self, level: float = 0.95) -> float:
        """Half the width of an interval in standard uncertainties.

        Student's t with points less effective values degrees of freedom; the normal distribution for an absolute
        covariance, which learns nothing from the scatter. Raises ValueError for a level that is not between 0 and 1.
        """
        if not 0 < level < 1:
            raise ValueError(f"the level of an interval lies between 0 and 1, and is {level:g}")
        if self.covariance_kind == "absolute":
            return float(ndtri(0.5 + level / 2))
        return float(stdtrit(max(self.dataset.attrs["points"] - self.effective_values, 1), 0.5 + level / 2))

    def intervals(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Confidence interval of every free value, of random errors alone, by the kind of covariance of the fit."""
        width, spreads = self.coverage_factor(level), self.uncertainties
        return {
            name: (value - width * spreads[name], value + width * spreads[name])
            for name, value in self.values.items()
            if not math.isnan(spreads[name])
        }

    def as_fitted(self, problem: Problem) -> Problem:
        """The problem that was fitted with what the fit settled: strengths and scales of what is smooth."""
        return replace(problem, smooth=self.smooth) if problem.smooth else problem

    def at(self, points: xr.Dataset) -> dict[str, float | Values]:
        """The value of every parameter at each direction of a flat scan, groups looked up by their coordinates.

        Raises ValueError where a direction belongs to no group of the fit.
        """
        values = self.dataset["value"].values
        return {
            name: values[place] if isinstance(place, np.ndarray) else float(values[place])
            for name, place in self.places(points).items()
        }

    def places(self, points: xr.Dataset) -> dict[str, int | Places]:
        """Where along `parameter` the value of every parameter stands, one or one for each direction, as `at` does."""
        found: dict[str, int | Places] = {}
        names = self.dataset["name"].values
        for name in dict.fromkeys(names.tolist()):
            rows = np.flatnonzero(names == name)
            by = str(self.dataset["by"].values[rows[0]])
            if not by:
                found[name] = int(rows[0])
                continue
            table = dict(zip(self.dataset["group"].values[rows].tolist(), rows.tolist(), strict=True))
            labels, place = group_labels(points, by.split(","))
            if unknown := sorted(set(labels) - set(table)):
                raise ValueError(
                    f"{name} was fitted for {by} = {', '.join(table)}; there is none for {', '.join(unknown)}"
                )
            found[name] = np.array([table[label] for label in labels], dtype=np.intp)[place]
        return found

    def predict(self, points: xr.Dataset) -> Values:
        """The fitted BRDF (points,) at the directions of a flat scan, as the instrument of the fit reads it.

        Raises ValueError where a direction belongs to no group of the fit.
        """
        parts = [points]
        if points.sizes["direction"] > TOGETHER:
            some = range(0, points.sizes["direction"], TOGETHER)
            parts = [points.isel(direction=slice(at, at + TOGETHER)) for at in some]
        acceptances = (Acceptance(self.instrument, geometry(part)) for part in parts)
        brdf = [a.brdf(self.model, self.at(part)) for a, part in zip(acceptances, parts, strict=True)]
        return np.concatenate([np.broadcast_to(f, p.sizes["direction"]) for f, p in zip(brdf, parts, strict=True)])

    def components(self, points: xr.Dataset) -> dict[str, Values]:
        """Every weight times its term (points,), by weight, whose sum is what `predict` gives."""
        values = self.at(points)
        acceptance = Acceptance(self.instrument, geometry(points))
        basis = acceptance.basis(self.model, {n: value for n, value in values.items() if n in self.model.shape})
        return {weight: np.asarray(values[weight] * term, dtype=float) for weight, term in basis.items()}

    def parameters(self) -> dict[str, dict[str, Any]]:
        """Values, uncertainties and units as plain data, grouped parameters under `by` and `values`."""
        out: dict[str, dict[str, Any]] = {}
        columns = ["value", "uncertainty"] + ["uncertainty_systematic"] * self.has_systematic
        for name, part in self._by_name():
            pairs = [
                dict(zip(columns, row, strict=True))
                for row in zip(*(part[n].values.tolist() for n in columns), strict=True)
            ]
            unit, by = str(part["unit"].values[0]), str(part["by"].values[0])
            if by:
                groups = part["group"].values.tolist()
                out[name] = {"by": by, "values": dict(zip(groups, pairs, strict=True)), "unit": unit}
            else:
                out[name] = pairs[0] | {"unit": unit}
            if bool(part["held"].values[0]):
                out[name]["held"] = True
        return out

    def _by_name(self) -> list[tuple[str, xr.Dataset]]:
        names = self.dataset["name"].values
        flat = self.dataset.drop_dims(["parameter_b", "step", "draw"], errors="ignore")
        return [(n, flat.isel(parameter=np.flatnonzero(names == n))) for n in dict.fromkeys(names.tolist())]

    def save(self, path: str | Path, force: bool = False) -> None:
        """Write the solution as NetCDF; FileExistsError where the file is there and `force` is False."""
        from gonio.fitting.stored import save

        save(self.dataset, path, force)

    @classmethod
    def load(cls, path: str | Path, model: Model | None = None) -> "Solution":
        """Read what `save` wrote; its model is the one of that name in the catalogue, unless it is given.

        Raises FormatError, with the byte offset, for a file that is damaged or holds no solution.
        """
        from gonio.fitting.stored import load

        return cls(*load(path, model))
