"""The file formats as a table and as plain data, read from their declarations."""

from typing import TYPE_CHECKING, Any

from gonio.app import present
from gonio.measured.format import Format
from gonio.measured.formats import formats

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


HEADINGS = ("name", "suffix", "write", "grid", "turned", "transm.", "relative", "gaps", "uncert.")


def rows() -> list[tuple[str, ...]]:
    """One row a format under HEADINGS."""
    return [
        (
            r["name"],
            r["suffix"],
            *(YES if r[key] else NO for key in ("write", "grid", "turned_surface", "transmission", "relative", "gaps")),
            YES if {"*", "uncertainty"} & set(r["variables"]) else NO,
        )
        for r in records()
    ]


def table() -> "Table":
    """The formats for people: all are read; what each can hold decides what a conversion must leave out."""
    out = present.table(*HEADINGS, left=len(HEADINGS))
    for row in rows():
        out.add_row(*row)
    return out
