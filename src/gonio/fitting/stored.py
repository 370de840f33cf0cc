"""A Solution in a file: written as NetCDF's classic format, and checked against the schema when it is read.

The classic format is the one that SciPy writes, so that saving needs no further library. It has no type for true and
false: these become 0 and 1. A file is NetCDF, so other programs can read it; `content` says that it is a solution.

What is read may be damaged or made by anyone. `netcdf.read` guards against bytes that are no NetCDF. This file guards
against content that no fit could have written, because the methods of a Solution rely on what `schema` promises: names
that the model has, labels that belong to groups, known words, finite sizes. Everything is refused in one line that
gives the byte offset of the variable at fault. Nothing is repaired or guessed.
"""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from gonio.door import netcdf
from gonio.door.text import clip, head
from gonio.files import FormatError, replacing
from gonio.fitting.covariance_kinds import COVARIANCES
from gonio.fitting.objective.smooth import Smooth
from gonio.fitting.objective.weighting import WEIGHTINGS
from gonio.fitting.schema import ATTRIBUTES, COORDINATES, OF_POINTS, SCAN, SOLUTION, VARIABLES, Variable
from gonio.fitting.status import Status
from gonio.measured.causes import CAUSE
from gonio.measured.dataset import DIRECTIONS, HORIZON, UNITS
from gonio.measured.instrument import Instrument
from gonio.model import Model

SOLUTION_FILE = "solution.nc"  # of a folder that `gonio fit --out` wrote
NUMBERS = (*DIRECTIONS, "wavelength")  # coordinates whose groups have numbers as labels
SOLUTION_FILE = "solution.nc"  # of a folder that `gonio fit --out` wrote
HEAD = 8  # bytes: the longest of the signatures by which a NetCDF file is known
LARGEST = 1e100  # larger values or counts are damage, and overflow in the formulas of models
SMALLEST_SHARE = (
    1e-9  # of a parameter's lower bound, if that is positive; a fit's own bounds may lie below the declared
)


def save(dataset: xr.Dataset, path: str | Path, force: bool = False) -> None:
    """Write the Dataset of a solution; FileExistsError where the file exists and `force` is False.

    The file appears whole or not at all: it is written under a temporary name and renamed.
    """
    booleans = [name for name, variable in VARIABLES.items() if variable.kind == "b"]
    numeric = dataset.assign({name: dataset[name].astype("int8") for name in booleans})
    with replacing(path, force) as temporary:
        numeric.to_netcdf(temporary, engine="scipy", format="NETCDF3_64BIT")  # offsets of 64 bits: files beyond 2 GiB


def is_solution(path: Path) -> bool:
    """Whether a file is NetCDF with the attribute `content`, which solutions have and scans do not.

    The content itself is not checked. Raises FormatError where the file is NetCDF and damaged.
    """
    if not path.is_file() or not netcdf.is_netcdf(head(path, HEAD)):
        return False
    return netcdf.CONTENT in netcdf.read(path)[0].attrs


def load(path: str | Path, model: Model | None = None) -> tuple[xr.Dataset, Model]:
    """The Dataset of a solution, checked and with the types of the schema, and its model.

    model: the one that was fitted; without it the one of that name in the catalogue.
    Raises FormatError for a path that is no file, and, with the byte offset, for a file that is damaged or holds no
    solution, or the solution of another model.
    """
    path = Path(path)
    if not netcdf.is_netcdf(head(path, HEAD)):
        raise FormatError(path, "is no solution of a fit, as gonio fit --out and Solution.save write it", "byte 0")
    stored, places = netcdf.read(path)
    return _Stored(path, stored, places).checked(model)


