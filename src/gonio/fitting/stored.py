"""A Solution in a file: written as NetCDF's classic format, and checked against the schema when it is read."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.door import netcdf
from gonio.door.text import clip
from gonio.files import FormatError, replacing
from gonio.fitting.covariance_kinds import COVARIANCES
from gonio.fitting.objective.smooth import Smooth
from gonio.fitting.objective.weighting import WEIGHTINGS
from gonio.fitting.schema import ATTRIBUTES, COORDINATES, SOLUTION, VARIABLES, Variable
from gonio.fitting.status import Status
from gonio.measured.dataset import ABSOLUTE, DIRECTIONS, RELATIVE
from gonio.measured.instrument import Instrument
from gonio.model import Model

NUMBERS = (*DIRECTIONS, "wavelength")  # coordinates of groups whose labels are numbers
HEAD = 8  # bytes that tell what a file is
LARGEST = 1e100  # a value or point count beyond is damage: no arithmetic of a model stands it


def save(dataset: xr.Dataset, path: str | Path, force: bool = False) -> None:
    """Write the Dataset of a solution; FileExistsError where the file is there and `force` is False."""
    truths = [name for name, variable in VARIABLES.items() if variable.kind == "b"]
    plain = dataset.assign({name: dataset[name].astype("int8") for name in truths})
    with replacing(path, force) as temporary:
        plain.to_netcdf(temporary, engine="scipy", format="NETCDF3_64BIT")


def is_solution(path: Path) -> bool:
    """Whether a file says that it holds a solution; FormatError where it is NetCDF and damaged."""
    if not path.is_file():
        return False
    with path.open("rb") as file:
        if not netcdf.is_netcdf(file.read(HEAD)):
            return False
    return netcdf.CONTENT in netcdf.read(path)[0].attrs


def load(path: str | Path, model: Model | None = None) -> tuple[xr.Dataset, Model]:
    """The Dataset of a solution and its model: the one of that name in the catalogue, unless it is given.

    Raises FormatError, with the byte offset, for a file that is damaged or holds no solution.
    """
    path = Path(path)
    if not path.exists():
        raise FormatError(path, "there is no such file")
    if not path.is_file():
        raise FormatError(path, "is a directory: name a file in it" if path.is_dir() else "is not a regular file")
    with path.open("rb") as file:
        if not netcdf.is_netcdf(file.read(HEAD)):
            raise FormatError(path, "is no solution of a fit, as gonio fit --out and Solution.save write it", "byte 0")
    stored, places = netcdf.read(path)
    return _Stored(path, stored, places).checked(model)


class _Stored:
    """The content of a file that should hold a solution, and what is wrong with it."""

    def __init__(self, path: Path, stored: xr.Dataset, places: Mapping[str, int]) -> None:
        self.path, self.stored, self.places = path, stored, dict(places)

    def refuse(self, what: str, name: str = "") -> FormatError:
        """The error to raise for what is wrong with a variable, or with the header."""
        return FormatError(self.path, what, f"byte {self.places.get(name, 0)}")

    def checked(self, model: Model | None) -> tuple[xr.Dataset, Model]:
        """The Dataset with the types of the schema; FormatError for the first thing that is not as it must be."""
        if str(self.stored.attrs.get(netcdf.CONTENT)) != SOLUTION:
            raise self.refuse("holds no solution of a fit: its attribute content does not say so")
        attrs = {netcdf.CONTENT: SOLUTION} | {name: self._attribute(name) for name in ATTRIBUTES}
        columns = {n: self._variable(n, v) for n, v in VARIABLES.items() if n in self.stored or not v.optional}
        coords = {name: self._variable(name, variable) for name, variable in COORDINATES.items()}
        found = xr.Dataset(columns, coords=coords, attrs=attrs)
        known = self._model(str(attrs["model"]), model)
        self._refuse_strange_attributes(attrs)
        self._refuse_strange_values(found, known)
        return found, known

    def _attribute(self, name: str) -> Any:
        kind, _ = ATTRIBUTES[name]
        if name not in self.stored.attrs:
            raise self.refuse(f"has no attribute {name}: fit again, and save the solution")
        value = self.stored.attrs[name]
        try:
            if isinstance(value, str) is not (kind is str):
                raise ValueError
            return kind(value)
        except (ValueError, TypeError, OverflowError):
            what = f"the attribute {name} is {clip(str(value))!r}, not {'text' if kind is str else 'a number'}"
            raise self.refuse(what) from None

    def _variable(self, name: str, declared: Variable) -> tuple[tuple[str, ...], np.ndarray, dict[str, Any]]:
        if name not in self.stored.variables:
            raise self.refuse(f"has no variable {name}: this is no whole solution")
        variable = self.stored[name]
        if variable.dims != declared.dims:
            raise self.refuse(f"{name} stands along {', '.join(map(str, variable.dims))}", name)
        if declared.kind == "U":
            return declared.dims, netcdf.text(self.path, variable, self.places).values, {}
        values = variable.values
        if values.dtype.kind not in "fiu":
            raise self.refuse(f"{name} is no array of numbers", name)
        if declared.kind == "b" and not np.isin(values, (0, 1)).all():
            raise self.refuse(f"{name} holds something else than 0 and 1", name)
        return declared.dims, values.astype(bool if declared.kind == "b" else float), dict(variable.attrs)

    def _model(self, name: str, given: Model | None) -> Model:
        if given is not None:
            if given.name != name:
                raise self.refuse(f"is a fit of {clip(name)!r}, not of {given.name}")
            return given
        from gonio.models import catalogue

        if name not in catalogue:
            raise self.refuse(
                f"is a fit of {clip(name)!r}, which the catalogue does not have: Solution.load(path, model) takes it"
            )
        return catalogue[name]

    def _refuse_strange_attributes(self, attrs: Mapping[str, Any]) -> None:
        """FormatError for words that no fit writes, and for numbers that none has."""
        known: dict[str, list[str]] = {
            "status": list(Status),
            "covariance": ["", *COVARIANCES],
            "weighting": list(WEIGHTINGS),
            "unit": [ABSOLUTE, RELATIVE],
        }
        for name, words in known.items():
            if attrs[name] not in words:
                raise self.refuse(f"the attribute {name} is {clip(str(attrs[name]))!r}, none of {', '.join(words)}")
        if not (0 <= attrs["points"] < LARGEST and 0 <= attrs["effective_values"] < LARGEST):
            raise self.refuse("the number of points, or of values, is none")
        self._parsed("smooth", lambda: [Smooth.parsed(text.partition("=")[2]) for text in attrs["smooth"].split()])
        cones = {name.removeprefix("instrument_"): attrs[name] for name in attrs if name.startswith("instrument_")}
        cones.pop("error")
        self._parsed("instrument_step", lambda: Instrument(**cones))

    def _parsed(self, name: str, parse: Callable[[], Any]) -> None:
        try:
            parse()
        except ValueError as error:
            raise self.refuse(f"the attribute {name} cannot be read ({clip(str(error), 100)})") from None

    def _refuse_strange_values(self, found: xr.Dataset, model: Model) -> None:
        """FormatError for names that the model does not have, groups without sense, and values that no fit gives."""
        names, by, group = (found[n].values.tolist() for n in ("name", "by", "group"))
        if not set(names) == set(model.parameters):
            raise self.refuse(f"its parameters are not those of {model.name}", "name")
        full = [f"{name}[{label}]" if label else name for name, label in zip(names, group, strict=True)]
        if full != found["parameter"].values.tolist() or len(set(full)) < len(full):
            raise self.refuse("names, groups and parameters do not belong together", "parameter")
        for name, coordinates, label in zip(names, by, group, strict=True):
            labels = label.split(",", coordinates.count(","))  # the last may hold commas of its own
            if len(labels) != len(coordinates.split(",")) or bool(label) is not bool(coordinates):
                raise self.refuse(f"a group of {clip(name)} is {clip(label)!r} by {clip(coordinates)!r}", "group")
            if not all(
                _is_number(part) for c, part in zip(coordinates.split(","), labels, strict=True) if c in NUMBERS
            ):
                raise self.refuse(f"a group of {clip(name)} by {clip(coordinates)} is {clip(label)!r}", "group")
        value = found["value"].values
        if not (np.isnan(value) | (np.abs(value) < LARGEST)).all():
            raise self.refuse("a value is beyond any that a fit gives", "value")
        for k, name in enumerate(names):
            if name in model.shape and model.shape[name].lower >= 0 and value[k] < 0:
                raise self.refuse(f"{name} is {value[k]:g}, below zero", "value")
        if (found["uncertainty"].values < 0).any():
            raise self.refuse("an uncertainty is below zero", "uncertainty")


def _is_number(text: str) -> bool:
    try:
        return bool(np.isfinite(float(text)))
    except ValueError:
        return False
