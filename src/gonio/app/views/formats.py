"""The file formats as a table and as plain data, read from their declarations."""

from typing import TYPE_CHECKING, Any

from gonio.app import output
from gonio.formats import formats
from gonio.formats.format import Format

if TYPE_CHECKING:
    from rich.table import Table

YES, NO = "yes", "–"


def records() -> list[dict[str, Any]]:
    """Every format's declaration as plain data."""
    return [record(f) for f in formats().values()]


def record(one: Format) -> dict[str, Any]:
    """One format's declaration as plain data."""
    holds = one.holds
    return {
        "name": one.name,
        "title": one.title,
        "suffix": one.suffix,
        "read": True,
        "write": one.write is not None,
        "grid": one.layout is not None,
        "out_of_plane": holds.azimuths,
        "turned_surface": holds.anisotropic,
        "transmission": holds.transmission,
        "relative": holds.relative,
        "gaps": holds.gaps or (one.layout is None and one.write is not None),
        "sets": list(holds.sets),
        "variables": list(holds.variables),
    }


HEADINGS = ("name", "usual suffix", "written", "on a grid", "holds")
LETTERS = {"turned_surface": "a", "transmission": "t", "relative": "r", "gaps": "g", "uncertainty": "u"}
LEGEND = (
    "all are read; holds: a surfaces turned about the normal (anisotropic), t transmission, r relative data, "
    "g missing values, u uncertainties"
)


def programs() -> str:
    """The names of what models are written for beside these formats."""
    from gonio.exporting import targets
    from gonio.exporting.targets import tables

    others = [t.name for t in targets().values() if not t.refused and t not in tables.TARGETS]
    return f"gonio export --to NAME writes models for programs too: {', '.join(others)}"


def rows() -> list[tuple[str, ...]]:
    """One row a format under HEADINGS."""
    out: list[tuple[str, ...]] = []
    for one in records():
        one["uncertainty"] = bool({"*", "uncertainty"} & set(one["variables"]))
        letters = " ".join(letter if one[key] else "·" for key, letter in LETTERS.items())
        out.append((one["name"], one["suffix"], YES if one["write"] else NO, YES if one["grid"] else NO, letters))
    return out


def table() -> "Table":
    """The formats for people; what each can hold decides what a conversion must leave out."""
    out = output.table(*HEADINGS, left=len(HEADINGS))
    for row in rows():
        out.add_row(*row)
    return out
