"""The values of a fit as tables, whatever their number."""

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from gonio.app.output import figure, table, uncertain
from gonio.units import unit_label

if TYPE_CHECKING:
    from rich.table import Table

    from gonio.comparison import Row
    from gonio.fitting.solution import Solution

MOST_GROUPS = 6  # values of a parameter that are listed under each other; more are columns beside other parameters
COLUMNS_A_TABLE = 3
COORDINATE_UNITS = {"theta_i": "deg", "theta_r": "deg", "phi": "deg", "wavelength": "nm"}


def solution_tables(solution: "Solution") -> "Iterator[Table]":
    """Every value with its uncertainty; parameters of many groups in tables of one row a group."""
    parameters = solution.parameters()
    parts = "random ± systematic" if solution.has_systematic else "standard uncertainty"
    long = {name: p for name, p in parameters.items() if len(p.get("values", ())) > MOST_GROUPS}
    if len(long) < len(parameters):
        yield _listed({name: p for name, p in parameters.items() if name not in long}, parts)
    for by in dict.fromkeys(p["by"] for p in long.values()):
        names = [name for name, p in long.items() if p["by"] == by]
        for start in range(0, len(names), COLUMNS_A_TABLE):
            yield _by_group(by, {name: long[name] for name in names[start : start + COLUMNS_A_TABLE]})


def _listed(parameters: Mapping[str, Any], parts: str) -> "Table":
    out = table("parameter", f"value ± {parts}", "unit", left=1)
    for name, p in parameters.items():
        values = {f"{name}[{group}]": value for group, value in p["values"].items()} if "by" in p else {name: p}
        for full, value in values.items():
            out.add_row(full, _stated(value), unit_label(p["unit"]))
    out.columns[2].justify = "left"
    return out


def _by_group(by: str, parameters: Mapping[str, Any]) -> "Table":
    coordinates = [_with_unit(name, COORDINATE_UNITS.get(name, "")) for name in by.split(",")]
    heads = [_with_unit(name, unit_label(p["unit"])) for name, p in parameters.items()]
    out = table(*coordinates, *heads, left=len(coordinates))
    for group in next(iter(parameters.values()))["values"]:
        values = [p["values"][group] for p in parameters.values()]
        out.add_row(*group.split(","), *map(_stated, values))
    return out


def _stated(found: Mapping[str, float]) -> str:
    if found.get("at_bound"):
        return f"{figure(found['value'])} (at its bound)"
    return uncertain(found["value"], found["uncertainty"], found.get("uncertainty_systematic", math.nan))


def _with_unit(name: str, unit: str) -> str:
    return f"{name} [{unit}]" if unit else name


def smooth_lines(row: "Row") -> Iterator[str]:
    """What is held smooth and how strongly, and how many values that leaves; nothing where nothing is."""
    for name, one in row.solution.smooth.items():
        yield f"{name} is smooth over {one.by}, strength {figure(float(one.strength))}"
    if row.solution.smooth:
        yield f"that leaves {row.effective_values:.1f} of {row.free_parameters} values"
