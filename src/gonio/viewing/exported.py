"""The values of a page for other programs: the targets of `gonio export`, and what they write."""

import base64
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from gonio.exporting.entry import chosen
from gonio.exporting.registry import targets
from gonio.exporting.source import identifier
from gonio.exporting.subject import Subject, of_model, of_solution
from gonio.exporting.target import Request
from gonio.measured import dataset
from gonio.viewing.sliders import Sliders


def listed() -> list[dict[str, str]]:
    """The targets to choose from, and why a program takes nothing."""
    return [
        {
            "name": one.name,
            "title": one.title,
            "writes": one.writes,
            "suffix": one.suffixes[0] if one.suffixes else "",
            "refused": one.refused,
        }
        for one in targets().values()
    ]


def written(at: Sliders, target: str, scale: float | None) -> dict[str, Any]:
    """The files of a target as base64 by name, and its remarks.

    scale: the 1/sr of one unit of relative data. Raises ValueError for a target that does not exist, or that cannot
    take the model.
    """
    name = stem(at.opened.name) + f"-{at.model.name}"
    program = chosen(target or "python", Path(name))
    suffix = program.suffixes[0] if program.suffixes else ""
    request = Request(Path(f"{name}{suffix}"), identifier(at.model.name))
    made = program.make(subject(at, scale), request)
    files = {
        file: base64.b64encode(content.encode() if isinstance(content, str) else content).decode()
        for file, content in made.files.items()
    }
    numbers = {key: value for key, value in made.numbers.items() if isinstance(value, int | float | str)}
    return {"target": program.title, "files": files, "remarks": list(made.remarks), "numbers": numbers}


def subject(at: Sliders, scale: float | None) -> Subject:
    """The fit, where the values are its own, with their uncertainties; else the values that the page shows."""
    selected = _selected(at)
    if at.are_fitted and at.fit is not None:
        return of_solution(at.fit, scale=scale, select=_of_fit(at))
    unit = dataset.unit(at.opened.scan)
    where = ", ".join(f"{key} {value}" for key, value in selected.items())
    origin = f"values of {at.model.name}, set by hand on a page of {at.opened.name}" + (f", {where}" if where else "")
    return of_model(at.model, at.at_cell(at.cell), scale=scale, unit=unit, origin=origin)


def _selected(at: Sliders) -> Mapping[str, Any]:
    selected: Mapping[str, Any] = at.opened.columns.header["blocks"][at.block]
    return selected


def _of_fit(at: Sliders) -> dict[str, str]:
    """The groups of the cell that is shown, by the coordinate of each."""
    found: dict[str, str] = {}
    for group in at.groups.values():
        label = group.labels[group.cells[at.cell]]
        found |= dict(zip(group.by, label.split(","), strict=False))
    return found


def stem(name: str) -> str:
    """The name of a scan as the beginning of the name of a file."""
    plain = re.sub(r"[^A-Za-z0-9._-]+", "-", Path(name).stem).strip(".-")
    return plain[:60] or "scan"
