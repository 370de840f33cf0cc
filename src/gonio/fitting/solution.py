"""What a fit found: values, how sure they are, and what became of the search."""

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from enum import StrEnum
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr
from scipy.special import ndtri, stdtrit

from gonio.files import replacing
from gonio.fitting.objective.smooth import Smooth
from gonio.measured.distinct import combined, first_of
from gonio.measured.instrument import Instrument

Values = npt.NDArray[np.float64]


class Status(StrEnum):
    """How a search ended; the values are the messages."""

    CONVERGED = "converged"
    AT_BOUND = "converged with a value at its bound: the data would have it beyond, or do not determine it"
    NOT_DETERMINED = "converged, and the data do not determine every value: hold or share what has no uncertainty"
    STEPS_EXHAUSTED = "stopped at the largest number of iterations"
    TOO_FEW_POINTS = "as many values as points or more: nothing is left to tell how good they are"
    NO_POINTS = "not fitted: every value is masked or missing"
    ALL_ZERO = "not fitted: every value is zero"
    NOT_WEIGHED = "not fitted: some values have no weight, as relative weighting gives none to what is not positive"


STATUSES = tuple(Status)


def code(status: Status) -> int:
    """The number that stands for a status where there are many."""
    return STATUSES.index(status)


@dataclass(frozen=True)
class Optimum:
    """What a solver hands back: the vector of weights and shape, E there, and the course of the search.

    `history` holds the best E after each step, (steps,) or (steps, chains). `searched` is on how many points starts
    were searched, 0 for all. `rivals` are the vectors of other minima that were met.
    """

    vector: Values
    cost: float
    exhausted: bool
    evaluations: int
    history: Values
    searched: int = 0
    rivals: tuple[Values, ...] = ()