class _Stored:
    """The content of a file that should hold a solution, as it was read, with the checks of it.

    places: the byte at which the values of each variable begin, empty for files that are not of the classic format.
    """

    def __init__(self, path: Path, stored: xr.Dataset, places: Mapping[str, int]) -> None:
        self.path, self.stored, self.places = path, stored, dict(places)

    def refuse(self, fault: str, name: str = "") -> FormatError:
        """The error to raise for a fault of the variable `name`, or without one for a fault of the file's header."""
        return FormatError(self.path, fault, f"byte {self.places.get(name, 0)}")

    def checked(self, model: Model | None) -> tuple[xr.Dataset, Model]:
        """The Dataset with the types of the schema, and the model; FormatError for the first fault.

        First that everything is there and of its type, then what it says: each check relies on those before it.
        """
        if str(self.stored.attrs.get(netcdf.CONTENT)) != SOLUTION:
            raise self.refuse("holds no solution of a fit: its attribute content does not say so")
        attrs = {netcdf.CONTENT: SOLUTION} | {name: self._attribute(name) for name in ATTRIBUTES}
        columns = {n: self._variable(n, v) for n, v in VARIABLES.items() if n in self.stored or not v.optional}
        named = {**COORDINATES, CAUSE: Variable((CAUSE,), "U", "the causes of systematic uncertainty")}
        coords = {name: self._variable(name, variable) for name, variable in named.items()}
        fitted_model = self._model(str(attrs["model"]), model)
        self._refuse_strange_attributes(attrs)
        dataset = xr.Dataset(columns | self._points(attrs["points"]), coords=coords, attrs=attrs)
        self._refuse_strange_values(dataset, fitted_model)
        return dataset, fitted_model

    def _attribute(self, name: str) -> Any:
        """An attribute in its type of the schema; FormatError where it is absent or of another type.

        Also where it has a default: a solution that was saved has every attribute.
        """
        kind, _ = ATTRIBUTES[name]
        if name not in self.stored.attrs:
            raise self.refuse(f"has no attribute {name}: fit again, and save the solution")
        value = self.stored.attrs[name]
        try:
            if isinstance(value, str) is not (kind is str):  # str() takes any number, and float() the text "1"
                raise ValueError
            return kind(value)
        except (ValueError, TypeError, OverflowError):  # an array has no one number, and int() takes no NaN or infinity
            fault = f"the attribute {name} is {clip(str(value))!r}, not {'text' if kind is str else 'a number'}"
            raise self.refuse(fault) from None

    def _points(self, count: int) -> dict[str, Any]:
        """What the file holds of the points that were fitted, `count` of them; nothing where it holds none."""
        found = [str(name) for name in self.stored.variables if str(name).startswith(SCAN)]
        if not found:
            return {}
        columns = {name: self._variable(name, v) for name, v in OF_POINTS.items() if name in found or not v.optional}
        for name in (n for n in found if n not in OF_POINTS):
            kind = "f" if self.stored[name].dtype.kind in "fiu" else "U"
            columns[name] = self._variable(name, Variable(("direction",), kind, "a coordinate of the points"))
        if any(len(column[1]) != count for column in columns.values()):
            raise self.refuse(f"{found[0]} holds not one value for each of the {count} points", found[0])
        for name in (f"{SCAN}brdf", f"{SCAN}weight", *(f"{SCAN}{n}" for n in NUMBERS)):
            if name in columns:
                self._refuse_strange_points(name, columns[name][1])
        return columns

    def _refuse_strange_points(self, name: str, values: np.ndarray) -> None:
        """FormatError for values of the fitted points that no fit takes."""
        if values.dtype.kind != "f" or not (np.abs(values) < LARGEST).all():
            raise self.refuse(f"{name} holds what is no number of a scan", name)
        if name.startswith(f"{SCAN}theta") and not ((values >= 0) & (values <= HORIZON)).all():
            raise self.refuse(f"{name} is outside 0 to 90 deg", name)
        if name == f"{SCAN}weight" and (values < 0).any():
            raise self.refuse(f"{name} is below zero", name)

    def _variable(self, name: str, declared: Variable) -> tuple[tuple[str, ...], np.ndarray, dict[str, Any]]:
        """A variable as a Dataset takes it: dimensions, values in the type of the schema, attributes."""
        if name not in self.stored.variables:
            raise self.refuse(f"has no variable {name}, which every solution has")
        variable = self.stored[name]
        if variable.dims != declared.dims:
            dims = ", ".join(map(str, variable.dims)) or "none"
            raise self.refuse(f"{name} has the dimensions {dims}, not {', '.join(declared.dims)}", name)
        if declared.kind == "U":
            return declared.dims, netcdf.text(self.path, variable, self.places).values, {}
        values = variable.values
        if values.dtype.kind not in "fiu":
            raise self.refuse(f"{name} is not an array of numbers", name)
        if declared.kind == "b" and not np.isin(values, (0, 1)).all():
            raise self.refuse(f"{name} holds other values than 0 and 1", name)
        return declared.dims, values.astype(bool if declared.kind == "b" else float), dict(variable.attrs)

    def _model(self, name: str, model: Model | None) -> Model:
        """The model that was fitted: `model` if that has the name, or without it the catalogue's of that name."""
        if model is not None:
            if model.name != name:
                raise self.refuse(f"is a fit of {clip(name)!r}, not of {model.name}")
            return model
        from gonio.models import catalogue

        if name not in catalogue:
            raise self.refuse(
                f"is a fit of {clip(name)!r}, which is not in the catalogue: give it, as in Solution.load(path, model)"
            )
        return catalogue[name]

    def _refuse_strange_attributes(self, attrs: Mapping[str, Any]) -> None:
        """FormatError for words that no fit writes, and for numbers that no fit has.

        The smooth parameters and the instrument are made here once, as `Solution.smooth` and `Solution.instrument` make
        them later: their own checks then raise no bare ValueError far from the file.
        """
        known: dict[str, list[str]] = {
            "status": list(Status),
            "covariance": ["", *COVARIANCES],
            "weighting": list(WEIGHTINGS),
            "unit": list(UNITS),
        }
        for name, words in known.items():
            if attrs[name] not in words:
                raise self.refuse(f"the attribute {name} is {clip(str(attrs[name]))!r}, not one of {', '.join(words)}")
        # Written so that NaN is refused: every comparison with it is false.
        if not (0 <= attrs["points"] < LARGEST and 0 <= attrs["effective_values"] < LARGEST):
            raise self.refuse("the number of points or of values is not one that a fit can have")
        self._parsed("answer", lambda: _refuse_strange_answer(attrs["answer"]))
        self._parsed("smooth", lambda: [Smooth.parsed(text.partition("=")[2]) for text in attrs["smooth"].split()])
        cones = {name.removeprefix("instrument_"): attrs[name] for name in attrs if name.startswith("instrument_")}
        cones.pop("error")
        self._parsed("instrument_step", lambda: Instrument(**cones))

    def _parsed(self, name: str, parse: Callable[[], Any]) -> None:
        """FormatError that names an attribute where `parse` raises ValueError."""
        try:
            parse()
        except ValueError as error:
            raise self.refuse(f"the attribute {name} cannot be read ({clip(str(error), 100)})") from None

    def _refuse_strange_values(self, dataset: xr.Dataset, model: Model) -> None:
        """FormatError for names that the model does not have, impossible groups, and values that no fit gives."""
        names, by, group = (dataset[n].values.tolist() for n in ("name", "by", "group"))
        if not set(names) == set(model.parameters):
            raise self.refuse(f"its parameters are not those of {model.name}", "name")
        full = [f"{name}[{label}]" if label else name for name, label in zip(names, group, strict=True)]
        if full != dataset["parameter"].values.tolist() or len(set(full)) < len(full):
            raise self.refuse("a parameter is not its name and group in brackets, or occurs twice", "parameter")
        for name, coordinates, label in zip(names, by, group, strict=True):
            labels = label.split(",", coordinates.count(","))  # the last may hold commas of its own
            if len(labels) != len(coordinates.split(",")) or bool(label) is not bool(coordinates):
                fault = f"the group {clip(label)!r} of {clip(name)} needs one label for each of {clip(coordinates)!r}"
                raise self.refuse(fault, "group")
            if not all(
                _is_number(part) for c, part in zip(coordinates.split(","), labels, strict=True) if c in NUMBERS
            ):
                fault = f"the group {clip(label)!r} of {clip(name)} by {clip(coordinates)} holds a text for a number"
                raise self.refuse(fault, "group")
        value = dataset["value"].values
        # NaN is allowed: a lane without points for a group has no value there.
        if not (np.isnan(value) | (np.abs(value) < LARGEST)).all():
            raise self.refuse("a value is larger than any that a fit gives", "value")
        # Weights are not checked, as a problem may give them bounds below zero.
        for k, name in enumerate(names):
            if name not in model.shape:
                continue
            lower = model.shape[name].lower
            if lower >= 0 and value[k] < 0:
                raise self.refuse(f"{name} is {value[k]:g}, below zero", "value")
            if lower > 0 and value[k] < SMALLEST_SHARE * lower:
                raise self.refuse(f"{name} is {value[k]:g}, too near to zero for {model.name}", "value")
        if (dataset["uncertainty"].values < 0).any():
            raise self.refuse("an uncertainty is below zero", "uncertainty")


def _refuse_strange_answer(text: str) -> None:
    """ValueError for what is neither empty nor a JSON object with all that is read of `Solution.answer`."""
    if not text:
        return
    try:
        found = json.loads(text)
        words, tried, left_out = found["verdict"]["words"], found["tried"], found["contradicted"]
        counts = [one["points"] for one in left_out]
    except (KeyError, TypeError, RecursionError) as error:
        raise ValueError("it is no answer of a fit") from error
    if not (isinstance(words, str) and isinstance(tried, list) and all(type(count) is int for count in counts)):
        raise ValueError("it is no answer of a fit")


def _is_number(text: str) -> bool:
    """Whether a text is a finite number; float() also reads `nan` and `inf`, which are no angles."""
    try:
        return bool(np.isfinite(float(text)))
    except ValueError:
        return False
