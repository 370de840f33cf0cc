"""The values that the sliders of a page have: checked, and by name for a curve, for all points, or for a fit.

What a page sends names a scan by its place, a model by its name in the catalogue, and a fit by its name in the session.
A parameter has one value for each of its groups: those of the fit, or without one a value of the shape for all, and a
weight for each block.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.objective.entries import group_label
from gonio.fitting.solution import Solution
from gonio.measured import dataset
from gonio.model import Model
from gonio.outside import nearest, printable
from gonio.viewing.fits import record
from gonio.viewing.session import Opened, Session

Values = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Group:
    """The groups of one parameter: the coordinates that tell them apart, their labels, and the group of each cell."""

    by: tuple[str, ...]
    labels: tuple[str, ...]
    cells: tuple[int, ...]


@dataclass(frozen=True)
class Sliders:
    """A model with the values of a page.

    place: of the scan in the session. groups, values: for each parameter of the model, values one for each label.
    fit: the fit whose groups these are, None without one. block, cell: which the page shows.
    """

    place: int
    opened: Opened
    model: Model
    groups: Mapping[str, Group]
    values: Mapping[str, tuple[float, ...]]
    fit: Solution | None
    block: int
    cell: int

    def at_cell(self, cell: int) -> dict[str, float]:
        """Every value by name that holds for a cell."""
        return {name: self.values[name][group.cells[cell]] for name, group in self.groups.items()}

    def at_points(self) -> dict[str, Values]:
        """Every value by name at the points of the columns (points,)."""
        first = np.append(self.opened.columns.first, self.opened.columns.points.sizes["direction"])
        repeats = np.diff(first)
        return {
            name: np.repeat(np.asarray(self.values[name])[list(group.cells)], repeats)
            for name, group in self.groups.items()
        }

    def by_label(self, name: str) -> dict[str, float]:
        """The values of a parameter by the labels of its groups, "" for one value."""
        return dict(zip(self.groups[name].labels, self.values[name], strict=True))

    @property
    def are_fitted(self) -> bool:
        """Whether they are those of the fit, so that its uncertainties are theirs."""
        if self.fit is None:
            return False
        data = self.fit.dataset
        fitted = {name: data["value"].values[data["name"].values == name] for name in self.groups}
        return all(np.array_equal(fitted[name], self.values[name]) for name in self.groups)


def sliders(session: Session, said: Mapping[str, Any]) -> Sliders:
    """The values that a page sent; ValueError for what the session or the model does not have."""
    place, opened = scan_of(session, said)
    cells = len(opened.columns.header["cells"])
    name = said.get("fit") or ""
    model = model_of(session, said)
    fit = None
    if name:
        if name not in opened.fits:
            raise ValueError(f"fit: {_said(name)} is none of the fits of this scan")
        fit = opened.fits[name]
        model = fit.model
    groups = _groups(opened, model, fit)
    given = said.get("values")
    if not isinstance(given, dict):
        raise ValueError("values: give an object with a list of numbers for each parameter")  # noqa: TRY004 - of JSON
    if unknown := [key for key in given if key not in groups]:
        raise ValueError(f"values: {model.name} has no parameter {_said(unknown[0])}; it has {', '.join(groups)}")
    values = {key: _numbers(model, key, given.get(key), len(group.labels)) for key, group in groups.items()}
    block = whole(said, "block", len(opened.columns.header["blocks"]))
    return Sliders(place, opened, model, groups, values, fit, block, whole(said, "cell", cells))


def scan_of(session: Session, said: Mapping[str, Any], key: str = "set") -> tuple[int, Opened]:
    """The scan that is named by its place."""
    place = whole(said, key, len(session.opened))
    return place, session.opened[place]


def model_of(session: Session, said: Mapping[str, Any]) -> Model:
    """The model of the catalogue that is named."""
    name = said.get("model")
    if not isinstance(name, str) or name not in session.models:
        raise ValueError(f"model: there is no model {_said(name)}; {nearest(str(name)[:100], session.models)}")
    return session.models[name]


def whole(said: Mapping[str, Any], key: str, count: int) -> int:
    """A place below `count`, 0 where none is given."""
    value = said.get(key, 0)
    if isinstance(value, bool) or not isinstance(value, int | float) or value != int(value) or not 0 <= value < count:
        raise ValueError(f"{key}: give a whole number from 0 to {count - 1}")
    return int(value)


def texts(said: Mapping[str, Any], key: str) -> list[str]:
    """A list of texts, empty where none is given."""
    value = said.get(key, [])
    if not isinstance(value, list) or not all(isinstance(one, str) for one in value):
        raise ValueError(f"{key}: give a list of names")
    return value


def chosen(said: Mapping[str, Any], key: str, names: Sequence[str]) -> str:
    """One of some names, the first where none is given."""
    value = said.get(key, names[0])
    if value not in names:
        raise ValueError(f"{key}: {_said(value)} is none of {', '.join(names)}")
    return str(value)


def _said(value: Any) -> str:
    return repr(printable(str(value)[:60]))


def _numbers(model: Model, name: str, given: Any, count: int) -> tuple[float, ...]:
    if not isinstance(given, list) or len(given) != count:
        raise ValueError(f"values: {name} has {count} value{'s' if count > 1 else ''}: give a list of so many")
    lower, upper = (0.0, math.inf) if name in model.weights else (model.shape[name].lower, model.shape[name].upper)
    for value in given:
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
            raise ValueError(f"values: {name} must be finite numbers")
        if not lower <= value <= upper:
            raise ValueError(f"values: {name} is {value:g}, outside its bounds {lower:g} to {upper:g}")
    return tuple(float(value) for value in given)


def _groups(opened: Opened, model: Model, fit: Solution | None) -> dict[str, Group]:
    cells = opened.columns.header["cells"]
    if fit is not None:
        parameters = record(fit, opened.columns)["parameters"]
        return {
            p["name"]: Group(tuple(filter(None, p["by"].split(","))), tuple(p["labels"]), tuple(p["cells"]))
            for p in parameters
        }
    by = tuple(opened.columns.header["by"])
    labels = tuple(",".join(group_label(block[n]) for n in by) for block in opened.columns.header["blocks"])
    of_blocks = Group(by, labels, tuple(cell["block"] for cell in cells))
    of_all = Group((), ("",), (0,) * len(cells))
    return {name: of_blocks if name in model.weights else of_all for name in model.parameters}


def part_of(opened: Opened, block: int) -> xr.Dataset:
    """The rows of one block."""
    header = opened.columns.header
    return dataset.select(opened.scan, header["blocks"][block]) if header["by"] else opened.scan