@dataclass(frozen=True)
class Solution:
    """A fitted model as a Dataset over `parameter`, and the views of it that people ask for.

    Variables: `value`, `uncertainty` (standard; NaN for held values, infinite for undetermined ones), `at_bound`,
    `held`, `covariance`, `history` (best E after each step, with what holds values smooth). `uncertainty_systematic` is
    what the systematic part of the scan's own does to each value, NaN where the scan does not state it;
    `systematic_shift` is the same with its sign, because all values shift together. Coordinates: `name`, `by`, `group`,
    `unit` of each value.
    Attributes: model, solver, status, cost (E, eq 11, of the data alone), seconds, evaluations, weighting, noise_floor,
    points, points_searched (on which starts were searched: all, or a sample of very many), effective_values (the
    number of free values, or what smoothing leaves of it), smooth, unit (of the data),
    covariance (its kind), and the fields of the Instrument after `instrument_`; `instrument_error` is what a finer rule
    for its cones would change, over what the fit leaves over.
    """

    dataset: xr.Dataset

    @property
    def status(self) -> Status:
        return Status(self.dataset.attrs["status"])

    @property
    def cost(self) -> float:
        return float(self.dataset.attrs["cost"])

    @property
    def model_name(self) -> str:
        return str(self.dataset.attrs["model"])

    @property
    def smooth(self) -> dict[str, Smooth]:
        """What was held smooth, by name, as a Problem takes it; nothing in files from before there was any."""
        pairs = (text.partition("=") for text in self.dataset.attrs.get("smooth", "").split())
        return {name: Smooth.parsed(how) for name, _, how in pairs}

    @property
    def instrument(self) -> Instrument:
        """What source and detector took in, which comparisons with the scan need again."""
        attrs, names = self.dataset.attrs, [f.name for f in fields(Instrument)]
        return Instrument(**{n: float(attrs[f"instrument_{n}"]) for n in names if f"instrument_{n}" in attrs})

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
        """`robust`, `scaled` or `absolute` (`fit.covariance`)."""
        return str(self.dataset.attrs["covariance"])

    def vector(self, names: Sequence[str]) -> Values:
        """The values of these parameters, as a Problem's functions take those of its `names`."""
        return np.array([self.values[name] for name in names])

    @property
    def has_systematic(self) -> bool:
        """Whether the scan stated a systematic uncertainty."""
        return not bool(np.isnan(self.dataset["uncertainty_systematic"].values).all())

    def coverage_factor(self, level: float = 0.95) -> float:
        """Half the width of an interval in standard uncertainties.

        Student's t with points less effective values degrees of freedom; the normal distribution for an absolute
        covariance, which learns nothing from the scatter.
        """
        if not 0 < level < 1:
            raise ValueError(f"the level of an interval lies between 0 and 1, and is {level:g}")
        if self.covariance_kind == "absolute":
            return float(ndtri(0.5 + level / 2))
        free = self.dataset.attrs.get("effective_values", int((~self.dataset["held"].values).sum()))
        return float(stdtrit(max(self.dataset.attrs["points"] - free, 1), 0.5 + level / 2))

    def intervals(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Confidence interval of every free value, of random errors alone, by the kind of covariance of the fit."""
        width, spreads = self.coverage_factor(level), self.uncertainties
        return {
            name: (value - width * spreads[name], value + width * spreads[name])
            for name, value in self.values.items()
            if not math.isnan(spreads[name])
        }

    def at(self, points: xr.Dataset) -> dict[str, float | Values]:
        """The value of every parameter at each direction of a flat scan, groups looked up by their coordinates.

        Raises ValueError where a direction belongs to no group of the fit.
        """
        values = self.dataset["value"].values
        return {
            name: values[place] if isinstance(place, np.ndarray) else float(values[place])
            for name, place in self.places(points).items()
        }

    def places(self, points: xr.Dataset) -> dict[str, int | npt.NDArray[np.intp]]:
        """Where along `parameter` the value of every parameter stands, one or one for each direction, as `at` does."""
        found: dict[str, int | npt.NDArray[np.intp]] = {}
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

    def save(self, path: str | Path, force: bool = False) -> None:
        """Write the Dataset as NetCDF; FileExistsError where the file is there and `force` is False."""
        plain = self.dataset.assign({n: self.dataset[n].astype("int8") for n in ("at_bound", "held")})
        with replacing(path, force) as temporary:
            plain.to_netcdf(temporary, engine="scipy", format="NETCDF3_64BIT")

    @classmethod
    def load(cls, path: str | Path) -> "Solution":
        """Read what `save` wrote."""
        with xr.open_dataset(path, engine="scipy") as opened:
            stored = opened.load()
        stored = stored.assign({n: stored[n].astype(bool) for n in ("at_bound", "held")})
        names = ("parameter", "name", "by", "group", "unit")
        return cls(stored.assign_coords({n: (stored[n].dims, stored[n].values.astype(str)) for n in names}))

    def _by_name(self) -> list[tuple[str, xr.Dataset]]:
        names = self.dataset["name"].values
        flat = self.dataset.drop_dims(["parameter_b", "step", "draw"], errors="ignore")
        return [(n, flat.isel(parameter=np.flatnonzero(names == n))) for n in dict.fromkeys(names.tolist())]


def group_labels(points: xr.Dataset, by: list[str]) -> tuple[list[str], npt.NDArray[np.intp]]:
    """The labels of groups, coordinates with numbers in their shortest form joined by commas, and each direction's."""
    columns = [points[c].values for c in by]
    place = combined(columns)
    rows = zip(*(column[first_of(place)] for column in columns), strict=True)
    return [",".join(label(value) for value in row) for row in rows], place


def label(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


def finite(value: float) -> float | None:
    """For JSON, which has neither NaN nor infinity."""
    return value if math.isfinite(value) else None


def without_infinities(data: Any) -> Any:
    """The same plain data with NaN and infinities as None."""
    if isinstance(data, Mapping):
        return {key: without_infinities(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [without_infinities(value) for value in data]
    return finite(data) if isinstance(data, float) else data
