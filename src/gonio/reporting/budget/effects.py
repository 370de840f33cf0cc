"""What each cause of uncertainty does to the fitted values: causes down, values across, as a budget of each value."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from gonio.fitting.solution import Solution
from gonio.measured.causes import total
from gonio.reduction.budget import RANDOM
from gonio.reduction.causes import declared
from gonio.reporting.blocks import Cell, Notes, Table, number
from gonio.results.values import AT_BOUND, HELD, Value, values
from gonio.units import unit_label

ACROSS = 5  # values of a fit in one table, which a page in A4 has room for
MOST_TABLES = 4
ROUNDING = 1e-9  # of the combined uncertainty: a shift that is smaller is what arithmetic leaves of none
WORDS = (
    "A shift is what one standard uncertainty of a cause moves a fitted value by. Its sign says which values move "
    "together; of a cause with several parts it is the root of the sum of squares, and has none. Combined is the root "
    "of the sum of squares over all rows above it, and U is 2 times that. A value at its bound is held there."
)


class Effect(NamedTuple):
    """A cause with the number of its parts, and its shift of each value (n,)."""

    cause: str
    parts: int
    shifts: npt.NDArray[np.float64]


def effect_blocks(solution: Solution) -> Iterator[object]:
    """A table of shifts for every few of the values of a fit; nothing for a fit of a scan that names no cause."""
    found = effects(solution)
    if not found:
        return
    listed = [(k, value) for k, value in enumerate(values(solution)) if value.status != HELD]
    groups = [listed[k : k + ACROSS] for k in range(0, len(listed), ACROSS)]
    for place, group in enumerate(groups[:MOST_TABLES], start=1):
        yield _table(found, group, place, len(groups))
    lines = [WORDS] * bool(listed)
    if len(groups) > MOST_TABLES:
        rest = len(listed) - ACROSS * MOST_TABLES
        lines.append(f"{rest} more values are not printed: solution.parameters() has the shifts of all.")
    yield Notes("effects-explained", lines, plain=True)


def effects(solution: Solution) -> list[Effect]:
    """The shift of every value by each cause, parts of one cause together; empty where the scan names no cause."""
    if not (solution.causes and solution.has_systematic):
        return []
    grouped: dict[str, list[npt.NDArray[np.float64]]] = {}
    for name, shifts in zip(solution.causes, solution.dataset["shift_by_cause"].values, strict=True):
        grouped.setdefault(declared(name).name, []).append(shifts)
    return [
        Effect(cause, len(parts), parts[0] if len(parts) == 1 else total(parts)) for cause, parts in grouped.items()
    ]


def _table(found: Sequence[Effect], group: Sequence[tuple[int, Value]], place: int, of: int) -> Table:
    heads = ["cause", *(_name(value) for _, value in group)]
    random = np.array([value.uncertainty for _, value in group])
    at = [k for k, _ in group]
    inside = [value.status != AT_BOUND for _, value in group]
    parts = [Effect(RANDOM, 1, random), *(Effect(one.cause, one.parts, one.shifts[at]) for one in found)]
    combined = total([one.shifts for one in parts])
    parts = [one._replace(shifts=np.where(np.abs(one.shifts) < ROUNDING * combined, 0.0, one.shifts)) for one in parts]
    rows = [
        _row("value", [value.value for _, value in group], [True] * len(group), 5),
        *(_row(one.cause + f" ({one.parts})" * (one.parts > 1), one.shifts, inside) for one in parts),
        _row("combined", combined, inside),
        _row("U, k = 2", 2 * combined, inside),
    ]
    caption = "What each cause does to the fitted values" + f" ({place} of {of})" * (of > 1)
    return Table(f"effects-{place}" if of > 1 else "effects", caption, heads, rows)


def _name(value: Value) -> str:
    name = f"{value.parameter}, {value.set}" if value.by else value.parameter
    return f"{name} [{unit_label(value.unit)}]" if value.unit not in ("", "1") else name


def _row(
    label: str, row: Sequence[float] | npt.NDArray[np.float64], inside: Sequence[bool], digits: int = 2
) -> list[Cell]:
    return [
        Cell(label),
        *(number(float(one), digits) if shown else Cell("–") for one, shown in zip(row, inside, strict=True)),
    ]
