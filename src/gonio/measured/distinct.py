"""Which values and directions are equal, among millions in seconds."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Places = npt.NDArray[np.intp]


def distinct(values: npt.NDArray[Any]) -> tuple[npt.NDArray[Any], Places]:
    """The distinct values in their order and each value's place among them, as NumPy's unique gives them.

    Quick where equal values follow each other, as the names of channels do: only the runs are sorted.
    """
    values = np.asarray(values).ravel()
    starts = np.flatnonzero(np.concatenate([[True], values[1:] != values[:-1]]))[: len(values)]
    found, place = np.unique(values[starts], return_inverse=True)
    return found, np.repeat(place.ravel(), np.diff(starts, append=len(values)))


def distinct_rows(columns: Sequence[npt.NDArray[Any]]) -> tuple[Places, Places]:
    """The first place of every distinct row of some columns, and each row's own among these.

    They are in no order that means anything, but always in the same one: rows are sorted by a number of 64 bits that is
    mixed from their values, and compared with the row found. NaN equals NaN.
    """
    plain = [np.asarray(column) if column.dtype.kind in "iuf" else distinct(column)[1] for column in columns]
    mixed = np.zeros(len(plain[0]), dtype=np.uint64)
    for column in plain:
        numbers = column.astype(float) + 0.0  # zero has one sign, and so one pattern of bits
        numbers[np.isnan(numbers)] = np.nan
        mixed = _mixed(mixed ^ numbers.view(np.uint64))
    order = np.argsort(mixed)
    in_order = mixed[order]
    begins = np.concatenate([[True], in_order[1:] != in_order[:-1]])[: len(order)]
    place = np.empty(len(order), dtype=np.intp)
    place[order] = np.cumsum(begins) - 1
    first = first_of(place)
    if all(_alike(column[order])[~begins[1:]].all() for column in plain):
        return first, place
    whole = np.column_stack(
        [distinct(column)[1] for column in plain]
    )  # two rows of one number: once in a million scans
    _, first, place = np.unique(whole, axis=0, return_index=True, return_inverse=True)
    return first, place.ravel()


def combined(columns: Sequence[npt.NDArray[Any]]) -> Places:
    """Each row's place among the distinct rows of some columns, in the order of these; quick for runs of equal rows."""
    place = distinct(columns[0])[1]
    for column in columns[1:]:
        found, code = distinct(column)
        place = distinct(place * len(found) + code)[1]
    return place


def distinct_in_groups(columns: Sequence[npt.NDArray[Any]], group: Places) -> Places:
    """Each row's place among the distinct rows of some columns and the groups 0, 1, .. together."""
    if not (size := repeats(columns, group)):
        return distinct_rows([*columns, group])[1]
    place = distinct_rows([column[:size] for column in columns])[1]
    return group * (int(place.max()) + 1) + np.tile(place, len(group) // size)


def repeats(columns: Sequence[npt.NDArray[Any]], group: Places) -> int:
    """The length of one list of rows that every group repeats in its order, one group after the other; 0 where none.

    So the channels of a file repeat their directions.
    """
    rows = len(group)
    size = int(np.argmax(group != group[0])) or rows if rows else 0
    if not size or rows % size:
        return 0
    each = group.reshape(-1, size)
    alike = len(np.unique(each[:, 0])) == len(each) and (each == each[:, :1]).all()
    alike = alike and all((c.reshape(-1, size)[1:] == c[:size]).all() for c in columns)
    return size if alike else 0


def _alike(values: npt.NDArray[Any]) -> npt.NDArray[np.bool_]:
    """Whether each value equals the one before it."""
    alike: npt.NDArray[np.bool_] = values[1:] == values[:-1]
    return alike | ((values[1:] != values[1:]) & (values[:-1] != values[:-1]))


def _mixed(bits: npt.NDArray[np.uint64]) -> npt.NDArray[np.uint64]:
    """Every bit of the outcome depends on every bit given (steele2014)."""
    for shift, factor in ((30, 0xBF58476D1CE4E5B9), (27, 0x94D049BB133111EB)):
        bits = (bits ^ (bits >> np.uint64(shift))) * np.uint64(factor)
    mixed: npt.NDArray[np.uint64] = bits ^ (bits >> np.uint64(31))
    return mixed + np.uint64(0x9E3779B97F4A7C15)


def first_of(place: Places) -> Places:
    """Where each of the distinct values stands first, from the places that every one of 0, 1, .. is in."""
    first = np.empty(int(place.max(initial=-1)) + 1, dtype=np.intp)
    first[place[::-1]] = np.arange(len(place))[::-1]  # of several that are written to one place the last stays
    return first
