"""The result of a fit: a model with its values, their uncertainties, and how the search went.

A Solution is a Dataset with the declaration of its model beside it. The Dataset holds all numbers, and is what is
saved; the methods here are views of it that people ask for, computed on demand. With weights w and terms t, the fitted
BRDF is f = sum_k w_k t_k(shape) at the values of the Dataset, averaged over the cones of the instrument.

The numbers are here; what people read of a fit, such as reports, tables and figures, is in the base class `Readable`.
"""

import functools
import json
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.objective.entries import group_labels
from gonio.fitting.objective.problem import Problem
from gonio.fitting.objective.smooth import Smooth
from gonio.fitting.objective.weighting import WEIGHTINGS
from gonio.fitting.quantiles import normal, student_t
from gonio.fitting.readable import Readable
from gonio.fitting.schema import SCAN, points_columns
from gonio.fitting.status import Status
from gonio.measured import dataset as scans
from gonio.measured.causes import WHOLE
from gonio.measured.instrument import Acceptance, Instrument
from gonio.model import Model

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]

TOGETHER = 2**16  # directions that are evaluated at once: more take more memory and no less time


@dataclass(frozen=True, eq=False, repr=False)
class Solution(Readable):
    """A fitted model: its values with their uncertainties, how the search ended, predictions, reports and figures.

    The dimension `parameter` has a place for each value of the model, held ones too. A parameter with one value for
    each group of directions takes several places, named `ks[30]`, `ks[45]` by the labels of the groups.

    Parameters
    ----------
    dataset : xarray.Dataset
        Values over `parameter`, with the content that `fitting.schema` declares.
    model : Model
        The declaration of the model.

    """

    dataset: xr.Dataset
    model: Model

    @property
    def status(self) -> Status:
        """How the search ended."""
        return Status(self.dataset.attrs["status"])

    @property
    def cost(self) -> float:
        """E (guo2023, eq 11) of the data, without the penalty of smooth parameters."""
        return float(self.dataset.attrs["cost"])

    @property
    def unit(self) -> str:
        """The unit of the data, `sr-1` or `a.u.`."""
        return str(self.dataset.attrs["unit"])

    @property
    def smooth(self) -> dict[str, Smooth]:
        """The smooth parameters by name, with the strengths and scales that the fit used, as a Problem takes them."""
        pairs = (text.partition("=") for text in self.dataset.attrs["smooth"].split())
        return {name: Smooth.parsed(how) for name, _, how in pairs}

    @property
    def instrument(self) -> Instrument:
        """The cones of source and detector that the fit used, which comparisons with the scan need again."""
        return Instrument(**{f.name: float(self.dataset.attrs[f"instrument_{f.name}"]) for f in fields(Instrument)})

    @property
    def effective_values(self) -> float:
        """The effective number of free values: their number, or less where smoothing ties them together (hastie1990).

        It need not be a whole number. Degrees of freedom are the points less this.
        """
        return float(self.dataset.attrs["effective_values"])

    @functools.cached_property
    def values(self) -> dict[str, float]:
        """Value by parameter, with `ks[30]` for the value of a group."""
        return dict(zip(self.dataset["parameter"].values.tolist(), self.dataset["value"].values.tolist(), strict=True))

    @functools.cached_property
    def uncertainties(self) -> dict[str, float]:
        """Standard uncertainty by parameter: NaN for held values, infinite for values that are not determined."""
        names = self.dataset["parameter"].values.tolist()
        return dict(zip(names, self.dataset["uncertainty"].values.tolist(), strict=True))

    @property
    def answer(self) -> dict[str, Any]:
        """What `gonio.fit(scan)` found beside the values: weighting, validation, verdict, models tried; else empty."""
        text = str(self.dataset.attrs["answer"])
        found: dict[str, Any] = json.loads(text) if text else {}
        return found

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
        """The coverage factor k: half the width of a confidence interval in standard uncertainties.

        k is the quantile at 0.5 + level/2 of Student's t with (points - effective values) degrees of freedom, because
        the noise is estimated from the residuals. For an absolute covariance it is that of the normal distribution, as
        the stated uncertainty is taken as exact. With less than one degree of freedom, one is assumed.
        Raises ValueError for a level that is not between 0 and 1.
        """
        if not 0 < level < 1:
            raise ValueError(f"the level of an interval lies between 0 and 1, and is {level:g}")
        if self.covariance_kind == "absolute":
            return float(normal(0.5 + level / 2))
        return float(student_t(max(self.dataset.attrs["points"] - self.effective_values, 1), 0.5 + level / 2))

    def intervals(self, level: float = 0.95) -> dict[str, tuple[float, float]]:
        """Confidence interval (low, high) of every free value, symmetric about it.

        Of random errors by the kind of covariance of the fit, and of every cause of systematic uncertainty that the
        scan states (`half_widths`). Infinite for a value that is not determined; held values have no interval.
        It takes the model as linear over its width and ignores bounds; `certainty.profile` does not.
        """
        halves = self.half_widths(level).tolist()
        return {
            name: (value - half, value + half)
            for (name, value), half in zip(self.values.items(), halves, strict=True)
            if not math.isnan(self.uncertainties[name])
        }

    def half_widths(self, level: float = 0.95) -> Values:
        """Half the width (n,) of the confidence interval of every value; NaN for held values.

        The root of the squares of two parts: the random standard uncertainty times `coverage_factor`, and the
        systematic one times the quantile of the normal distribution. Without a systematic one the first alone.
        """
        stored = self.dataset
        return self.expanded(stored["uncertainty"].values, stored["uncertainty_systematic"].values, level)

    def expanded(self, random: Values, systematic: Values, level: float = 0.95) -> Values:
        """The same for any numbers that follow from the values, by their two standard uncertainties (m,)."""
        second = np.where(np.isnan(systematic), 0.0, normal(0.5 + level / 2) * systematic)
        return np.hypot(self.coverage_factor(level) * random, second)

    @property
    def total_covariance(self) -> Values:
        """The covariance (n, n) of all values by random errors and every cause: C + sum_c p_c p_c'; NaN as C is."""
        shifts = self.dataset["shift_by_cause"].values
        known = np.nan_to_num(shifts, nan=0.0)
        return np.asarray(self.dataset["covariance"].values + known.T @ known)

    @property
    def causes(self) -> tuple[str, ...]:
        """The causes of systematic uncertainty that the scan names; empty where it names none."""
        names = tuple(map(str, self.dataset["cause"].values.tolist()))
        return () if names == (WHOLE,) else names

    def as_fitted(self, problem: Problem) -> Problem:
        """The problem that was fitted, with the strengths and scales of smooth parameters that the fit found.

        With them its residual and penalty are those of the fit, and no strength is searched again.
        """
        return replace(problem, smooth=self.smooth) if problem.smooth else problem

    def at(self, points: xr.Dataset) -> dict[str, float | Values]:
        """Every parameter by name at the directions of a flat scan, as a Model takes them.

        A number for a parameter with one value; an array (points,) for a grouped one, with the value of each
        direction's group. Raises ValueError where a direction belongs to no group of the fit.
        """
        values = self.dataset["value"].values
        return {
            name: values[place] if isinstance(place, np.ndarray) else float(values[place])
            for name, place in self.places(points).items()
        }

    def places(self, points: xr.Dataset) -> dict[str, int | Places]:
        """Indices along `parameter` of the values that `at` gives: one for each parameter, or one for each direction.

        Other vectors over `parameter`, such as values that are varied for a band of uncertainty, can so be looked up
        without finding the groups again.
        Raises ValueError where a direction belongs to no group of the fit.
        """
        places: dict[str, int | Places] = {}
        names = self.dataset["name"].values
        for name in dict.fromkeys(names.tolist()):
            rows = np.flatnonzero(names == name)
            by = str(self.dataset["by"].values[rows[0]])
            if not by:
                places[name] = int(rows[0])
                continue
            # By label, and not by value: labels have six digits, so 632.8 in a file and 632.80000001 are one group.
            table = dict(zip(self.dataset["group"].values[rows].tolist(), rows.tolist(), strict=True))
            if lacking := [c for c in by.split(",") if c not in points.coords]:
                raise ValueError(
                    f"{name} was fitted for {by} = {some(table)}; these directions have no {lacking[0]}: "
                    f"add it, as in predict(.., {lacking[0]}=..)"
                )
            labels, place = group_labels(points, by.split(","))
            if unknown := sorted(set(labels) - set(table)):
                raise ValueError(f"{name} was fitted for {by} = {some(table)}; there is none for {some(unknown)}")
            places[name] = np.array([table[label] for label in labels], dtype=np.intp)[place]
        return places

    def brdf(self, points: xr.Dataset) -> Values:
        """The fitted BRDF (points,) at the directions of a flat scan, as the instrument of the fit reads it.

        Raises ValueError where a direction belongs to no group of the fit.
        """
        parts = [points]
        if points.sizes["direction"] > TOGETHER:
            starts = range(0, points.sizes["direction"], TOGETHER)
            parts = [points.isel(direction=slice(start, start + TOGETHER)) for start in starts]
        # A generator: with an instrument an acceptance holds many directions for each point, and one is held at a time.
        acceptances = (Acceptance.of(self.instrument, part, self.model) for part in parts)
        brdf = [a.brdf(self.model, self.at(part)) for a, part in zip(acceptances, parts, strict=True)]
        return np.concatenate([np.broadcast_to(f, p.sizes["direction"]) for f, p in zip(brdf, parts, strict=True)])

    def components(self, points: xr.Dataset) -> dict[str, Values]:
        """Every weight times its term (points,), by the name of the weight; their sum is what `brdf` gives.

        Raises ValueError where a direction belongs to no group of the fit.
        """
        values = self.at(points)
        acceptance = Acceptance.of(self.instrument, points, self.model)
        basis = acceptance.basis(self.model, {n: value for n, value in values.items() if n in self.model.shape})
        return {weight: np.asarray(values[weight] * term, dtype=float) for weight, term in basis.items()}

    def parameters(self) -> dict[str, dict[str, Any]]:
        """Values, uncertainties and units as plain data, by parameter.

        A grouped parameter has the names of its coordinates under `by` and a record for each group under `values`.
        `uncertainty_systematic` is there if the scan stated it, `systematic` with the signed shift by each cause where
        the scan names causes, `held` for held parameters, and `at_bound` for values
        that lie on a bound of the fit, of which the uncertainty says nothing.
        """
        out: dict[str, dict[str, Any]] = {}
        columns = ["value", "uncertainty"] + ["uncertainty_systematic"] * self.has_systematic
        for name, part in self._by_name():
            rows = zip(*(part[n].values.tolist() for n in columns), strict=True)
            pinned = part["at_bound"].values.tolist()
            pairs = [
                dict(zip(columns, row, strict=True)) | ({"at_bound": True} if at else {})
                for row, at in zip(rows, pinned, strict=True)
            ]
            if self.causes and self.has_systematic:
                for pair, shifts in zip(pairs, part["shift_by_cause"].values.T.tolist(), strict=True):
                    pair["systematic"] = dict(zip(self.causes, shifts, strict=True))
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
        """The part of the Dataset of each parameter, without the variables that have other dimensions too."""
        names = self.dataset["name"].values
        flat = self.dataset.drop_dims(["parameter_b", "step", "draw", "direction"], errors="ignore")
        return [(n, flat.isel(parameter=np.flatnonzero(names == n))) for n in dict.fromkeys(names.tolist())]

    def with_scan(self, scan: xr.Dataset) -> "Solution":
        """The same solution with the points of the scan that it was fitted to, where it does not hold them.

        Its weights in E are those of the weighting, without g1, g2 and point_weights, which no Solution holds.
        However many they are, they are kept, and saved.
        Raises ValueError for a scan of another unit or number of points than the fit had.
        """
        points = scans.points(scan)
        count, fitted = points.sizes["direction"], int(self.dataset.attrs["points"])
        if count != fitted or scans.unit(scan) != self.unit:
            raise ValueError(
                f"the fit is of {fitted} points in {self.unit}, and this scan has {count} in {scans.unit(scan)}: "
                "give the scan that was fitted, or ask solution.predict(scan) for another"
            )
        weighting = WEIGHTINGS[self.dataset.attrs["weighting"]]
        weights = weighting.weights(points, self.dataset.attrs["noise_floor"])
        grouping = {c for by in self.dataset["by"].values.tolist() for c in by.split(",") if c}
        columns = points_columns(points, weights, grouping)
        old = [str(name) for name in self.dataset.data_vars if str(name).startswith(SCAN)]
        held = self.dataset.drop_vars(old).assign({name: ("direction", column) for name, column in columns.items()})
        return replace(self, dataset=held.assign_attrs(data_history=scan.attrs.get("history", "")))

    def save(self, path: str | Path, force: bool = False) -> None:
        """Write the solution as NetCDF in the classic format; FileExistsError where the file exists, without `force`.

        Of the model its name is written, and no formula.
        """
        from gonio.fitting.stored import save

        save(self.dataset, path, force)

    @classmethod
    def load(cls, path: str | Path, model: Model | None = None) -> "Solution":
        """Read what `save` wrote.

        model: the model that was fitted, for one that is not in the catalogue.
        Raises FormatError, with the byte offset, for a file that is damaged, holds no solution, or holds one of another
        model than that.
        """
        from gonio.fitting.stored import load

        return cls(*load(path, model))


def some(names: Iterable[str], most: int = 8) -> str:
    """The first of many names, and how many more there are."""
    listed = list(names)
    rest = f" and {len(listed) - most} more" if len(listed) > most else ""
    return ", ".join(listed[:most]) + rest


def labels_of(solution: Solution) -> dict[str, list[str]]:
    """The labels of each coordinate that values of a fit are grouped by, in their order."""
    labels: dict[str, dict[str, None]] = {}
    for by, group in zip(
        solution.dataset["by"].values.tolist(), solution.dataset["group"].values.tolist(), strict=True
    ):
        names = by.split(",") if by else []
        for name, label in zip(names, group.split(",", max(len(names) - 1, 0)), strict=False):
            labels.setdefault(name, {})[label] = None
    return {name: list(found) for name, found in labels.items()}
