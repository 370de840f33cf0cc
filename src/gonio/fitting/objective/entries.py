"""The values of a problem by parameter: which there are, how groups of directions are named, and what is held.

A parameter has one value for all points, or one for each group of points: with `ks` grouped by `theta_i` the values are
`ks[30]`, `ks[45]` and so on. The text in brackets is the group's label. A group of several coordinates joins theirs:
`ks[30,R]` for `theta_i` and `channel`. Groups are numbered in the order of their coordinates' values.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.door.text import clip
from gonio.geometry import Geometry
from gonio.measured import dataset
from gonio.measured.distinct import combined, distinct, first_of
from gonio.model import Model
from gonio.outside import html_table, printable, shortened
from gonio.units import unit_label

MOST_ROWS = 60  # of the table of a problem
LONGEST_LINE = 200  # characters of what a file says, in a line for people

Values = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]


@dataclass(frozen=True)
class Entry:
    """One parameter of a problem: a weight or a shape parameter, with one value or one a group of directions.

    by: the coordinates that tell its groups apart, none for a single value. labels: of the groups, `("",)` for a single
    value. group (points,): the place among the labels of each point's group. lower, upper: bounds of every value.
    unit: of the values. held: the value of every group where the parameter is not free; None where it is.
    """

    name: str
    is_weight: bool
    by: tuple[str, ...]
    labels: tuple[str, ...]
    group: Places
    lower: float
    upper: float
    unit: str
    held: tuple[float, ...] | None = None

    @property
    def size(self) -> int:
        """How many values the parameter has."""
        return len(self.labels)

    @property
    def names(self) -> tuple[str, ...]:
        """`ks`, or `ks[30]` where there is one value a group."""
        return tuple(f"{self.name}[{label}]" if label else self.name for label in self.labels)


def group_label(value: object) -> str:
    """The text that stands for a coordinate's value in the name of a group: six digits of a number, a name as it is.

    A user writes the same text in `held={"index": {"632.8": 1.37}}`.
    """
    return f"{value:g}" if isinstance(value, float) else str(value)


def labelled(values: npt.NDArray[Any]) -> tuple[tuple[str, ...], Places]:
    """The labels of a coordinate's values in their order, and each value's place among them.

    Numbers that agree in six digits have one label, and are one value. Labels are made of the distinct values alone,
    because there may be millions of points.
    """
    distinct_values, place = distinct(values)
    texts = [group_label(value) for value in distinct_values]
    labels = tuple(dict.fromkeys(texts))
    index = {text: at for at, text in enumerate(labels)}
    return labels, np.array([index[text] for text in texts], dtype=np.intp)[place]


def groups(points: xr.Dataset, by: tuple[str, ...]) -> tuple[tuple[str, ...], Places]:
    """The groups of a flat scan by some coordinates: their labels, and each point's place (points,) among them.

    Only combinations of values that some point has are groups. Without coordinates all points are one group.
    Raises ValueError for a coordinate that the scan does not have.
    """
    if not by:
        return ("",), np.zeros(points.sizes["direction"], dtype=np.intp)
    for coordinate in by:
        if coordinate not in points.coords:
            have = ", ".join(str(c) for c in points.coords)
            raise ValueError(f"the scan has no coordinate {coordinate!r} to group by; it has {have}")
    columns = [labelled(points[c].values) for c in by]
    group = combined([code for _, code in columns])
    rows = first_of(group)
    return tuple(",".join(names[code[row]] for names, code in columns) for row in rows), group


def group_labels(points: xr.Dataset, by: Sequence[str]) -> tuple[list[str], Places]:
    """The labels of the groups that a flat scan names, joined by commas, and each direction's place among them.

    For looking values of a fit up by label, where it does not matter how often a label occurs. Unlike in `groups`, two
    numbers that agree in six digits have two places, with the same label.
    """
    columns = [points[c].values for c in by]
    place = combined(columns)
    rows = zip(*(column[first_of(place)] for column in columns), strict=True)
    return [",".join(group_label(value) for value in row) for row in rows], place


def held_values(
    name: str, held: float | Mapping[str, float] | None, by: tuple[str, ...], labels: tuple[str, ...]
) -> tuple[float, ...] | None:
    """The held value of every group in the order of their labels; None for a parameter that is free.

    held: one value, or a value for each label; labels that no point has are ignored.
    Raises ValueError where a grouped parameter has one value, or where a group has none.
    """
    if held is None:
        return None
    if not isinstance(held, Mapping):
        if by:
            raise ValueError(f"{name} is held at one value and grouped by {', '.join(by)}: choose one")
        return (float(held),)
    if missing := [label for label in labels if label not in held]:
        grouping = f"grouped by {', '.join(by)}" if by else "not grouped"
        raise ValueError(
            f"{name} is {grouping} and held for {', '.join(held)}: there is none for {missing[0] or 'all'}"
        )
    return tuple(float(held[label]) for label in labels)


def shape_at_points(entries: Sequence[Entry], shape: Values) -> dict[str, Values | float]:
    """Each shape parameter's value at every point, shaped to broadcast against the directions.

    shape (..., n_shape): the free values of the shape, in the order of their entries.
    """
    values: dict[str, Values | float] = {}
    at = 0
    for entry in entries:
        if entry.is_weight:
            continue
        if entry.held is not None:
            values[entry.name] = entry.held[0] if entry.size == 1 else np.asarray(entry.held)[entry.group]
            continue
        part = shape[..., at : at + entry.size]
        values[entry.name] = part if entry.size == 1 else part[..., entry.group]
        at += entry.size
    return values


def designed(entries: Sequence[Entry], basis: Mapping[str, Values], form: tuple[int, ...]) -> tuple[Values, Values]:
    """The columns (..., points, n_weights) of the free weights, and what the held ones add (..., points).

    basis: every term by weight, which broadcasts to `form`, (..., points). A grouped weight has one column a group,
    zero outside it.
    """
    weights = [entry for entry in entries if entry.is_weight]
    size = sum(entry.size for entry in weights if entry.held is None)
    columns = np.zeros((*form[:-1], size, form[-1]))  # column by column, as LAPACK reads a matrix
    fixed = np.zeros(form)
    column = 0
    for entry in weights:
        if entry.held is not None:
            fixed += np.asarray(entry.held)[entry.group] * basis[entry.name]
            continue
        if entry.size == 1:
            columns[..., column, :] = basis[entry.name]
        else:
            columns[..., column + entry.group, np.arange(form[-1])] = basis[entry.name]  # in its group's column
        column += entry.size
    return np.swapaxes(columns, -1, -2), fixed


def summed(entries: Sequence[Entry], basis: Mapping[str, Values], vector: Values) -> Values:
    """The sum (points,) of every term times its weight, held ones too; vector (n,): the free weights come first."""
    at, total = 0, np.zeros(len(entries[0].group))
    for entry in entries:
        if not entry.is_weight:
            continue
        weights = vector[at : at + entry.size] if entry.held is None else np.asarray(entry.held)
        total += weights[entry.group] * basis[entry.name]
        at += entry.size if entry.held is None else 0
    return total


def described(model: Model, entries: Sequence[Entry], unit: str, weighting: str) -> str:
    """A problem in at most 300 characters: its model, how many points, and what becomes of every parameter."""
    of_parameters = []
    for entry in entries:
        held = "" if entry.held is None else f" held at {entry.held[0]:g}" if entry.size == 1 else " held"
        by = f" by {'+'.join(entry.by)}" if entry.by else ""
        of_parameters.append(f"{entry.name}{held}{by}")
    points = len(entries[0].group)
    return shortened(
        f"<Problem: {model.name} to {points} points in {unit}, {weighting} weighting; ", of_parameters, ">"
    )


def as_html(model: Model, entries: Sequence[Entry], points: xr.Dataset, weighting: str) -> str:
    """A problem as one element of HTML: its scan, and every parameter with its bounds, groups and held value."""
    first = str(points.attrs.get("history", "")).partition("\n")[0]
    angles = len(np.unique(points["theta_i"].values))
    free = sum(entry.size for entry in entries if entry.held is None)
    lines = [
        f"{model.name} ({model.title}) to {points.sizes['direction']} points at {angles} incidence angles, "
        f"in {unit_label(dataset.unit(points)) or '1'}",
        clip(first, LONGEST_LINE),
        f"{weighting} weighting, {free} free values",
    ]
    rows = [_row(entry) for entry in entries[:MOST_ROWS]]
    told = "".join(f"<div>{escape(printable(line))}</div>" for line in lines if line)
    table = html_table(("parameter", "in the fit", "one value for each", "lower", "upper", "unit"), rows)
    return f"<div>{told}{table}</div>"


def _row(entry: Entry) -> tuple[str, ...]:
    by = f"{'+'.join(entry.by)} ({entry.size})" if entry.by else ""
    if entry.held is None:
        return entry.name, "free", by, f"{entry.lower:g}", f"{entry.upper:g}", entry.unit
    at = f" at {entry.held[0]:g}" if entry.size == 1 else ""
    return entry.name, f"held{at}", by, "", "", entry.unit


SOMEWHERE = (30.0, 40.0, 170.0)  # deg; directions at which every model has a value


def refuse_bounds(name: str, bounds: tuple[float, float], is_held: bool, model: Model) -> None:
    """ValueError for bounds between which nothing can be searched, or which reach where the model has no value."""
    lower, upper = bounds
    if not lower <= upper:
        raise ValueError(f"the bounds of {name} are the wrong way round: {lower:g} to {upper:g}")
    if lower == upper and not is_held:
        raise ValueError(f"the bounds of {name} leave one value, {lower:g}: hold it there instead")
    if name in model.shape and not _has_value(model, name, lower):
        raise ValueError(f"the bounds of {name} begin at {lower:g}, where {model.name} has no value: begin above")


def _has_value(model: Model, name: str, value: float) -> bool:
    """Whether a model is defined for a shape value: a width of zero, for one, is a division by zero."""
    declared = model.shape[name]
    if declared.lower <= value <= declared.upper:
        return True
    if value < 0 <= declared.lower:
        return False
    with np.errstate(all="ignore"):
        terms = model.basis(Geometry.from_degrees(*SOMEWHERE), {name: value}).values()
    return all(bool(np.isfinite(term).all()) for term in terms)
